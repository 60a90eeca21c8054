"""A byte stream (TCP, serial) cut into MAVLink 2 frames; all else is skipped, MAVLink 1, too: it is refused anyway."""

from fastcrc.crc16 import mcrf4xx

from gcs.dialect import mavlink

MAGIC = 0xFD
UNSIGNED_BYTES, SIGNATURE_BYTES = 12, 13
"""Of a frame besides its payload."""
SIGNED = 0x01
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
        at = end = 0
        while (at := pending.find(MAGIC, end)) >= 0:
            length = _frame_length(pending, at)
            if length is None:
                break
            self.skipped_bytes += at - end + (length == 0)
            if length:
                frames.append(bytes(pending[at : at + length]))
            end = at + max(length, 1)
        if at < 0:
            self.skipped_bytes += len(pending) - end
        del pending[: at if at >= 0 else len(pending)]
        return frames


def _frame_length(pending: bytearray, at: int) -> int | None:
    """Length of the frame that begins here; 0 if none does, None if it is not complete yet."""
    if at + UNSIGNED_BYTES > len(pending):
        return None
    if pending[at + 2] & ~SIGNED:
        return 0  # an incompatible flag that nobody has defined
    unsigned = UNSIGNED_BYTES + pending[at + 1]
    length = unsigned + (SIGNATURE_BYTES if pending[at + 2] & SIGNED else 0)
    if at + length > len(pending):
        return None
    kind = mavlink.mavlink_map.get(int.from_bytes(pending[at + 7 : at + 10], "little"))
    if kind is None:  # its checksum cannot be told; noise that looks like a frame must not take true ones with it
        return length if at + length == len(pending) or pending[at + length] == MAGIC else 0
    return length if _is_sound(pending[at : at + unsigned], kind.crc_extra) else 0


def _is_sound(frame: bytearray, crc_extra: int) -> bool:
    checked = bytes(frame[1:-2]) + bytes([crc_extra])
    return mcrf4xx(checked, 0xFFFF) == int.from_bytes(frame[-2:], "little")
