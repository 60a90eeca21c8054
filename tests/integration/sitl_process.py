"""The `sitl` program as a child process, and a ground station's socket beside it."""

import socket
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sitl.dialect import mavlink

SITL = Path(sys.executable).with_name("sitl")
RECEIVE_BUFFER_BYTES = 1 << 22
"""Room for the seconds in which a test does not listen."""


def free_instance_base() -> int:
    """A shift at which the first ports of all kinds are free."""
    for base in range(2000, 8900, 300):
        if all(is_free(port + base) for port in (14540, 14550, 14580, 14990, 18570, 56300)):
            return base
    raise AssertionError("no free ports")


def is_free(port: int) -> bool:
    """Nobody listens on a UDP port of this machine."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return False
    return True


@contextmanager
def running_sitl(*arguments: str, base: int) -> Iterator[subprocess.Popen]:
    """A simulator that has said that it is ready, and that ends with the block."""
    command = [str(SITL), *arguments, "--instance-base", str(base), "--supervised"]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            line = process.stdout.readline()
            assert line.startswith("sitl: ready"), (line, process.poll())
            yield process
        finally:
            process.stdin.close()
            process.wait(10.0)
            process.stdout.close()
            process.stderr.close()


class GroundStation:
    """A bare MAVLink end on the GCS port: sends what it is told, keeps what it hears."""

    def __init__(self, base: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
        self._socket.bind(("127.0.0.1", 14550 + base))
        self._socket.setblocking(False)
        self._base = base
        self._codec = mavlink.MAVLink(None, 255, 190)
        self._parser = mavlink.MAVLink(None)
        self._parser.robust_parsing = True
        self.heard: list[Any] = []
        self._by_kind: dict[str, list[Any]] = defaultdict(list)

    def close(self) -> None:
        self._socket.close()

    def send(self, message: Any, sysid: int = 1) -> None:
        self._socket.sendto(message.pack(self._codec), ("127.0.0.1", 18570 + self._base + sysid - 1))
        self._codec.seq = (self._codec.seq + 1) % 256

    def sign(self, key: bytes) -> None:
        """Sign from now on, on this machine's clock."""
        signing = self._codec.signing
        signing.secret_key, signing.sign_outgoing = key, True
        signing.timestamp = (time.time_ns() // 1000 - 1_420_070_400_000_000) // 10

    def listen(self) -> list[Any]:
        """Take in what has arrived."""
        while True:
            try:
                datagram = self._socket.recv(2048)
            except BlockingIOError:
                return self.heard
            for message in self._parser.parse_buffer(datagram) or []:
                self.heard.append(message)
                self._by_kind[message.get_type()].append(message)

    def of(self, kind: str) -> list[Any]:
        """All messages of one kind so far."""
        self.listen()
        return self._by_kind[kind]

    def last(self, kind: str, sysid: int = 1, component: int | None = None) -> Any:
        """The newest message of one kind from one system; None where there is none."""
        senders = {component} if component is not None else range(256)
        newest_first = reversed(self.of(kind))
        return next((m for m in newest_first if m.get_srcSystem() == sysid and m.get_srcComponent() in senders), None)

    def forget(self) -> None:
        """Begin anew with nothing heard."""
        self.heard.clear()
        self._by_kind.clear()

    def until(self, holds: Callable[[], Any], timeout_s: float = 10.0) -> Any:
        """Listen until something holds; what it was."""
        deadline_s = time.monotonic() + timeout_s
        while not (found := holds()):
            assert time.monotonic() < deadline_s, f"not within {timeout_s} s"
            time.sleep(0.02)
        return found
