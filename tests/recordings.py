"""Reads flight recordings (`.tlog`) back, record by record: a big-endian uint64 of microseconds, then one frame."""

import struct
from collections.abc import Iterator
from pathlib import Path

_STAMP = struct.Struct(">Q")
_V1, _V2 = 0xFE, 0xFD


def read_tlog(path: Path) -> Iterator[tuple[int, bytes]]:
    """Yield (microseconds since the epoch, frame) of a recording; stop quietly at a torn end.

    Raises:
        OSError: the file cannot be read.
    """
    data = path.read_bytes()
    at = 0
    while at + _STAMP.size + 8 <= len(data):
        (unix_us,) = _STAMP.unpack_from(data, at)
        start = at + _STAMP.size
        length = _frame_length(data, start)
        if length == 0 or start + length > len(data):
            return
        yield unix_us, data[start : start + length]
        at = start + length


def _frame_length(data: bytes, start: int) -> int:
    """Bytes of the frame that begins at `start`; 0 where none does."""
    payload = data[start + 1]
    if data[start] == _V2:
        signed = data[start + 2] & 1
        return 12 + payload + (13 if signed else 0)
    return 8 + payload if data[start] == _V1 else 0
