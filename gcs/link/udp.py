"""UDP endpoints: `udpin` and `udpout`."""

import asyncio
import contextlib
import socket

from gcs.errors import UsageError
from gcs.link.connection import Address, Receiver
from gcs.link.url import LinkUrl, Scheme

RECEIVE_BUFFER_BYTES = 4 << 20
"""A fleet's telemetry arrives in bursts; the kernel's default buffer holds a few hundred datagrams."""
LARGEST_DATAGRAM_BYTES = 4096
"""Frames are short, and senders pack no more of them together than go through a network; what is longer is cut off."""
DATAGRAM_BYTES = 100
"""What the handling of a datagram counts for besides its content: empty ones are work, too."""
MOST_BYTES_AT_ONCE = 32768
"""What is taken in before everything else has its turn: 20 ms of work, whatever is in it."""


class UdpConnection:
    """One bound datagram socket; all waiting datagrams are taken in at one wake-up of the event loop."""

    def __init__(self, url: LinkUrl, receiver: Receiver, end: socket.socket) -> None:
        self.url = url
        self.peer: Address | None = (url.host, url.port) if url.scheme is Scheme.UDP_OUT else None
        self.budget_bytes_s = url.budget_bytes_s
        self._receiver, self._end = receiver, end
        asyncio.get_running_loop().add_reader(end, self._receive)

    def send(self, datagram: bytes, address: Address) -> None:
        with contextlib.suppress(OSError):  # no room, no route: lost, as on any link
            self._end.sendto(datagram, address)

    def close(self) -> None:
        if self._end.fileno() >= 0:
            asyncio.get_running_loop().remove_reader(self._end)
            self._end.close()

    def _receive(self) -> None:
        taken_bytes = 0
        while taken_bytes < MOST_BYTES_AT_ONCE:
            try:
                datagram, address = self._end.recvfrom(LARGEST_DATAGRAM_BYTES)
            except ConnectionError:
                continue  # an ICMP answer to what was sent to somebody who is gone
            except OSError:
                return
            taken_bytes += len(datagram) + DATAGRAM_BYTES
            self._receiver(self, datagram, address)


async def open_udp(url: LinkUrl, receiver: Receiver) -> UdpConnection:
    """Bind (`udpin`) or prepare to send (`udpout`).

    Raises:
        UsageError: the address cannot be bound; names the port and why.
    """
    local = (url.host, url.port) if url.scheme is Scheme.UDP_IN else ("0.0.0.0", 0)
    end = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    end.setblocking(False)
    end.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
    try:
        end.bind(local)
    except OSError as problem:
        end.close()
        hint = "another ground station is running here, or end it first" if url.scheme is Scheme.UDP_IN else "no route"
        raise UsageError(f"cannot bind UDP {url.host}:{url.port}: {problem.strerror} ({hint})") from None
    return UdpConnection(url, receiver, end)
