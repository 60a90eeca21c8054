"""How the autopilot's decisions reach the compiled control: orders written into one vehicle's record."""

import math
from collections.abc import Sequence

import numpy as np

from sitl.autopilot.places import LocalPoint
from sitl.dynamics.state import Guidance

NAN = math.nan
_AUTO = (Guidance.WAYPOINT, Guidance.LAND)


class FlightControl:
    """Orders to one vehicle's guidance and control.

    Args:
        vehicle: its record, of dtype `VEHICLE`; shared with the fleet.
        gains: its record of dtype `GAINS`.
    """

    def __init__(self, vehicle: np.void, gains: np.void) -> None:
        self._vehicle = vehicle
        self._gains = gains
        self._guidance = Guidance.MOTORS_OFF

    @property
    def guidance(self) -> Guidance:
        """What is being flown by."""
        return self._guidance

    @property
    def taking_off(self) -> bool:
        """Whether the target that is flown to is a take-off's."""
        return bool(self._vehicle["taking_off"])

    @property
    def target_m(self) -> tuple[float, float, float]:
        """(3,) the place that is flown to, in the autopilot's NED frame."""
        x, y, z = self._vehicle["target_m"].tolist()
        return x, y, z

    def set_gain(self, name: str, value: float) -> None:
        """Hand a parameter to the control, if it is one that the control reads."""
        if name in (self._gains.dtype.names or ()):
            self._gains[name] = value

    def set_ground(self, z_m: float) -> None:
        """Home's height, from which landing and take-off speeds are counted."""
        self._vehicle["ground_z_m"] = z_m

    def motors_off(self) -> None:
        self._order(Guidance.MOTORS_OFF)

    def idle(self) -> None:
        """Armed, on the ground, rotors at their least."""
        self._order(Guidance.IDLE)

    def fly_to(
        self,
        target: LocalPoint,
        *,
        cruise_m_s: float,
        acceptance_m: float,
        previous: LocalPoint | None = None,
        onwards: LocalPoint | None = None,
        yaw_rad: float = NAN,
        taking_off: bool = False,
    ) -> None:
        """Fly to a point on a jerk-limited trajectory.

        Args:
            target: where to.
            cruise_m_s: horizontal speed.
            acceptance_m: how near counts as there; sets how fast the turn onwards may be.
            previous: where the leg begins; the vehicle comes back to the line between the two.
            onwards: the point after the target, if the vehicle shall not stop there.
            yaw_rad: heading; NaN follows the trajectory.
            taking_off: the first metres are climbed slowly.
        """
        self._enter_auto(Guidance.WAYPOINT)
        v = self._vehicle
        v["previous_m"][:] = target if previous is None else previous
        v["target_m"][:] = target
        v["next_m"][:] = target if onwards is None else onwards
        v["target_yaw_rad"], v["cruise_m_s"], v["acceptance_m"] = yaw_rad, cruise_m_s, acceptance_m
        v["taking_off"] = taking_off

    def set_cruise(self, cruise_m_s: float) -> None:
        """Change the horizontal speed of what is being flown."""
        self._vehicle["cruise_m_s"] = cruise_m_s

    def turn_to(self, yaw_rad: float) -> None:
        """Change the heading of what is being flown; NaN follows the trajectory."""
        self._vehicle["target_yaw_rad"] = yaw_rad

    def land_at(self, x_m: float, y_m: float, *, cruise_m_s: float, yaw_rad: float = NAN) -> None:
        """Descend at a place until the land detector stops it."""
        self._enter_auto(Guidance.LAND)
        v = self._vehicle
        v["target_m"][:] = (x_m, y_m, 0.0)
        v["previous_m"][:] = v["next_m"][:] = v["target_m"]
        v["target_yaw_rad"], v["cruise_m_s"], v["acceptance_m"], v["taking_off"] = yaw_rad, cruise_m_s, 2.0, 0

    def track(
        self,
        position_m: Sequence[float],
        velocity_m_s: Sequence[float],
        acceleration_m_s2: Sequence[float],
        yaw_rad: float = NAN,
        yawspeed_rad_s: float = NAN,
    ) -> None:
        """Follow setpoints as they are; NaN does not control its axis."""
        self._order(Guidance.SETPOINT)
        v = self._vehicle
        v["setpoint_position_m"][:] = position_m
        v["setpoint_velocity_m_s"][:] = velocity_m_s
        v["setpoint_acceleration_m_s2"][:] = acceleration_m_s2
        v["setpoint_yaw_rad"], v["setpoint_yawspeed_rad_s"] = yaw_rad, yawspeed_rad_s

    def hold_attitude(self, quaternion: Sequence[float], thrust: float, yawspeed_rad_s: float = 0.0) -> None:
        """Hold an attitude (w, x, y, z; FRD -> NED) and a share of full thrust."""
        self._order(Guidance.ATTITUDE)
        self._vehicle["setpoint_attitude"][:] = quaternion
        self._vehicle["setpoint_thrust"] = thrust
        self._vehicle["setpoint_yawspeed_rad_s"] = yawspeed_rad_s

    def hold_rates(self, rates_rad_s: Sequence[float], thrust: float) -> None:
        """Hold body rates and a share of full thrust."""
        self._order(Guidance.RATES)
        self._vehicle["setpoint_rates_rad_s"][:] = rates_rad_s
        self._vehicle["setpoint_thrust"] = thrust

    def _order(self, guidance: Guidance) -> None:
        self._guidance = guidance
        self._vehicle["guidance"] = guidance

    def _enter_auto(self, guidance: Guidance) -> None:
        """Begin a trajectory where the vehicle's last setpoint was, or else where it is, so that nothing jumps."""
        v, before = self._vehicle, self._guidance
        self._order(guidance)
        if before in _AUTO:
            return
        position = v["position_m"] + v["offset_m"]
        velocity = v["velocity_m_s"] + v["velocity_error_m_s"]
        acceleration = np.zeros(3)
        v["yaw_before_rad"] = NAN
        if before is Guidance.SETPOINT:
            position = _unless_free(v["setpoint_position_m"], position)
            velocity = _unless_free(v["setpoint_velocity_m_s"], velocity)
            acceleration = _unless_free(v["setpoint_acceleration_m_s2"], acceleration)
            v["yaw_before_rad"] = v["setpoint_yaw_rad"]
        v["smooth_position_m"][:], v["smooth_velocity_m_s"][:] = position, velocity
        v["smooth_acceleration_m_s2"][:] = np.clip(acceleration, -10.0, 10.0)
        v["turn_speed_m_s"] = float(np.hypot(velocity[0], velocity[1]))
        v["yawspeed_filtered_rad_s"] = 0.0


def _unless_free(setpoint: np.ndarray, otherwise: np.ndarray) -> np.ndarray:
    return np.where(np.isnan(setpoint), otherwise, setpoint)
