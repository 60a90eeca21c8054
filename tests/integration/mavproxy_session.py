"""MAVProxy as a child process: typed at like an operator does, and read."""

import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

MAVPROXY = Path(sys.executable).with_name("mavproxy.py")
MODULES = "wp,rally,fence,param,arm,mode,cmdlong,misc,message,signing"


class MavproxySession:
    """What MAVProxy is told, and what it has printed since.

    Args:
        process: the program, its output not blocking.
        folder: where it writes.
    """

    def __init__(self, process: subprocess.Popen[bytes], folder: Path) -> None:
        self.folder = folder
        self._process = process
        self._printed = ""
        self._seen = 0

    def type(self, line: str) -> None:
        """Enter a line; what was printed before it is no answer to it."""
        self._read()
        self._seen = len(self._printed)
        self._process.stdin.write(line.encode() + b"\n")
        self._process.stdin.flush()

    def answer(self, pattern: str, timeout_s: float = 10.0) -> re.Match[str]:
        """Wait until something has been printed since the last line was typed."""
        deadline_s = time.monotonic() + timeout_s
        while (found := re.search(pattern, self._printed[self._seen :])) is None:
            recent = self._printed[self._seen :][-1500:]
            assert time.monotonic() < deadline_s, f"no {pattern!r} within {timeout_s} s in:\n{recent}"
            time.sleep(0.02)
            self._read()
        return found

    def ask(self, line: str, pattern: str, timeout_s: float = 10.0) -> re.Match[str]:
        """Type a line and wait for its answer."""
        self.type(line)
        return self.answer(pattern, timeout_s)

    def value(self, message: str, field: str) -> float:
        """A number in the newest message of a kind."""
        found = self.ask(f"status {message}", rf"{message} {{.*?\b{field} : (-?[\d.e+-]+)")
        return float(found[1])

    def until(self, message: str, field: str, low: float, high: float, timeout_s: float = 15.0) -> None:
        """Wait until a number in a kind of message is in a range."""
        deadline_s = time.monotonic() + timeout_s
        while not low <= (found := self.value(message, field)) <= high:
            assert time.monotonic() < deadline_s, f"{message}.{field} is {found}, expected {low} to {high}"
            time.sleep(0.1)

    def _read(self) -> None:
        while chunk := self._process.stdout.read(65536):
            self._printed += chunk.decode(errors="replace")


@contextmanager
def running_mavproxy(port: int, folder: Path) -> Iterator[MavproxySession]:
    """MAVProxy on a UDP port of this machine, its files in `folder`, ended with the block."""
    command = [str(MAVPROXY), f"--master=udpin:127.0.0.1:{port}", f"--default-modules={MODULES}"]
    process = subprocess.Popen(
        [*command, f"--state-basedir={folder}", "--aircraft=simulated"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        cwd=folder,
        env={**os.environ, "TERM": "dumb", "PYTHONUNBUFFERED": "1", "HOME": str(folder)},
    )
    os.set_blocking(process.stdout.fileno(), False)
    try:
        yield MavproxySession(process, folder)
    finally:
        process.stdin.close()
        try:
            process.wait(5.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait(5.0)
        process.stdout.close()
