"""Offboard setpoints: which messages are setpoints, what they mean, and how long they count.

Everything is checked here, before it can reach the control: numbers that are not finite free their axis or are refused,
frames and combinations that PX4 does not fly are refused with its texts.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntFlag

from sitl.autopilot.flight_control import FlightControl
from sitl.autopilot.parameters import Parameters
from sitl.autopilot.places import LocalPoint, OwnFrame, is_place
from sitl.autopilot.reports import Say, Severity
from sitl.snapshot import Snapshot

NAN = math.nan
FREE = (NAN, NAN, NAN)
FARTHEST_M = 1e6
FASTEST_M_S = 100.0
HARDEST_M_S2 = 100.0
FASTEST_TURN_RAD_S = 10.0

FRAME_LOCAL_NED, FRAME_BODY_NED = 1, 8
GLOBAL_FRAMES = {5: "amsl", 6: "home", 11: "home"}
"""MAV_FRAME of SET_POSITION_TARGET_GLOBAL_INT -> what its altitude counts from (terrain is taken for home)."""


class Ignore(IntFlag):
    """POSITION_TARGET_TYPEMASK."""

    X, Y, Z, VX, VY, VZ, AX, AY, AZ = (1 << bit for bit in range(9))
    FORCE = 1 << 9
    YAW = 1 << 10
    YAW_RATE = 1 << 11


class IgnoreAttitude(IntFlag):
    """ATTITUDE_TARGET_TYPEMASK."""

    ROLL_RATE = 1
    PITCH_RATE = 2
    YAW_RATE = 4
    THRUST = 64
    ATTITUDE = 128


_POSITION = (Ignore.X, Ignore.Y, Ignore.Z)
_VELOCITY = (Ignore.VX, Ignore.VY, Ignore.VZ)
_ACCELERATION = (Ignore.AX, Ignore.AY, Ignore.AZ)


@dataclass(frozen=True)
class TrajectorySetpoint:
    """Position, velocity and acceleration in the autopilot's NED frame; NaN does not control its axis."""

    position_m: Sequence[float] = FREE
    velocity_m_s: Sequence[float] = FREE
    acceleration_m_s2: Sequence[float] = FREE
    yaw_rad: float = NAN
    yawspeed_rad_s: float = NAN


@dataclass(frozen=True)
class AttitudeSetpoint:
    """An attitude (w, x, y, z; FRD -> NED), or body rates where it is None, and a share of full thrust."""

    quaternion: Sequence[float] | None
    rates_rad_s: Sequence[float]
    thrust: float


@dataclass(frozen=True)
class PositionTarget:
    """The fields that SET_POSITION_TARGET_LOCAL_NED and ..._GLOBAL_INT share."""

    frame: int
    ignore: Ignore
    velocity_m_s: Sequence[float]
    acceleration_m_s2: Sequence[float]
    yaw_rad: float
    yawspeed_rad_s: float
    position_m: Sequence[float] = field(default=FREE)
    """Of the local message."""


class Offboard:
    """The last setpoint from outside, and whether it still counts."""

    def __init__(self, parameters: Parameters, say: Say) -> None:
        self._parameters = parameters
        self._say = say
        self._setpoint: TrajectorySetpoint | AttitudeSetpoint | None = None
        self._received_s = -math.inf
        self._is_new = False

    @property
    def ever_heard(self) -> bool:
        return self._setpoint is not None

    @property
    def needs_position(self) -> bool:
        """Whether the last setpoint can be flown only by a vehicle that knows where it is."""
        return not isinstance(self._setpoint, AttitudeSetpoint)

    def is_alive(self, now_s: float) -> bool:
        """Whether a setpoint has come within COM_OF_LOSS_T."""
        return now_s - self._received_s < self._parameters["COM_OF_LOSS_T"]

    def receive_local(self, target: PositionTarget, here: Snapshot, now_s: float) -> None:
        """Take in a SET_POSITION_TARGET_LOCAL_NED."""
        setpoint = _requested(target, target.position_m)
        if target.frame == FRAME_BODY_NED and all(math.isnan(p) for p in setpoint.position_m):
            setpoint = _turned(setpoint, here.yaw_rad)
        elif target.frame == FRAME_BODY_NED:
            return self._refuse("SET_POSITION_TARGET_LOCAL_NED invalid")
        elif target.frame != FRAME_LOCAL_NED:
            return self._refuse(f"SET_POSITION_TARGET_LOCAL_NED coordinate frame {target.frame} unsupported")
        return self._take("SET_POSITION_TARGET_LOCAL_NED", target, setpoint, now_s)

    def receive_global(
        self,
        target: PositionTarget,
        place: tuple[float, float, float],
        frame: OwnFrame,
        home_altitude_m: float,
        now_s: float,
    ) -> None:
        """Take in a SET_POSITION_TARGET_GLOBAL_INT; `place` is latitude, longitude [deg] and altitude [m]."""
        name = "SET_POSITION_TARGET_GLOBAL_INT"
        if target.frame not in GLOBAL_FRAMES:
            return self._refuse(f"{name} invalid coordinate frame {target.frame}")
        latitude_deg, longitude_deg, altitude_m = place
        if GLOBAL_FRAMES[target.frame] == "home":
            altitude_m += home_altitude_m
        if not is_place(latitude_deg, longitude_deg):
            return self._refuse(f"{name} invalid")
        local = LocalPoint(*FREE)
        if not all(bit in target.ignore for bit in _POSITION):
            local = frame.local(latitude_deg, longitude_deg, altitude_m)
        return self._take(name, target, _requested(target, local), now_s)

    def receive_attitude(
        self,
        ignore: IgnoreAttitude,
        quaternion: Sequence[float],
        rates_rad_s: Sequence[float],
        thrust: float,
        now_s: float,
    ) -> None:
        """Take in a SET_ATTITUDE_TARGET."""
        by_rates = IgnoreAttitude.ATTITUDE in ignore
        thrust = 0.0 if IgnoreAttitude.THRUST in ignore else thrust
        used = rates_rad_s if by_rates else quaternion
        length = math.sqrt(sum(q * q for q in quaternion))
        if not all(math.isfinite(number) for number in (*used, thrust)) or (not by_rates and not length > 1e-3):
            return self._refuse("SET_ATTITUDE_TARGET invalid")
        rates = [
            max(-20.0, min(20.0, rate)) if math.isfinite(rate) and bit not in ignore else 0.0
            for rate, bit in zip(rates_rad_s, tuple(IgnoreAttitude)[:3], strict=True)
        ]
        unit = None if by_rates else [q / length for q in quaternion]
        self._accept(AttitudeSetpoint(unit, rates, min(max(thrust, 0.0), 1.0)), now_s)
        return None

    def apply(self, control: FlightControl, *, entering: bool) -> None:
        """Hand a setpoint that is new, or the last one when Offboard begins, to the control."""
        if not (self._is_new or entering) or self._setpoint is None:
            return
        self._is_new = False
        s = self._setpoint
        if isinstance(s, TrajectorySetpoint):
            control.track(s.position_m, s.velocity_m_s, s.acceleration_m_s2, s.yaw_rad, s.yawspeed_rad_s)
        elif s.quaternion is None:
            control.hold_rates(s.rates_rad_s, s.thrust)
        else:
            control.hold_attitude(s.quaternion, s.thrust, s.rates_rad_s[2])

    def _take(self, name: str, target: PositionTarget, setpoint: TrajectorySetpoint, now_s: float) -> None:
        numbers = (*setpoint.position_m, *setpoint.velocity_m_s, *setpoint.acceleration_m_s2)
        if all(math.isnan(number) for number in numbers):
            return self._refuse(f"{name} invalid")
        if Ignore.FORCE in target.ignore:
            return self._refuse(f"{name} force not supported")
        return self._accept(setpoint, now_s)

    def _accept(self, setpoint: TrajectorySetpoint | AttitudeSetpoint, now_s: float) -> None:
        self._setpoint, self._received_s, self._is_new = setpoint, now_s, True

    def _refuse(self, text: str) -> None:
        self._say(Severity.CRITICAL, text)


def _requested(target: PositionTarget, position_m: Sequence[float]) -> TrajectorySetpoint:
    """What a message asks for: axes that it ignores, or that are beyond all reason, are free."""
    ignore = target.ignore
    return TrajectorySetpoint(
        _chosen(position_m, _POSITION, ignore, FARTHEST_M),
        _chosen(target.velocity_m_s, _VELOCITY, ignore, FASTEST_M_S),
        _chosen(target.acceleration_m_s2, _ACCELERATION, ignore, HARDEST_M_S2),
        NAN if Ignore.YAW in ignore else _angle(target.yaw_rad),
        NAN if Ignore.YAW_RATE in ignore else _yawspeed(target.yawspeed_rad_s),
    )


def _chosen(values: Sequence[float], bits: Sequence[Ignore], ignore: Ignore, most: float) -> tuple[float, ...]:
    return tuple(
        NAN if bit in ignore or not abs(value) <= most else value for value, bit in zip(values, bits, strict=True)
    )


def _angle(value: float) -> float:
    return math.remainder(value, 2.0 * math.pi) if math.isfinite(value) else NAN


def _yawspeed(value: float) -> float:
    return min(max(value, -FASTEST_TURN_RAD_S), FASTEST_TURN_RAD_S) if math.isfinite(value) else NAN


def _turned(setpoint: TrajectorySetpoint, yaw_rad: float) -> TrajectorySetpoint:
    """A setpoint in the body's heading, in NED."""
    cos_yaw, sin_yaw = math.cos(yaw_rad), math.sin(yaw_rad)

    def turn(v: Sequence[float]) -> tuple[float, float, float]:
        return v[0] * cos_yaw - v[1] * sin_yaw, v[0] * sin_yaw + v[1] * cos_yaw, v[2]

    return TrajectorySetpoint(
        FREE,
        turn(setpoint.velocity_m_s),
        turn(setpoint.acceleration_m_s2),
        setpoint.yaw_rad + yaw_rad,
        setpoint.yawspeed_rad_s,
    )
