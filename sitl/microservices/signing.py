"""MAVLink 2 message signing on the ground link: what a vehicle with a key sends is signed, what it obeys must be.

A frame is verified, in constant time, before anything of it is remembered; a timestamp counts once per stream; the
table of streams is bounded. https://mavlink.io/en/guide/message_signing.html
"""

import hashlib
import hmac
import struct

from fastcrc.crc16 import mcrf4xx

from sitl.autopilot.memory import SigningMemory
from sitl.dialect import Message, mavlink
from sitl.microservices.outbox import Link, Sender

KEY_BYTES, SIGNATURE_BYTES = 32, 13
EPOCH_UNIX_S = 1_420_070_400
"""2015-01-01 00:00 UTC: from there timestamps count, in 10 us."""
TICKS_PER_S = 100_000
OLDEST_NEW_STREAM = 60 * TICKS_PER_S
"""A stream that has not been heard before may lag this far behind our clock."""
MOST_STREAMS = 16
_MAGIC_2, _FLAGS, _SIGNED, _HEADER_BYTES = 0xFD, 2, 1, 10
_CRC = struct.Struct("<H")


class Signing:
    """One vehicle's key, and what has been signed with it.

    Args:
        memory: keeps key and timestamps over a reboot.
        start_us: UTC at boot, on the wall clock.
        speed: simulated seconds per wall-clock second; keys are shared with programs on the wall clock.
    """

    def __init__(self, memory: SigningMemory, start_us: int, speed: float) -> None:
        self._memory = memory
        self._start = (start_us - EPOCH_UNIX_S * 1_000_000) // 10
        self._speed = speed
        self.refused = 0
        """Frames that were not, or not well, signed."""

    @property
    def is_on(self) -> bool:
        return self._memory.key is not None

    def receive_setup(self, message: Message, sender: Sender) -> None:
        """SETUP_SIGNING, on the ground link alone: a key, or nothing but zeros to end signing."""
        if sender.link is not Link.GROUND:
            return
        key = bytes(message.secret_key)
        self._memory.key = key if any(key) else None
        self._memory.streams.clear()
        self._memory.timestamp = max(self._memory.timestamp, message.initial_timestamp & 0xFFFF_FFFF_FFFF)

    def sign(self, frame: bytes, now_s: float) -> bytes | None:
        """A MAVLink 2 frame, signed with a timestamp of its own; None for MAVLink 1, which cannot be."""
        memory = self._memory
        if frame[0] != _MAGIC_2 or memory.key is None:
            return None
        memory.timestamp = max(memory.timestamp + 1, self._clock(now_s))
        tail = struct.pack("<BQ", 0, memory.timestamp)[:7]  # link id, 48 bits of timestamp
        body = _flagged(frame, signed=True) + tail
        return body + _signature(memory.key, body)

    def accepts(self, frame: bytes, sender: Sender, now_s: float) -> bool:
        """Whether a frame bears a valid signature that has not been seen before; counts those that do not."""
        accepted = self._is_fresh(frame, sender, now_s)
        self.refused += not accepted
        return accepted

    def stripped(self, frame: bytes) -> bytes:
        """The frame without its signature, for the onboard link."""
        return _flagged(frame, signed=False)

    def _is_fresh(self, frame: bytes, sender: Sender, now_s: float) -> bool:
        memory = self._memory
        if memory.key is None or frame[0] != _MAGIC_2 or not frame[_FLAGS] & _SIGNED:
            return False
        body, signature = frame[:-6], frame[-6:]
        if not hmac.compare_digest(_signature(memory.key, body), signature):
            return False
        link_id, timestamp = body[-7], int.from_bytes(body[-6:], "little")
        stream = (sender.sysid, sender.compid, link_id)
        last = memory.streams.get(stream)
        if last is None:
            too_old = timestamp < max(memory.timestamp, self._clock(now_s)) - OLDEST_NEW_STREAM
            if too_old or len(memory.streams) >= MOST_STREAMS:
                return False
        elif timestamp <= last:
            return False
        memory.streams[stream] = timestamp
        memory.timestamp = max(memory.timestamp, timestamp)
        return True

    def _clock(self, now_s: float) -> int:
        """The time, in timestamps."""
        return self._start + round(now_s / self._speed * TICKS_PER_S)


def _signature(key: bytes, body: bytes) -> bytes:
    return hashlib.sha256(key + body).digest()[:6]


def _flagged(frame: bytes, *, signed: bool) -> bytes:
    """Header, payload and checksum of a known MAVLink 2 message, with the signing flag set or not."""
    end = _HEADER_BYTES + frame[1]
    flags = frame[_FLAGS] | _SIGNED if signed else frame[_FLAGS] & ~_SIGNED
    body = frame[1:_FLAGS] + bytes([flags]) + frame[_FLAGS + 1 : end]
    number = int.from_bytes(frame[7:10], "little")
    crc_extra = mavlink.mavlink_map[number].crc_extra
    return frame[:1] + body + _CRC.pack(mcrf4xx(body + bytes([crc_extra]), 0xFFFF))
