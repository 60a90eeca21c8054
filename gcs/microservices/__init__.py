"""MAVLink microservices, the ground station's side: sans-IO state machines.

Each is started, given the messages of its peer and told when its deadline passes; each time it returns
what is to be sent. It knows no socket, no clock and no event loop; `gcs.station` drives it.
"""

from typing import Protocol

from gcs.dialect import Message


class Microservice(Protocol):
    """One exchange with one component of one vehicle."""

    peer: tuple[int, int]
    """System and component id of the other side."""
    wants: frozenset[str]
    """Names of the messages that this exchange reads."""
    deadline_s: float
    """When `handle_timeout` is due, on the clock of `now_s`."""

    @property
    def done(self) -> bool: ...

    def start(self, now_s: float) -> list[Message]: ...

    def receive(self, message: Message, now_s: float) -> list[Message]: ...

    def handle_timeout(self, now_s: float) -> list[Message]: ...

    def abandon(self) -> list[Message]:
        """What to send when the exchange is broken off before its end."""
        ...


class Backoff:
    """When to ask again: after `first_s`, then each time half as long again, at most `attempts` times."""

    def __init__(self, first_s: float, attempts: int, longest_s: float = 3.0) -> None:
        self._next_s, self._longest_s, self._attempts = first_s, longest_s, attempts
        self.taken = 0
        """Attempts used."""

    @property
    def exhausted(self) -> bool:
        return self.taken >= self._attempts

    def take(self) -> float:
        """Use one attempt; how long [s] to wait for its answer."""
        wait_s = self._next_s
        self.taken += 1
        self._next_s = min(1.5 * self._next_s, self._longest_s)
        return wait_s
