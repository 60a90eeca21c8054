"""UDP endpoints: the only sockets of the ground station's MAVLink."""

import asyncio
import socket
from collections.abc import Callable
from typing import cast

from gcs.errors import UsageError
from gcs.link.url import LinkUrl, Scheme

Address = tuple[str, int]
Receiver = Callable[["UdpConnection", bytes, Address], None]

RECEIVE_BUFFER_BYTES = 4 << 20
"""A fleet's telemetry arrives in bursts; the kernel's default buffer holds a few hundred datagrams."""


class UdpConnection(asyncio.DatagramProtocol):
    """One bound or connected datagram socket."""

    def __init__(self, url: LinkUrl, receiver: Receiver) -> None:
        self.url = url
        self.peer: Address | None = (url.host, url.port) if url.scheme is Scheme.UDP_OUT else None
        """Where to send before anybody was heard."""
        self._receiver = receiver
        self._transport: asyncio.DatagramTransport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.DatagramTransport, transport)  # asyncio's own class does not derive from it

    def datagram_received(self, data: bytes, addr: Address) -> None:
        self._receiver(self, data, (addr[0], addr[1]))

    def send(self, datagram: bytes, address: Address) -> None:
        if self._transport is not None and not self._transport.is_closing():
            self._transport.sendto(datagram, address)

    def close(self) -> None:
        if self._transport is not None:
            self._transport.close()


async def open_udp(url: LinkUrl, receiver: Receiver) -> UdpConnection:
    """Bind (`udpin`) or prepare to send (`udpout`).

    Raises:
        UsageError: the address cannot be bound; names the port and why.
    """
    loop = asyncio.get_running_loop()
    local = (url.host, url.port) if url.scheme is Scheme.UDP_IN else ("0.0.0.0", 0)
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.setblocking(False)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
    try:
        sock.bind(local)
    except OSError as problem:
        sock.close()
        hint = "another ground station is running here, or end it first" if url.scheme is Scheme.UDP_IN else "no route"
        raise UsageError(f"cannot bind UDP {url.host}:{url.port}: {problem.strerror} ({hint})") from None
    _, connection = await loop.create_datagram_endpoint(lambda: UdpConnection(url, receiver), sock=sock)
    return connection
