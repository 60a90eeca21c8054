"""What every connection does for the station, and how a connection string becomes one."""

from collections.abc import Callable
from typing import Protocol

Address = tuple[str, int]


class Connection(Protocol):
    """A datagram socket, a stream, a serial line, or their stand-in in memory."""

    peer: Address | None
    """Where to send before anybody was heard; None if there is nobody to be addressed."""
    budget_bytes_s: float | None
    """What may be sent and asked for per second; None is without limit."""

    def send(self, datagram: bytes, address: Address) -> None: ...


class OpenConnection(Connection, Protocol):
    """A connection that can be closed."""

    def close(self) -> None: ...


Receiver = Callable[[Connection, bytes, Address], None]
"""Takes in one datagram, or one frame of a stream."""
Notice = Callable[[str], None]
"""Takes a sentence about a connection's state."""
