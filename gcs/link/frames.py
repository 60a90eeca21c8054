"""A byte stream (TCP, serial) cut into MAVLink frames; what is none is skipped."""

from fastcrc.crc16 import mcrf4xx

from gcs.dialect import mavlink

MAGICS = {0xFD: 12, 0xFE: 8}
"""First byte -> bytes besides the payload, without a signature."""
SIGNED, SIGNATURE_BYTES = 0x01, 13
LONGEST_FRAME_BYTES = 280


class FrameSplitter:
    """Frames out of a stream; their content is judged by whoever parses them."""

    def __init__(self) -> None:
        self._pending = bytearray()
        self.skipped_bytes = 0

    def feed(self, data: bytes) -> list[bytes]:
        """The frames that are complete now."""
        pending = self._pending
        pending += data
        frames: list[bytes] = []
        at = 0
        while at < len(pending):
            length = _frame_length(pending, at)
            if length is None:
                break
            if length == 0:
                at += 1
                self.skipped_bytes += 1
                continue
            frames.append(bytes(pending[at : at + length]))
            at += length
        del pending[:at]
        return frames


def _frame_length(pending: bytearray, at: int) -> int | None:
    """Length of the frame that begins here; 0 if none does, None if it is not complete yet."""
    overhead = MAGICS.get(pending[at])
    if overhead is None:
        return 0
    if at + overhead > len(pending):
        return None
    is_two = pending[at] == 0xFD
    if is_two and pending[at + 2] & ~SIGNED:
        return 0  # an incompatible flag that nobody has defined
    unsigned = overhead + pending[at + 1]
    length = unsigned + (SIGNATURE_BYTES if is_two and pending[at + 2] & SIGNED else 0)
    if at + length > len(pending):
        return None
    return length if _is_sound(pending[at : at + unsigned], is_two) else 0


def _is_sound(frame: bytearray, is_two: bool) -> bool:
    """Whether the checksum is right; that of an unknown message cannot be told."""
    message_id = int.from_bytes(frame[7:10], "little") if is_two else frame[5]
    kind = mavlink.mavlink_map.get(message_id)
    if kind is None:
        return True
    return mcrf4xx(bytes(frame[1:-2]) + bytes([kind.crc_extra]), 0xFFFF) == int.from_bytes(frame[-2:], "little")
