"""From a trajectory to setpoints: position, velocity, acceleration and heading in the autopilot's own NED frame."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from missions.frames import AutopilotFrame
from missions.trajectory import Trajectory

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Setpoint:
    """What the autopilot shall be doing now, NED, as SET_POSITION_TARGET_LOCAL_NED has it."""

    position_m: Array
    velocity_m_s: Array
    acceleration_m_s2: Array
    yaw_rad: float


def in_ned(trajectory: Trajectory, frame: AutopilotFrame) -> Trajectory:
    """The same trajectory in the autopilot's frame; splines are affine invariant: only the control points change."""
    control_ned_m = frame.ned(trajectory.control_points_m)
    return Trajectory(control_ned_m, trajectory.start_s, trajectory.knot_interval_s)


class Heading:
    """A heading that follows the path: turned no faster than a limit, and kept while the vehicle is slow.

    Args:
        yaw_rad: where it looks first.
        rate_rad_s: fastest turn.
        above_m_s: horizontal speed from which on it follows the path.
    """

    def __init__(self, yaw_rad: float, rate_rad_s: float, above_m_s: float) -> None:
        self.yaw_rad = yaw_rad
        self._rate_rad_s = rate_rad_s
        self._above_m_s = above_m_s

    def follow(self, velocity_ned_m_s: Array, elapsed_s: float) -> float:
        """The heading after `elapsed_s` of moving with a (3,) velocity, in (-pi, pi]."""
        north, east, _ = velocity_ned_m_s
        if np.hypot(north, east) > self._above_m_s:
            turn = _wrapped(float(np.arctan2(east, north)) - self.yaw_rad)
            most = self._rate_rad_s * max(elapsed_s, 0.0)
            self.yaw_rad = _wrapped(self.yaw_rad + min(max(turn, -most), most))
        return self.yaw_rad


def _wrapped(angle_rad: float) -> float:
    """The same angle in (-pi, pi]."""
    return float(np.pi - (np.pi - angle_rad) % (2.0 * np.pi))
