"""Byte streams: TCP as client (connects again by itself) and as server (takes in whoever connects)."""

import asyncio
import contextlib
from dataclasses import dataclass

from gcs.errors import UsageError
from gcs.link.connection import Address, Connection, Notice, Receiver
from gcs.link.frames import FrameSplitter
from gcs.link.retries import Retries
from gcs.link.url import LinkUrl

CONNECT_TIMEOUT_S = 5.0
READ_BYTES = 8192
"""At once, so that everything else has its turn soon, whatever is in it."""
MOST_UNSENT_BYTES = 65536
"""A reader that is slower than this loses frames, and does not hold up the others."""
MOST_CLIENTS = 64
IDLE_S = 10.0
"""Where there are too many clients, one that was silent so long makes room."""


async def _read(reader: asyncio.StreamReader, take: Receiver, connection: "TcpClient | TcpServer", peer: Address):
    """Hand on frames until the stream ends."""
    splitter = FrameSplitter()
    while data := await reader.read(READ_BYTES):
        for frame in splitter.feed(data):
            take(connection, frame, peer)
        await asyncio.sleep(0)  # a reader with data at hand does not wait, and would let nobody else run


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
        loop, retries = asyncio.get_running_loop(), Retries()
        while True:
            try:
                async with asyncio.timeout(CONNECT_TIMEOUT_S):
                    reader, self._writer = await asyncio.open_connection(self.url.host, self.url.port)
            except (OSError, TimeoutError) as problem:
                if retries.is_first:
                    self._say(f"{self.url}: {problem or 'no answer'}; trying again")
            else:
                self._say(f"{self.url}: connected")
                begun_s = loop.time()
                await self._converse(reader)
                retries.held(loop.time() - begun_s)
                self._say(f"{self.url}: connection lost; connecting again")
            await asyncio.sleep(retries.take())

    async def _converse(self, reader: asyncio.StreamReader) -> None:
        try:
            with contextlib.suppress(OSError):
                await _read(reader, self._receiver, self, (self.url.host, self.url.port))
        finally:
            if self._writer is not None:
                self._writer.close()
                self._writer = None


@dataclass
class _Client:
    writer: asyncio.StreamWriter
    heard_s: float


class TcpServer:
    """A listening socket; each client is one address."""

    peer: Address | None = None

    def __init__(self, url: LinkUrl, receiver: Receiver, say: Notice) -> None:
        self.url, self.budget_bytes_s = url, url.budget_bytes_s
        self._receiver, self._say = receiver, say
        self._clients: dict[Address, _Client] = {}
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
        if (client := self._clients.get(address)) is not None:
            _write(client.writer, datagram)

    def close(self) -> None:
        if self._server is not None:
            self._server.close()
        for client in self._clients.values():
            client.writer.close()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        peer: Address = writer.get_extra_info("peername")[:2]
        now_s = asyncio.get_running_loop().time()
        if not self._has_room(now_s):
            writer.close()
            return
        self._clients[peer] = _Client(writer, now_s)
        self._say(f"{self.url}: {peer[0]}:{peer[1]} has connected")
        try:
            with contextlib.suppress(OSError):
                await _read(reader, self._take, self, peer)
        finally:
            self._clients.pop(peer, None)
            writer.close()

    def _take(self, connection: Connection, frame: bytes, peer: Address) -> None:
        if (client := self._clients.get(peer)) is not None:
            client.heard_s = asyncio.get_running_loop().time()
        self._receiver(connection, frame, peer)

    def _has_room(self, now_s: float) -> bool:
        """Whether one more client may come; who only keeps a place is sent away for it."""
        if len(self._clients) < MOST_CLIENTS:
            return True
        peer, longest = min(self._clients.items(), key=lambda item: item[1].heard_s)
        if now_s - longest.heard_s < IDLE_S:
            return False
        del self._clients[peer]
        longest.writer.close()
        return True
