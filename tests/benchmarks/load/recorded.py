"""What a ground station's recording says of how it was heard: every frame has the time at which it was taken in."""

from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sitl.dialect import mavlink
from tests.recordings import read_tlog

_POSITION = mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
_BOOT_MS = slice(10, 14)


@dataclass(frozen=True)
class Heard:
    """What came in, from a time on."""

    vehicles: int
    """That were heard up to the end."""
    messages_hz: float
    age_p99_s: float
    """Of a vehicle's newest position when the next one comes."""
    age_max_s: float
    pace: float
    """Vehicle seconds per second: below 1 the machine is too busy for the simulator."""


def heard(recording: Path, since_us: int) -> Heard:
    """Read a recording from a time on."""
    positions_s: dict[int, list[float]] = defaultdict(list)
    boot_s: list[float] = []
    messages, last_us = 0, since_us
    for stamp_us, frame in read_tlog(recording):
        if stamp_us < since_us:
            continue
        messages, last_us = messages + 1, stamp_us
        if int.from_bytes(frame[7:10], "little") == _POSITION:
            positions_s[frame[5]].append((stamp_us - since_us) / 1e6)
            boot_s.append(int.from_bytes(frame[_BOOT_MS], "little") / 1e3)
    lasted_s = (last_us - since_us) / 1e6
    ages_s = np.concatenate([np.diff(times_s) for times_s in positions_s.values()])
    to_the_end = sum(times_s[-1] > lasted_s - 1.0 for times_s in positions_s.values())
    age_p99_s, pace = float(np.percentile(ages_s, 99)), (boot_s[-1] - boot_s[0]) / lasted_s
    return Heard(to_the_end, messages / lasted_s, age_p99_s, float(ages_s.max()), pace)
