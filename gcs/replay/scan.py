"""Finds the records of a `.tlog` in its bytes, however damaged it is."""

import numpy as np
import numpy.typing as npt

from missions.kernels import compiled

Bytes = npt.NDArray[np.uint8]
IntArray = npt.NDArray[np.int64]

STAMP_BYTES = 8
LEAST_RECORD_BYTES = STAMP_BYTES + 8
OLDEST_YEARS, NEWEST_YEARS = 3, 14
"""The first two bytes of stamps from 1996 to 2103, in 2**48 us."""
_UNKNOWN = -1
_V1, _V2 = 0xFE, 0xFD


@compiled
def scan(data: Bytes, crc_extras: IntArray, starts: IntArray, lengths: IntArray) -> int:
    """Write down where the frames of all whole records begin, and how long they are; returns how many there are.

    A record counts if its frame's checksum is right, or, for a message that is not known, if its stamp is of this
    century and another frame or the end of the file follows where it must. Everything else is passed over byte by byte.

    Args:
        data: (n,) the file.
        crc_extras: (m,) by message id; -1 for ids that are not known.
        starts, lengths: to be filled; one entry per `LEAST_RECORD_BYTES` bytes suffices.
    """
    at, found = 0, 0
    while at + LEAST_RECORD_BYTES <= len(data):
        start = at + STAMP_BYTES
        length = frame_length(data, start)
        if length > 0 and _is_whole(data, start, length, crc_extras):
            starts[found], lengths[found] = start, length
            found += 1
            at = start + length
        else:
            at += 1
    return found


@compiled
def frame_length(data: Bytes, start: int) -> int:
    """Bytes of the frame that begins at `start`; 0 where none does, or where the file ends within it."""
    length = 0
    if data[start] == _V2:
        length = 12 + data[start + 1] + 13 * (data[start + 2] & 1)
    elif data[start] == _V1:
        length = 8 + data[start + 1]
    return length if start + length <= len(data) else 0


@compiled
def message_id(data: Bytes, start: int) -> int:
    """Of the frame that begins at `start`."""
    if data[start] == _V1:
        return int(data[start + 5])
    return int(data[start + 7]) | int(data[start + 8]) << 8 | int(data[start + 9]) << 16


@compiled
def _is_whole(data: Bytes, start: int, length: int, crc_extras: IntArray) -> bool:
    number = message_id(data, start)
    extra = crc_extras[number] if number < len(crc_extras) else _UNKNOWN
    if extra == _UNKNOWN:
        years = int(data[start - STAMP_BYTES]) << 8 | int(data[start - STAMP_BYTES + 1])
        if not OLDEST_YEARS <= years <= NEWEST_YEARS:
            return False
        following = start + length + STAMP_BYTES
        if start + length == len(data):
            return True
        return following < len(data) and (data[following] == _V1 or data[following] == _V2)
    end = start + data[start + 1] + (10 if data[start] == _V2 else 6)
    crc = 0xFFFF
    for index in range(start + 1, end):
        crc = _crc_step(crc, int(data[index]))
    crc = _crc_step(crc, int(extra))
    return bool((crc & 0xFF) == data[end] and (crc >> 8) == data[end + 1])


@compiled
def _crc_step(crc: int, byte: int) -> int:
    """CRC-16/MCRF4XX, which MAVLink calls X.25."""
    mixed = (byte ^ crc) & 0xFF
    mixed = (mixed ^ (mixed << 4)) & 0xFF
    return (crc >> 8) ^ (mixed << 8) ^ (mixed << 3) ^ (mixed >> 4)
