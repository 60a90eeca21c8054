"""What a companion sees: a driver, what feeds it, and the poses that its points are placed by. Sans-IO."""

from collections import Counter
from collections.abc import Callable, Iterable
from typing import Protocol

import numpy as np
import numpy.typing as npt

from companion.sensing.intake import Dropped
from companion.sensing.lidar import LidarDriver
from companion.sensing.obstacle_distance import ObstacleDistanceDriver
from companion.sensing.pose_history import PoseHistory
from companion.sensing.scan import Scan
from missions import obstacles
from missions.frames import AutopilotFrame
from missions.mission import Mission, SensorKind

Array = npt.NDArray[np.float64]

SILENT_PERIODS, LEAST_SILENT_S = 5.0, 0.5
"""A sensor is silent when nothing came for so many periods, and for so long."""


class Driver(Protocol):
    """One kind of range sensor."""

    heard_s: float
    """Vehicle time at which it was last heard; -inf before."""
    dropped: Counter[Dropped]

    def receive(self, raw: bytes, now_s: float) -> None:
        """Take in what the sensor has sent; never raises."""
        ...

    def take(self, poses: PoseHistory, frame: AutopilotFrame, now_s: float) -> Scan | None:
        """A scan that was not taken yet, if there is one."""
        ...

    def forget(self) -> None:
        """The vehicle's clock has jumped."""
        ...


def nothing() -> Iterable[bytes]:
    """What comes from a sensor that is not polled: its messages are handed over one by one."""
    return ()


class Sensing:
    """The range sensor of one vehicle.

    Args:
        driver: makes scans of what the sensor sends.
        rate_hz: of scans.
        poll: what the sensor has sent since the last call.
    """

    def __init__(self, driver: Driver, rate_hz: float, poll: Callable[[], Iterable[bytes]] = nothing) -> None:
        self.driver = driver
        self._poses = PoseHistory()
        self._poll = poll
        self._silent_after_s = max(SILENT_PERIODS / rate_hz, LEAST_SILENT_S)

    def observe(self, time_s: float, position_ned_m: Array, attitude_ned_frd: Array) -> None:
        """Take in an estimate of where the vehicle is (see `PoseHistory.add`)."""
        self._poses.add(time_s, position_ned_m, attitude_ned_frd)

    def receive(self, raw: bytes, now_s: float) -> None:
        """Take in what the sensor has sent by way of the autopilot."""
        self.driver.receive(raw, now_s)

    def look(self, frame: AutopilotFrame | None, now_s: float) -> Scan | None:
        """Poll the sensor at vehicle time `now_s`; a scan if one is whole, and the autopilot's frame known."""
        for raw in self._poll():
            self.driver.receive(raw, now_s)
        return None if frame is None else self.driver.take(self._poses, frame, now_s)

    def is_silent(self, now_s: float) -> bool:
        """The sensor has not been heard for too long, or never."""
        return now_s - self.driver.heard_s > self._silent_after_s

    def reframe(self) -> None:
        """The autopilot's frame has moved: poses in the old one are void."""
        self._poses.forget()

    def forget(self) -> None:
        """The autopilot is gone, perhaps rebooted: its clock may begin anew."""
        self._poses.forget()
        self.driver.forget()


def driver_of(kind: SensorKind, mission: Mission) -> LidarDriver | ObstacleDistanceDriver | None:
    """The driver of a kind of sensor on a vehicle of a mission; None for none."""
    limits = mission.limits
    match kind:
        case SensorKind.LIDAR:
            return LidarDriver(mission.sensor.range_m, limits.body_radius_m)
        case SensorKind.OBSTACLE_DISTANCE:
            known = obstacles.pack(mission.world.as_known())
            half_height_m = limits.body_radius_m + limits.clearance_m
            return ObstacleDistanceDriver(
                mission.onboard.voxel_m, half_height_m, lambda points: obstacles.terrain_height(points, known)
            )
        case SensorKind.NONE:
            return None


def ring_hz_of(kind: SensorKind, mission: Mission) -> float:
    """How often OBSTACLE_DISTANCE is wanted [Hz]; 0 for not at all."""
    return mission.sensor.rate_hz if kind is SensorKind.OBSTACLE_DISTANCE else 0.0
