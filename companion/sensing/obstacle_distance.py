"""The driver for MAVLink OBSTACLE_DISTANCE: a ring of distances around the vehicle becomes scans. Sans-IO.

A ring has no height. Whatever is in it is taken for a wall that reaches somewhat above and below the vehicle, as wide
as its sector; higher up and farther down nothing is known, until the vehicle is there. Sectors that may have seen the
ground, because the vehicle is tilted, say nothing.
"""

import math
from collections import Counter
from collections.abc import Callable

import msgspec
import numpy as np
import numpy.typing as npt

from companion.sensing.intake import Dropped, is_current
from companion.sensing.pose_history import Pose, PoseHistory
from companion.sensing.scan import Scan
from missions.frames import AutopilotFrame

Array = npt.NDArray[np.float64]

NORTH_ALIGNED = {0, 1}
"""MAV_FRAME_GLOBAL and MAV_FRAME_LOCAL_NED: sectors are counted from north."""
BODY_FRD = 12
"""Sectors are counted from where the vehicle looks."""
UNKNOWN_CM = 65535
BEAM_RAD = math.radians(10.0)
"""A sector looks so far above and below its plane."""
GROUND_M = 0.2
"""What is nearer to the ground than this may be the ground."""
MOST_SECTORS = 72


class ObstacleDistance(msgspec.Struct, frozen=True):
    """OBSTACLE_DISTANCE; distances in cm, clockwise."""

    time_usec: int
    distances: list[int]
    max_distance: int
    increment: int = 0
    increment_f: float | None = 0.0
    angle_offset: float | None = 0.0
    frame: int = 0

    @property
    def width_rad(self) -> float:
        return math.radians(self.increment_f or float(self.increment))

    @property
    def makes_sense(self) -> bool:
        """It is of a frame that is known, and has sectors that are wide enough to be some."""
        known = self.frame in NORTH_ALIGNED or self.frame == BODY_FRD
        return (
            known and 0.0 < self.width_rad <= math.pi and len(self.distances) <= MOST_SECTORS and self.max_distance > 0
        )


class ObstacleDistanceDriver:
    """Makes scans of rings.

    Args:
        spacing_m: between the points of a wall.
        half_height_m: how far a wall reaches above and below the vehicle.
        ground_up_m: height of the ground [m] below (n, 3) ENU points.
    """

    def __init__(self, spacing_m: float, half_height_m: float, ground_up_m: Callable[[Array], Array]) -> None:
        self._spacing_m, self._half_height_m, self._ground_up_m = spacing_m, half_height_m, ground_up_m
        self._latest: ObstacleDistance | None = None
        self._taken = True
        self.heard_s = float("-inf")
        """Vehicle time at which the last good ring came in."""
        self.dropped: Counter[Dropped] = Counter()

    def receive(self, raw: bytes, now_s: float) -> None:
        """Take in one message's fields as JSON, at vehicle time `now_s`; never raises."""
        try:
            ring = msgspec.json.decode(raw, type=ObstacleDistance)
        except msgspec.DecodeError:
            ring = None
        if ring is None or not ring.makes_sense:
            self.dropped[Dropped.MALFORMED] += 1
        elif not is_current(ring.time_usec / 1e6, now_s):
            self.dropped[Dropped.CLOCK] += 1
        elif self._latest is not None and ring.time_usec <= self._latest.time_usec:
            self.dropped[Dropped.LATE] += 1
        else:
            self._latest, self._taken, self.heard_s = ring, False, now_s

    def take(self, poses: PoseHistory, frame: AutopilotFrame, now_s: float) -> Scan | None:
        """The scan of the latest ring, once, when the poses reach so far."""
        if (ring := self._latest) is None or self._taken:
            return None
        stamp_s = ring.time_usec / 1e6
        if not is_current(stamp_s, now_s):
            self.dropped[Dropped.NO_POSE] += 1
            self._taken = True
        elif poses.newest_s >= stamp_s:
            self._taken = True
            if (pose := poses.at(stamp_s)) is not None:
                return self._scan_of(ring, pose, frame.enu(pose.position_ned_m))
            self.dropped[Dropped.NO_POSE] += 1
        return None

    def forget(self) -> None:
        """The vehicle's clock has jumped: what was stamped before says nothing about now."""
        self._latest, self._taken, self.heard_s = None, True, float("-inf")

    def _scan_of(self, ring: ObstacleDistance, pose: Pose, here_enu_m: Array) -> Scan:
        distances_cm = np.array(ring.distances, dtype=float)
        angles = math.radians(ring.angle_offset or 0.0) + ring.width_rad * np.arange(len(distances_cm))
        ahead, _, up = pose.flu_to_enu
        if ring.frame == BODY_FRD:
            angles = angles + math.atan2(ahead[0], ahead[1])
        hit = (distances_cm <= ring.max_distance) & (distances_cm != UNKNOWN_CM)
        angles, distances_m = angles[hit], distances_cm[hit] / 100.0
        outward = np.column_stack((np.sin(angles), np.cos(angles), np.zeros(len(angles))))
        clear_of_ground = self._clear_of_ground(here_enu_m, outward, distances_m, up)
        walls = [
            self._wall(here_enu_m, angle, distance_m, ring.width_rad)
            for angle, distance_m in zip(angles[clear_of_ground], distances_m[clear_of_ground], strict=True)
        ]
        points = np.concatenate(walls) if walls else np.zeros((0, 3))
        return Scan(ring.time_usec / 1e6, here_enu_m, points, ring.max_distance / 100.0)

    def _clear_of_ground(
        self, here_enu_m: Array, outward: Array, distances_m: Array, up: Array
    ) -> npt.NDArray[np.bool_]:
        """Which of the hits cannot be the ground: the lowest of the sector's beam ends above it.

        Over a level direction n, the plane with the unit normal `up` rises at atan(-(up . n) / up_z).
        """
        rises = np.arctan2(-(outward @ up), max(float(up[2]), 1e-3))
        lowest_up_m = here_enu_m[2] + distances_m * np.sin(rises - BEAM_RAD)
        return lowest_up_m > self._ground_up_m(here_enu_m + distances_m[:, None] * outward) + GROUND_M

    def _wall(self, here_enu_m: Array, angle: float, distance_m: float, width_rad: float) -> Array:
        """(n, 3) points across one sector, at the vehicle's height and above and below it."""
        n_across = math.ceil(distance_m * width_rad / self._spacing_m) + 1
        n_up = 2 * math.ceil(self._half_height_m / self._spacing_m) + 1
        across = angle + width_rad * np.linspace(-0.5, 0.5, n_across)
        up = np.linspace(-self._half_height_m, self._half_height_m, n_up)
        level = here_enu_m + distance_m * np.column_stack((np.sin(across), np.cos(across), np.zeros(n_across)))
        return np.concatenate([level + np.array([0.0, 0.0, height_m]) for height_m in up])
