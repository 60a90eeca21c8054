"""Flight recordings: `.tlog` files as MAVProxy and QGroundControl read them.

Each record is a big-endian uint64 of microseconds since the UNIX epoch, then one MAVLink frame as it was on the wire.
"""

import struct
from collections.abc import Callable
from pathlib import Path

from gcs.unwritten import Unwritten, unheard

_STAMP = struct.Struct(">Q")


class TlogWriter:
    """Appends frames to a recording.

    Args:
        path: the file.
        keep: go on with what is there; otherwise it is begun anew.
        say: takes a sentence if it can be written no longer.
    """

    def __init__(self, path: Path, *, keep: bool = False, say: Callable[[str], None] = unheard) -> None:
        self._file = path.open("ab" if keep else "wb")
        self._unwritten = Unwritten("the recording", say)

    def write(self, frame: bytes | bytearray, unix_us: int) -> None:
        with self._unwritten:
            self._file.write(_STAMP.pack(unix_us) + frame)

    def close(self) -> None:
        with self._unwritten:
            self._file.close()
