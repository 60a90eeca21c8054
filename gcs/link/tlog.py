"""Flight recordings: `.tlog` files as MAVProxy and QGroundControl read them.

Each record is a big-endian uint64 of microseconds since the UNIX epoch, then one MAVLink frame as it was on the wire.
"""

import struct
from pathlib import Path

_STAMP = struct.Struct(">Q")


class TlogWriter:
    """Appends frames to a recording."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("wb")

    def write(self, frame: bytes | bytearray, unix_us: int) -> None:
        self._file.write(_STAMP.pack(unix_us) + frame)

    def close(self) -> None:
        self._file.close()
