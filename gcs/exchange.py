"""One microservice at work: fed with messages as they arrive and with its deadlines, until it is done or fails."""

import asyncio
import contextvars
import math
from collections.abc import Callable

from gcs.dialect import Message
from gcs.microservices import Microservice

Send = Callable[[list[Message]], None]


class Exchange:
    """Drives a microservice without queues: what arrives is handed over at once, so nothing can pile up.

    Args:
        service: what is driven.
        send: sends to its peer.
    """

    def __init__(self, service: Microservice, send: Send) -> None:
        self.service, self._send = service, send
        self._loop = asyncio.get_running_loop()
        self._ended: asyncio.Future[None] = self._loop.create_future()
        self._timer: asyncio.TimerHandle | None = None
        self._context = contextvars.copy_context()
        """Whose order this is, for the audit log: answers arrive and timers fire in nobody's context."""

    async def run(self) -> None:
        """Until the service is done; its errors pass through. Cancelled, it tells the peer."""
        self._step(self.service.start)
        try:
            await self._ended
        except asyncio.CancelledError:
            self._send(self.service.abandon())
            raise
        finally:
            if self._timer is not None:
                self._timer.cancel()

    def deliver(self, message: Message) -> None:
        """Hand over a message of the peer, if the service reads such."""
        if message.get_type() in self.service.wants and not self._ended.done():
            self._context.copy().run(self._step, lambda now_s: self.service.receive(message, now_s))

    def give_way_to(self, newer: Microservice) -> None:
        """End if a newer order to the same component makes this one void."""
        error = self.service.replaced_by(newer)
        if error is not None and not self._ended.done():
            self._ended.set_exception(error)

    def _step(self, step: Callable[[float], list[Message]]) -> None:
        try:
            messages = step(self._loop.time())
        except Exception as problem:
            if not self._ended.done():
                self._ended.set_exception(problem)
            return
        self._send(messages)
        if self.service.done:
            if not self._ended.done():
                self._ended.set_result(None)
        else:
            self._arm()

    def _arm(self) -> None:
        """A later deadline is looked at when the timer fires; only an earlier one needs a new timer."""
        deadline_s = self.service.deadline_s
        if self._timer is not None:
            if self._timer.when() <= deadline_s:
                return
            self._timer.cancel()
            self._timer = None
        if math.isfinite(deadline_s):
            self._timer = self._loop.call_at(deadline_s, self._fire)

    def _fire(self) -> None:
        self._timer = None
        if self._ended.done():
            return
        if self.service.deadline_s > self._loop.time():
            self._arm()
        else:
            self._context.copy().run(self._step, self.service.handle_timeout)
