"""From a trajectory to setpoints: position, velocity, acceleration and heading in the autopilot's own NED frame."""

from dataclasses import dataclass, replace

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


POSITION_GAIN_HZ = 0.95
"""MPC_XY_P of a PX4: each metre of horizontal error makes it so much faster than the velocity that it is given."""


def within_speed(setpoint: Setpoint, estimate_m: Array, limit_m_s: float) -> Setpoint:
    """The same setpoint, its position drawn nearer to a vehicle that would catch up with it faster than the limit.

    An autopilot adds what it makes of the position error to the velocity that it is given. After a gust, or when
    setpoints came late, that exceeds the speed that the trajectory keeps.

    Args:
        setpoint: of the trajectory.
        estimate_m: (3,) where the vehicle will be when the setpoint is used, NED.
        limit_m_s: fastest horizontal speed that the autopilot is to aim at.
    """
    error_m = (setpoint.position_m - estimate_m)[:2]
    catching_up_m_s, given_m_s = POSITION_GAIN_HZ * error_m, setpoint.velocity_m_s[:2]
    if float(np.linalg.norm(given_m_s + catching_up_m_s)) <= limit_m_s:
        return setpoint
    share = _share_within(given_m_s, catching_up_m_s, limit_m_s)
    position_m = setpoint.position_m.copy()
    position_m[:2] = estimate_m[:2] + share * error_m
    return replace(setpoint, position_m=position_m)


def _share_within(base: Array, addition: Array, limit: float) -> float:
    """Largest share of an addition with which a sum of (2,) vectors stays as short as the limit, 0 if none does."""
    a, b, c = max(float(addition @ addition), 1e-12), 2.0 * float(base @ addition), float(base @ base) - limit**2
    root = np.sqrt(max(b * b - 4.0 * a * c, 0.0))
    return float(np.clip((root - b) / (2.0 * a), 0.0, 1.0))


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
