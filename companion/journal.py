"""The log of decisions: one JSON object per line, stamped with vehicle time; state changes go to the console, too."""

import sys
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any, TextIO

import msgspec

from companion.errors import UsageError


class Journal:
    """Writes what a companion decides.

    Args:
        sysid: of the vehicle, for the console's lines.
        path: the file, or None.
        say: prints a line for people.

    Raises:
        UsageError: the file cannot be written.
    """

    def __init__(self, sysid: int, path: Path | None, say: Callable[[str], None] | None = None) -> None:
        self._sysid = sysid
        self._say = say or _say_to_stderr
        self._file: TextIO | None = None
        if path is not None:
            try:
                self._file = path.open("w", buffering=1)
            except OSError as problem:
                raise UsageError(f"--log {path}: cannot be written: {problem.strerror}") from None

    def write(self, now_s: float, event: str, **fields: Any) -> None:
        """One decision at vehicle time `now_s` [s]."""
        if self._file is not None:
            entry = {"t_s": round(now_s, 3), "event": event, **fields}
            self._file.write(msgspec.json.encode(entry).decode() + "\n")

    def tell(self, text: str) -> None:
        """A line for people."""
        self._say(f"companion {self._sysid}: {text}")

    def __enter__(self) -> "Journal":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._file is not None:
            self._file.close()


def _say_to_stderr(line: str) -> None:
    print(line, file=sys.stderr, flush=True)
