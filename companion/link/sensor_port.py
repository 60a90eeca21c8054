"""Where the lidar's datagrams come in: a UDP port that is polled, so that a burst of packets wakes nobody up."""

import socket
from collections.abc import Iterator
from contextlib import suppress

from companion.errors import UsageError

RECEIVE_BUFFER_BYTES = 1 << 20
"""Room for a third of a second of a real device."""
LARGEST_DATAGRAM_BYTES = 2048
MOST_AT_ONCE = 512
"""Datagrams of one poll: whoever floods the port does not hold up the setpoints."""


def parse_address(text: str) -> tuple[str, int]:
    """Host and port, written HOST:PORT.

    Raises:
        UsageError: it is none.

    Example:
        >>> parse_address("192.168.1.50:56301")
        ('192.168.1.50', 56301)
    """
    host, colon, port = text.rpartition(":")
    if not (colon and host and port.isdecimal() and 0 < int(port) < 65536):
        raise UsageError(f"--lidar {text}: expected HOST:PORT with a port up to 65535, as in 127.0.0.1:56300")
    return host, int(port)


class SensorPort:
    """A bound UDP socket.

    Args:
        host: the interface that the sensor reaches.
        port: where it sends to.

    Raises:
        UsageError: the port cannot be bound.
    """

    def __init__(self, host: str, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
        try:
            self._socket.bind((host, port))
        except (OSError, OverflowError) as problem:
            self._socket.close()
            why = str(problem.strerror if isinstance(problem, OSError) else problem).lower()
            raise UsageError(f"--lidar {host}:{port}: {why}") from None

    def poll(self) -> Iterator[bytes]:
        """The datagrams that have come in since the last call, the oldest first."""
        with suppress(OSError):
            for _ in range(MOST_AT_ONCE):
                yield self._socket.recv(LARGEST_DATAGRAM_BYTES)

    def close(self) -> None:
        self._socket.close()

    def __enter__(self) -> "SensorPort":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
