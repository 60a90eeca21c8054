"""MAVLink microservices, the ground station's side: sans-IO state machines.

Each is started, given the messages of its peer and told when its deadline passes; each time it returns
what is to be sent. It knows no socket, no clock and no event loop; `gcs.station` drives it.
"""

from abc import ABC, abstractmethod

from gcs.dialect import Message


class Microservice(ABC):
    """One exchange with one component of one vehicle."""

    peer: tuple[int, int]
    """System and component id of the other side."""
    wants: frozenset[str]
    """Names of the messages that this exchange reads."""
    deadline_s: float
    """When `handle_timeout` is due, on the clock of `now_s`."""
    done: bool
    turn: str | None = None
    """Exchanges with the same turn and peer take place one after the other."""
    makes_safe: bool = False
    """Whether it may be sent also where it is not certain to whom."""

    @abstractmethod
    def start(self, now_s: float) -> list[Message]: ...

    @abstractmethod
    def receive(self, message: Message, now_s: float) -> list[Message]: ...

    @abstractmethod
    def handle_timeout(self, now_s: float) -> list[Message]: ...

    def abandon(self) -> list[Message]:
        """What to send when the exchange is broken off before its end."""
        return []

    def replaced_by(self, newer: "Microservice") -> Exception | None:
        """The error with which this exchange ends because `newer` is to take its place; None if it goes on."""
        return None


class Backoff:
    """When to ask again: after `first_s`, then each time half as long again, at most `attempts` times."""

    def __init__(self, first_s: float, attempts: int, longest_s: float = 2.0) -> None:
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
