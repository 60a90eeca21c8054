"""One `.tlog` in memory: its whole records, when they were written, by whom, and an index of who said what when."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt

from gcs.dialect import Message, mavlink
from gcs.errors import RecordingError
from gcs.replay.scan import LEAST_RECORD_BYTES, STAMP_BYTES, scan

IntArray = npt.NDArray[np.int64]
Array = npt.NDArray[np.float64]
Bytes = npt.NDArray[np.uint8]

LONGEST_GAP_US = 3_600_000_000
"""Between two records; what a damaged or reset clock shows beyond is cut."""
MOST_BYTES = 4 << 30
TEXTS_KEPT = 50
CONTEXT_S = 1.0
"""What was said so shortly before a moment is all looked at, for the state that depends on intervals."""
_MAVLINK_2 = 0xFD
_HEADER = {True: (5, 6, 10), False: (3, 4, 6)}
"""MAVLink 2 or 1 -> where system, component and payload are in the frame."""


@dataclass(frozen=True)
class Recording:
    """The whole records of a recording, in the order of the file.

    Args:
        data: (n,) the file's bytes.
        starts, lengths: (m,) of the records' frames.
        times_s: (m,) seconds since the first record, never falling.
        began_unix_us: when the first record was written [us since 1970].
        skipped_bytes: that belong to no whole record.
    """

    data: Bytes
    starts: IntArray
    lengths: IntArray
    times_s: Array
    began_unix_us: int
    skipped_bytes: int

    def __len__(self) -> int:
        return len(self.starts)

    @property
    def duration_s(self) -> float:
        return float(self.times_s[-1]) if len(self) else 0.0

    def frame(self, record: int) -> bytes:
        start = self.starts[record]
        return self.data[start : start + self.lengths[record]].tobytes()

    def count_until(self, time_s: float) -> int:
        """How many records were written up to a moment."""
        return int(np.searchsorted(self.times_s, time_s, side="right"))

    def messages(self, records: IntArray | range) -> Iterator[tuple[float, Message]]:
        """Yield time [s] and message of records, in their order; what this dialect does not know is left out."""
        decoder = mavlink.MAVLink(None)
        for record in records:
            try:
                yield float(self.times_s[record]), decoder.decode(bytearray(self.frame(record)))
            except mavlink.MAVError:
                continue

    def state_at(self, time_s: float) -> IntArray:
        """The records that make up the fleet's state at a moment, in order.

        State is what was said last of each kind; so it takes the last record of every kind from every sender, a few of
        texts, the first heartbeats, which bring a vehicle into being, and everything of the last second.
        """
        count = self.count_until(time_s)
        chosen = [np.arange(self.count_until(time_s - CONTEXT_S), count)]
        for kind, records in self.kinds.items():
            upto = int(np.searchsorted(records, count))
            kept = TEXTS_KEPT if kind[2] == mavlink.MAVLINK_MSG_ID_STATUSTEXT else 1
            chosen.append(records[max(0, upto - kept) : upto])
            if kind[2] == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
                chosen.append(records[: min(1, upto)])
        return np.unique(np.concatenate(chosen)).astype(np.int64)

    @cached_property
    def kinds(self) -> dict[tuple[int, int, int, int], IntArray]:
        """(system, component, message id, payload type of a TUNNEL) -> its records in order."""
        if not len(self):
            return {}
        systems, components, numbers, types = self._senders()
        keys = ((systems << 8 | components) << 24 | numbers) << 16 | types
        order = np.argsort(keys, kind="stable")
        parts = np.split(order, np.flatnonzero(np.diff(keys[order])) + 1)
        return {
            (int(systems[p[0]]), int(components[p[0]]), int(numbers[p[0]]), int(types[p[0]])): p.astype(np.int64)
            for p in parts
        }

    def payloads(self, records: IntArray, size: int) -> Bytes:
        """(k, size) payloads of records, cut or filled up with zeros as MAVLink 2 does."""
        v2 = self.data[self.starts[records]] == _MAVLINK_2
        begins = self.starts[records] + np.where(v2, _HEADER[True][2], _HEADER[False][2])
        sizes = self.data[self.starts[records] + 1].astype(np.int64)
        columns = np.arange(size)
        inside = columns < sizes[:, None]
        places = np.minimum(begins[:, None] + columns, len(self.data) - 1)
        return np.where(inside, self.data[places], 0).astype(np.uint8)

    def _senders(self) -> tuple[IntArray, IntArray, IntArray, IntArray]:
        """(m,) system, component, message id and TUNNEL's payload type of all records."""
        data, starts = self.data, self.starts
        v2 = data[starts] == _MAVLINK_2

        def at(v2_offset: int, v1_offset: int) -> IntArray:
            return data[starts + np.where(v2, v2_offset, v1_offset)].astype(np.int64)

        numbers = np.where(v2, at(7, 5) | at(8, 5) << 8 | at(9, 5) << 16, at(5, 5))
        tunnels = np.flatnonzero(numbers == mavlink.MAVLINK_MSG_ID_TUNNEL)
        types = np.zeros(len(starts), np.int64)
        if len(tunnels):
            types[tunnels] = self.payloads(tunnels, 2).astype(np.int64) @ np.array([1, 256])
        return at(5, 3), at(6, 4), numbers, types


def read_recording(path: Path) -> Recording:
    """Read as much of a `.tlog` as is whole.

    Raises:
        RecordingError: it cannot be read, or there is not one whole record in it.
    """
    try:
        size = path.stat().st_size
        if size > MOST_BYTES:
            raise RecordingError(f"{path}: expected at most {MOST_BYTES >> 30} GiB, found {size / (1 << 30):.1f} GiB")
        data = np.memmap(path, np.uint8, "r") if size else np.empty(0, np.uint8)
    except OSError as problem:
        raise RecordingError(f"{path}: cannot be read: {problem.strerror}") from None
    recording = parse_recording(np.asarray(data))
    if not len(recording):
        raise RecordingError(f"{path}: expected a MAVLink recording (.tlog), found no whole record in {size} bytes")
    return recording


def parse_recording(data: Bytes) -> Recording:
    """The whole records in the bytes of a `.tlog`; there may be none."""
    most = len(data) // LEAST_RECORD_BYTES + 1
    starts, lengths = np.empty(most, np.int64), np.empty(most, np.int64)
    found = scan(data, _crc_extras(), starts, lengths)
    starts, lengths = starts[:found].copy(), lengths[:found].copy()
    stamps = data[starts[:, None] - STAMP_BYTES + np.arange(STAMP_BYTES)].astype(np.uint8)
    stamps_us = np.ascontiguousarray(stamps).view(">u8").ravel().astype(np.float64)
    skipped = len(data) - int(lengths.sum()) - found * STAMP_BYTES
    times_s, began_unix_us = _times(stamps_us)
    return Recording(data, starts, lengths, times_s, began_unix_us, skipped)


def _times(stamps_us: Array) -> tuple[Array, int]:
    """Seconds since the first record, without what single damaged stamps and turned-back clocks would do to them."""
    if not len(stamps_us):
        return np.empty(0), 0
    before, after = np.roll(stamps_us, 1), np.roll(stamps_us, -1)
    neighbours_agree = np.abs(after - before) < LONGEST_GAP_US
    off = np.minimum(np.abs(stamps_us - before), np.abs(stamps_us - after)) >= LONGEST_GAP_US
    damaged = neighbours_agree & off
    damaged[[0, -1]] = False
    kept_us = np.where(damaged, before, stamps_us)
    steps_us = np.clip(np.diff(kept_us), 0.0, LONGEST_GAP_US)
    return np.concatenate(([0.0], np.cumsum(steps_us))) / 1e6, int(min(kept_us[0], 2.0**62))


def _crc_extras() -> IntArray:
    known = mavlink.mavlink_map
    extras = np.full(max(known) + 1, -1, np.int64)
    for number, message in known.items():
        extras[number] = message.crc_extra
    return extras
