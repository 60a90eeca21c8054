"""Where the vehicle was a moment ago: its latest estimates, and what lies between two of them."""

from bisect import bisect_left
from collections import deque
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from missions.frames import swap_enu_ned

Array = npt.NDArray[np.float64]

CAPACITY = 64
"""Estimates that are kept: two seconds at 30 Hz."""
LONGEST_GAP_S = 0.5
"""Nothing is said of the time between two estimates that lie farther apart."""


@dataclass(frozen=True)
class Pose:
    """Where a vehicle is and how it is turned.

    Args:
        position_ned_m: (3,) in the autopilot's frame.
        attitude_ned_frd: (4,) unit quaternion w, x, y, z, body FRD -> NED.
    """

    position_ned_m: Array
    attitude_ned_frd: Array

    @property
    def flu_to_enu(self) -> Array:
        """(3, 3) forward, left and up as rows in ENU: `vectors_flu @ flu_to_enu` are vectors in ENU."""
        w, x, y, z = self.attitude_ned_frd.tolist()
        forward = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)
        right = 2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)
        down = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)
        return swap_enu_ned(np.array([forward, right, down]) * np.array([[1.0], [-1.0], [-1.0]]))


class PoseHistory:
    """The latest poses by vehicle time.

    Example:
        >>> history = PoseHistory()
        >>> level = np.array([1.0, 0.0, 0.0, 0.0])
        >>> history.add(1.0, np.zeros(3), level)
        >>> history.add(1.1, np.array([1.0, 0.0, 0.0]), level)
        >>> history.at(1.05).position_ned_m.tolist(), history.at(1.2)
        ([0.5, 0.0, 0.0], None)
    """

    def __init__(self) -> None:
        self._times_s: deque[float] = deque(maxlen=CAPACITY)
        self._poses: deque[Pose] = deque(maxlen=CAPACITY)

    @property
    def newest_s(self) -> float:
        """Vehicle time of the latest estimate; -inf before there is one."""
        return self._times_s[-1] if self._times_s else float("-inf")

    def add(self, time_s: float, position_ned_m: Array, attitude_ned_frd: Array) -> None:
        """Take in an estimate; one that comes out of order, or is no rotation, is left out.

        Args:
            time_s: of the vehicle's clock.
            position_ned_m: (3,) in the autopilot's frame.
            attitude_ned_frd: (4,) quaternion w, x, y, z, FRD -> NED.
        """
        length = float(np.linalg.norm(attitude_ned_frd))
        if time_s <= self.newest_s or not 0.5 < length < 2.0:
            return
        self._times_s.append(time_s)
        self._poses.append(Pose(position_ned_m, attitude_ned_frd / length))

    def forget(self) -> None:
        """The clock, or the frame, has jumped: what was before says nothing about now."""
        self._times_s.clear()
        self._poses.clear()

    def at(self, time_s: float) -> Pose | None:
        """The pose at a time, between the two estimates around it; None where there are not two, or they lie apart."""
        if not self._times_s or not self._times_s[0] <= time_s <= self._times_s[-1]:
            return None
        after = bisect_left(self._times_s, time_s)
        if self._times_s[after] == time_s:
            return self._poses[after]
        begin_s, end_s = self._times_s[after - 1], self._times_s[after]
        if end_s - begin_s > LONGEST_GAP_S:
            return None
        return _between(self._poses[after - 1], self._poses[after], (time_s - begin_s) / (end_s - begin_s))


def _between(one: Pose, other: Pose, share: float) -> Pose:
    """Straight in position; in attitude along the chord, which is right to a thousandth of what turns in between."""
    place = one.position_ned_m + share * (other.position_ned_m - one.position_ned_m)
    near = other.attitude_ned_frd if one.attitude_ned_frd @ other.attitude_ned_frd >= 0.0 else -other.attitude_ned_frd
    turned = one.attitude_ned_frd + share * (near - one.attitude_ned_frd)
    return Pose(place, turned / np.linalg.norm(turned))
