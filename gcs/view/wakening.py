"""What makes viser's event for new messages safe to set in another thread than its own.

viser sets that event in the thread that has something to send, and again in its own. In another thread, going through
those who wait for it fails now and then ("deque mutated during iteration"), in the middle of an update of the page.
"""

import asyncio


class SharedEvent(asyncio.Event):
    """An event that any thread may set; whoever waits is woken when it is set in the thread of the loop."""

    _value: bool
    _loop: asyncio.AbstractEventLoop | None

    def set(self) -> None:
        in_loop = self._loop is not None and asyncio._get_running_loop() is self._loop
        self._value = not in_loop  # of an event that is set already, nobody would be woken
        if in_loop:
            super().set()


def make_shared(event: asyncio.Event) -> None:
    """Give an event the behaviour of `SharedEvent`; whoever waits for it already goes on waiting."""
    event.__class__ = SharedEvent
