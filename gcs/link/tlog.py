"""Flight recordings: `.tlog` files as MAVProxy and QGroundControl read them.

Each record is a big-endian uint64 of microseconds since the UNIX epoch, then one MAVLink frame as it was on the wire.
"""

import struct
from pathlib import Path

_STAMP = struct.Struct(">Q")


class TlogWriter:
    """Appends frames to a recording.

    Args:
        path: the file.
        keep: go on with what is there; otherwise it is begun anew.
    """

    def __init__(self, path: Path, *, keep: bool = False) -> None:
        self._file = path.open("ab" if keep else "wb")

    def write(self, frame: bytes | bytearray, unix_us: int) -> None:
        self._file.write(_STAMP.pack(unix_us) + frame)

    def close(self) -> None:
        self._file.close()
