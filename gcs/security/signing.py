"""MAVLink 2 message signing, the ground station's end: one key per vehicle, verified before anything is remembered.

A vehicle whose key is stored must sign; one without a key is taken as it is, and shown as unsigned. A frame counts
once: its timestamp must be newer than the last one of its stream, also after a restart.
https://mavlink.io/en/guide/message_signing.html
"""

import hashlib
import hmac
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum

KEY_BYTES, SIGNATURE_BYTES = 32, 13
TICKS_PER_S = 100_000
"""Timestamps count 10 us."""
EPOCH_UNIX_US = 1_420_070_400_000_000
"""They begin on 2015-01-01 00:00 UTC."""
LATEST_TICK = 2**48 - 1
OLDEST_NEW_STREAM = 60 * TICKS_PER_S
"""A stream that has not been heard before may lag this far behind our clock."""
RESERVE = 3 * TICKS_PER_S
"""What is kept is this far ahead of what was accepted or sent, so that it is written every few seconds only."""
MOST_STREAMS = 16
MAVLINK_2 = 0xFD
_FLAGS, _SIGNED, _SYSTEM, _COMPONENT = 2, 1, 5, 6

Stream = tuple[int, int]
"""Component and link id of a sender with the vehicle's system id."""


class Trust(Enum):
    """What a vehicle's frames are worth."""

    UNSIGNED = "UNSIGNED"
    """No key is stored for it: anybody on the link can speak as this vehicle."""
    PENDING = "KEY PENDING"
    """A key was made or sent, and the vehicle has not signed with it yet."""
    SIGNED = "SIGNED"
    """Every frame is verified; what is not signed is dropped."""


class Refusal(Enum):
    """Why a frame was dropped."""

    NOT_SIGNED = "is not signed"
    FORGED = "bears no valid signature"
    REPLAYED = "repeats an old timestamp"
    TOO_OLD = "is older than a minute"
    TOO_MANY_STREAMS = "belongs to one stream too many"


@dataclass
class VehicleKey:
    """One vehicle's key and what has been signed with it.

    Args:
        key: 32 bytes in force; None while the vehicle is still unsigned.
        next_key: 32 bytes that take over with the first frame that the vehicle signs with them.
        timestamp: the latest one sent or accepted.
        streams: the last timestamp accepted of each stream.
    """

    key: bytes | None = None
    next_key: bytes | None = None
    timestamp: int = 0
    streams: dict[Stream, int] = field(default_factory=dict[Stream, int])

    @property
    def trust(self) -> Trust:
        return Trust.SIGNED if self.key is not None else Trust.PENDING


class Signing:
    """Signs and verifies for all vehicles.

    Args:
        vehicles: by system id; what is learnt is kept in them.
        unix_us: the wall clock [us since 1970], which the vehicles share.
        keep: called before a frame counts whose timestamp lies past what was kept last, and when a key takes over;
            it has to write what it is given to where it survives this program.
    """

    def __init__(
        self,
        vehicles: dict[int, VehicleKey] | None = None,
        unix_us: Callable[[], int] = lambda: EPOCH_UNIX_US,
        keep: Callable[[dict[int, VehicleKey]], None] = lambda _: None,
    ) -> None:
        self.vehicles = vehicles if vehicles is not None else {}
        self.refused: Counter[tuple[int, Refusal]] = Counter()
        self._unix_us, self._keep = unix_us, keep
        self._covered: dict[tuple[int, Stream | None], int] = {}
        """What has been kept: timestamps of streams, and, under None, of what is sent."""

    def trust(self, sysid: int) -> Trust:
        vehicle = self.vehicles.get(sysid)
        return Trust.UNSIGNED if vehicle is None else vehicle.trust

    def key(self, sysid: int) -> bytes | None:
        """What is signed with to this vehicle; None sends unsigned."""
        vehicle = self.vehicles.get(sysid)
        return vehicle.key if vehicle is not None else None

    def next_timestamp(self, sysid: int) -> int:
        """The timestamp of the next frame to a vehicle with a key: never one that was used, whatever the clock does."""
        vehicle = self.vehicles[sysid]
        vehicle.timestamp = min(max(vehicle.timestamp + 1, self._now()), LATEST_TICK)
        self._cover(sysid, None, vehicle.timestamp)
        return vehicle.timestamp

    def admits(self, frame: bytes | bytearray) -> bool:
        """Whether a whole MAVLink 2 frame may be believed; counts those that may not."""
        vehicle = self.vehicles.get(frame[_SYSTEM])
        if vehicle is None:
            return True
        refusal = self._refusal(vehicle, frame)
        if refusal is not None:
            self.refused[frame[_SYSTEM], refusal] += 1
        return refusal is None

    def _kept(self) -> dict[int, VehicleKey]:
        """What is to be written: keys as they are, timestamps so far ahead that a second of traffic is covered."""
        return {
            sysid: VehicleKey(v.key, v.next_key, v.timestamp + RESERVE, {s: t + RESERVE for s, t in v.streams.items()})
            for sysid, v in self.vehicles.items()
        }

    def _refusal(self, vehicle: VehicleKey, frame: bytes | bytearray) -> Refusal | None:
        if not frame[_FLAGS] & _SIGNED:
            return Refusal.NOT_SIGNED if vehicle.key is not None else None
        body, signature = frame[:-6], frame[-6:]
        if vehicle.key is not None and hmac.compare_digest(_signature(vehicle.key, body), signature):
            return self._stale(vehicle, frame)
        if vehicle.next_key is not None and hmac.compare_digest(_signature(vehicle.next_key, body), signature):
            return self._take_over(vehicle, frame)
        return Refusal.FORGED if vehicle.key is not None else None

    def _take_over(self, vehicle: VehicleKey, frame: bytes | bytearray) -> Refusal | None:
        """The vehicle has its new key: the old one is void from here on."""
        former = vehicle.key, vehicle.next_key, vehicle.streams
        vehicle.key, vehicle.next_key, vehicle.streams = vehicle.next_key, None, {}
        self._covered.clear()
        refusal = self._stale(vehicle, frame)
        if refusal is not None:
            vehicle.key, vehicle.next_key, vehicle.streams = former
        return refusal

    def _stale(self, vehicle: VehicleKey, frame: bytes | bytearray) -> Refusal | None:
        """Judge and remember the timestamp of a frame whose signature is valid."""
        stream, timestamp = (frame[_COMPONENT], frame[-13]), int.from_bytes(frame[-12:-6], "little")
        last = vehicle.streams.get(stream)
        if last is None:
            if timestamp < max(vehicle.timestamp, self._now()) - OLDEST_NEW_STREAM:
                return Refusal.TOO_OLD
            if len(vehicle.streams) >= MOST_STREAMS:
                return Refusal.TOO_MANY_STREAMS
        elif timestamp <= last:
            return Refusal.REPLAYED
        vehicle.streams[stream] = timestamp
        vehicle.timestamp = max(vehicle.timestamp, timestamp)
        self._cover(frame[_SYSTEM], stream, timestamp)
        return None

    def _cover(self, sysid: int, stream: Stream | None, timestamp: int) -> None:
        if timestamp > self._covered.get((sysid, stream), -1):
            kept = self._kept()
            self._covered = {(i, s): t for i, v in kept.items() for s, t in v.streams.items()}
            self._covered |= {(i, None): v.timestamp for i, v in kept.items()}
            self._keep(kept)

    def _now(self) -> int:
        return max(0, (self._unix_us() - EPOCH_UNIX_US) // 10)


def _signature(key: bytes, body: bytes | bytearray) -> bytes:
    return hashlib.sha256(key + body).digest()[:6]
