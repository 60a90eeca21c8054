"""A serial line (a telemetry radio, a USB cable), opened again by itself when it was unplugged."""

import asyncio
import os

import serial

from gcs.link.connection import Address, Notice, Receiver
from gcs.link.frames import FrameSplitter
from gcs.link.retries import Retries
from gcs.link.url import LinkUrl

READ_BYTES = 4096


class SerialLine:
    """One device at one baud rate; its only address is (device, baud)."""

    def __init__(self, url: LinkUrl, receiver: Receiver, say: Notice) -> None:
        self.url, self.budget_bytes_s = url, url.budget_bytes_s
        self.peer: Address | None = (url.host, url.port)
        self.dropped = 0
        """Frames for which the device had no room."""
        self._receiver, self._say = receiver, say
        self._port: serial.Serial | None = None
        self._splitter = FrameSplitter()
        self._lost = asyncio.Event()
        self._task = asyncio.get_running_loop().create_task(self._run(), name=str(url))

    def send(self, datagram: bytes, address: Address) -> None:
        if self._port is None:
            return
        try:
            written = os.write(self._port.fileno(), datagram)
        except BlockingIOError:
            written = 0
        except OSError:
            self._lost.set()
            return
        self.dropped += written < len(datagram)

    def close(self) -> None:
        self._task.cancel()

    async def _run(self) -> None:
        loop, retries = asyncio.get_running_loop(), Retries()
        while True:
            try:
                self._port = serial.Serial(self.url.host, self.url.port, timeout=0, write_timeout=0)
            except (OSError, ValueError) as problem:
                if retries.is_first:
                    self._say(f"{self.url}: {problem}; trying again")
            else:
                self._say(f"{self.url}: open")
                begun_s = loop.time()
                await self._listen(self._port)
                retries.held(loop.time() - begun_s)
                self._say(f"{self.url}: gone; opening it again")
            await asyncio.sleep(retries.take())

    async def _listen(self, port: serial.Serial) -> None:
        loop, number = asyncio.get_running_loop(), port.fileno()
        os.set_blocking(number, False)
        self._lost.clear()
        self._splitter = FrameSplitter()
        loop.add_reader(number, self._read, number)
        try:
            await self._lost.wait()
        finally:
            loop.remove_reader(number)
            self._port = None
            port.close()

    def _read(self, number: int) -> None:
        try:
            data = os.read(number, READ_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self._lost.set()
            return
        for frame in self._splitter.feed(data):
            self._receiver(self, frame, (self.url.host, self.url.port))
