"""Byte streams: TCP as client (connects again by itself) and as server (takes in whoever connects)."""

import asyncio
import contextlib

from gcs.errors import UsageError
from gcs.link.connection import Address, Notice, Receiver
from gcs.link.frames import FrameSplitter
from gcs.link.url import LinkUrl

FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.25, 5.0
"""Between tries to connect; each is twice as long as the one before."""
CONNECT_TIMEOUT_S = 5.0
READ_BYTES = 65536
MOST_UNSENT_BYTES = 65536
"""A reader that is slower than this loses frames, and does not hold up the others."""
MOST_CLIENTS = 64


async def _read(reader: asyncio.StreamReader, take: Receiver, connection: "TcpClient | TcpServer", peer: Address):
    """Hand on frames until the stream ends."""
    splitter = FrameSplitter()
    while data := await reader.read(READ_BYTES):
        for frame in splitter.feed(data):
            take(connection, frame, peer)


def _write(writer: asyncio.StreamWriter, frame: bytes) -> None:
    if not writer.is_closing() and writer.transport.get_write_buffer_size() < MOST_UNSENT_BYTES:
        writer.write(frame)


class TcpClient:
    """A connection to a TCP server, made again with growing pauses whenever it is lost."""

    def __init__(self, url: LinkUrl, receiver: Receiver, say: Notice) -> None:
        self.url, self.budget_bytes_s = url, url.budget_bytes_s
        self.peer: Address | None = (url.host, url.port)
        self._receiver, self._say = receiver, say
        self._writer: asyncio.StreamWriter | None = None
        self._task = asyncio.get_running_loop().create_task(self._run(), name=str(url))

    def send(self, datagram: bytes, address: Address) -> None:
        if self._writer is not None:
            _write(self._writer, datagram)

    def close(self) -> None:
        self._task.cancel()

    async def _run(self) -> None:
        pause_s = FIRST_PAUSE_S
        while True:
            try:
                async with asyncio.timeout(CONNECT_TIMEOUT_S):
                    reader, self._writer = await asyncio.open_connection(self.url.host, self.url.port)
            except (OSError, TimeoutError) as problem:
                if pause_s == FIRST_PAUSE_S:
                    self._say(f"{self.url}: {problem or 'no answer'}; trying again")
            else:
                self._say(f"{self.url}: connected")
                pause_s = FIRST_PAUSE_S
                await self._converse(reader)
                self._say(f"{self.url}: connection lost; connecting again")
            await asyncio.sleep(pause_s)
            pause_s = min(2 * pause_s, LONGEST_PAUSE_S)

    async def _converse(self, reader: asyncio.StreamReader) -> None:
        try:
            with contextlib.suppress(OSError):
                await _read(reader, self._receiver, self, (self.url.host, self.url.port))
        finally:
            if self._writer is not None:
                self._writer.close()
                self._writer = None


class TcpServer:
    """A listening socket; each client is one address."""

    peer: Address | None = None

    def __init__(self, url: LinkUrl, receiver: Receiver, say: Notice) -> None:
        self.url, self.budget_bytes_s = url, url.budget_bytes_s
        self._receiver, self._say = receiver, say
        self._clients: dict[Address, asyncio.StreamWriter] = {}
        self._server: asyncio.Server | None = None

    async def open(self) -> None:
        """Listen.

        Raises:
            UsageError: the address cannot be bound.
        """
        try:
            self._server = await asyncio.start_server(self._serve, self.url.host, self.url.port)
        except OSError as problem:
            raise UsageError(f"cannot bind TCP {self.url.host}:{self.url.port}: {problem.strerror}") from None

    def send(self, datagram: bytes, address: Address) -> None:
        if (writer := self._clients.get(address)) is not None:
            _write(writer, datagram)

    def close(self) -> None:
        if self._server is not None:
            self._server.close()
        for writer in self._clients.values():
            writer.close()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        peer: Address = writer.get_extra_info("peername")[:2]
        if len(self._clients) >= MOST_CLIENTS:
            writer.close()
            return
        self._clients[peer] = writer
        self._say(f"{self.url}: {peer[0]}:{peer[1]} has connected")
        try:
            with contextlib.suppress(OSError):
                await _read(reader, self._receiver, self, peer)
        finally:
            self._clients.pop(peer, None)
            writer.close()
