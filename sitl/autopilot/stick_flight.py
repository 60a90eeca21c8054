"""The modes that a pilot flies with sticks: Position, Altitude, Stabilized, Acro.

Written as PX4's flight tasks behave: in Position the sticks accelerate the vehicle against a drag that stops it when
they are let go (MPC_POS_MODE 4), in Altitude they tilt it, and in both the throttle is a climb rate; in Stabilized and
Acro the throttle is thrust.
"""

import math

from sitl.autopilot.craft import Craft
from sitl.autopilot.sticks import Sticks, shaped
from sitl.dynamics.airframe import GRAVITY_M_S2
from sitl.snapshot import Snapshot

NAN = math.nan
BRAKE_BOOST = 2.0
"""How much stronger the drag becomes when the sticks are let go."""
BRAKE_BOOST_S = 0.8
STANDSTILL_M_S = 0.1


class Heading:
    """The yaw stick turns; let go, the heading is kept."""

    def __init__(self, craft: Craft, sticks: Sticks, fastest: str) -> None:
        self._craft, self._sticks, self._fastest = craft, sticks, fastest
        self._kept_rad = NAN

    def start(self, s: Snapshot) -> None:
        self._kept_rad = s.yaw_rad

    def update(self, s: Snapshot) -> tuple[float, float]:
        """Heading [rad], NaN while it turns, and turn rate [rad/s]."""
        p = self._craft.parameters
        stick = shaped(self._sticks.yaw, p["MPC_HOLD_DZ"], p["MPC_YAW_EXPO"])
        if stick == 0.0:
            self._kept_rad = s.yaw_rad if math.isnan(self._kept_rad) else self._kept_rad
            return self._kept_rad, 0.0
        self._kept_rad = NAN
        return NAN, stick * math.radians(p[self._fastest])


class Climb:
    """The throttle stick climbs and sinks; centred, the height is kept."""

    def __init__(self, craft: Craft, sticks: Sticks) -> None:
        self._craft, self._sticks = craft, sticks
        self._speed_m_s = 0.0
        self._kept_z_m = NAN

    def start(self, s: Snapshot) -> None:
        self._speed_m_s, self._kept_z_m = s.vz_m_s, NAN

    @property
    def stick(self) -> float:
        p = self._craft.parameters
        return shaped(self._sticks.throttle, p["MPC_HOLD_DZ"], p["MPC_Z_MAN_EXPO"])

    def update(self, s: Snapshot, dt_s: float) -> tuple[float, float]:
        """Height to keep (z, NED [m]), NaN while it changes, and speed down [m/s]."""
        p, stick = self._craft.parameters, self.stick
        wanted_m_s = -stick * (p["MPC_Z_VEL_MAX_UP"] if stick > 0.0 else self._descent_m_s(s))
        most_m_s = dt_s * (p["MPC_ACC_UP_MAX"] if wanted_m_s < self._speed_m_s else p["MPC_ACC_DOWN_MAX"])
        self._speed_m_s += min(max(wanted_m_s - self._speed_m_s, -most_m_s), most_m_s)
        if stick != 0.0:
            self._kept_z_m = NAN
        elif math.isnan(self._kept_z_m) and abs(s.vz_m_s) < p["MPC_HOLD_MAX_Z"]:
            self._kept_z_m, self._speed_m_s = s.z_m, 0.0
        return self._kept_z_m, self._speed_m_s

    def _descent_m_s(self, s: Snapshot) -> float:
        """How fast to sink at most: slower near the ground, as in a landing."""
        p = self._craft.parameters
        low_m, high_m = p["MPC_LAND_ALT2"], max(p["MPC_LAND_ALT1"], p["MPC_LAND_ALT2"] + 1e-3)
        share = min(max((s.height_m - low_m) / (high_m - low_m), 0.0), 1.0)
        slow_m_s = min(p["MPC_LAND_SPEED"], p["MPC_Z_VEL_MAX_DN"])
        return slow_m_s + share * (p["MPC_Z_VEL_MAX_DN"] - slow_m_s)


class PositionSticks:
    """Position: roll and pitch sticks fly across, relative to the nose; let go, the vehicle brakes and stays.

    Args:
        craft: the vehicle.
        sticks: the pilot's.
        speed: name of the parameter for the speed at full deflection.
        turn: the same for the turn rate.
    """

    def __init__(
        self, craft: Craft, sticks: Sticks, *, speed: str = "MPC_VEL_MANUAL", turn: str = "MPC_MAN_Y_MAX"
    ) -> None:
        self._craft, self._sticks, self._fastest = craft, sticks, speed
        self._climb, self._heading = Climb(craft, sticks), Heading(craft, sticks, turn)
        self._velocity_m_s = (0.0, 0.0)
        self._acceleration_m_s2 = (0.0, 0.0)
        self._boost = 1.0
        self._kept_m: tuple[float, float] | None = None
        self._updated_s = 0.0

    def start(self, s: Snapshot, now_s: float) -> None:
        self._climb.start(s)
        self._heading.start(s)
        self._velocity_m_s, self._acceleration_m_s2 = (s.vx_m_s, s.vy_m_s), (0.0, 0.0)
        self._boost, self._kept_m = 1.0, None
        self._updated_s = now_s

    def update(self, s: Snapshot, now_s: float) -> bool:
        dt_s, self._updated_s = now_s - self._updated_s, now_s
        if s.landed and self._climb.stick <= 0.0:
            self.start(s, now_s)
            self._craft.control.idle()
            return False
        self._accelerate(*self._across(s), dt_s)
        yaw_rad, yawspeed_rad_s = self._heading.update(s)
        z_m, vz_m_s = self._climb.update(s, dt_s)
        x_m, y_m = self._keep(s) or (NAN, NAN)
        self._craft.control.track(
            (x_m, y_m, z_m),
            (*self._velocity_m_s, vz_m_s),
            (*self._acceleration_m_s2, NAN),
            yaw_rad,
            yawspeed_rad_s,
        )
        return False

    def _across(self, s: Snapshot) -> tuple[float, float]:
        """Roll and pitch sticks as a vector in NED, no longer than 1."""
        p = self._craft.parameters
        forward, right = (
            shaped(stick, p["MPC_HOLD_DZ"], p["MPC_XY_MAN_EXPO"]) for stick in (self._sticks.pitch, self._sticks.roll)
        )
        return _turned(*_within(forward, right, 1.0), s.yaw_rad)

    def _accelerate(self, north: float, east: float, dt_s: float) -> None:
        """Advance the velocity setpoint: the sticks push, a drag holds back, and the jerk is limited."""
        p = self._craft.parameters
        push_m_s2 = 2.0 * p["MPC_ACC_HOR"]  # because of the drag the mean acceleration is half of it
        released = north == 0.0 and east == 0.0
        self._boost += dt_s / (dt_s + BRAKE_BOOST_S) * (BRAKE_BOOST - self._boost) if released else 1.0 - self._boost
        vx, vy = self._velocity_m_s
        speed = math.hypot(vx, vy)
        drag = self._boost * push_m_s2 / p[self._fastest] * (1.0 / math.sqrt(speed) if 0.0 < speed < 1.0 else 1.0)
        step = p["MPC_JERK_MAX"] * dt_s
        ax, ay = self._acceleration_m_s2
        ax += min(max(north * push_m_s2 - drag * vx - ax, -step), step)
        ay += min(max(east * push_m_s2 - drag * vy - ay, -step), step)
        new_x, new_y = vx + ax * dt_s, vy + ay * dt_s
        if released and new_x * vx + new_y * vy <= 0.0:  # the drag stops, and does not push back
            ax = ay = new_x = new_y = 0.0
        self._velocity_m_s, self._acceleration_m_s2 = (new_x, new_y), (ax, ay)

    def _keep(self, s: Snapshot) -> tuple[float, float] | None:
        """Where to stay, once the vehicle has come to a stop."""
        stopping = math.hypot(*self._velocity_m_s) < STANDSTILL_M_S and self._acceleration_m_s2 == (0.0, 0.0)
        if not stopping:
            self._kept_m = None
        elif self._kept_m is None and s.ground_speed_m_s < self._craft.parameters["MPC_HOLD_MAX_XY"]:
            self._kept_m = (s.x_m, s.y_m)
        return self._kept_m


class AltitudeSticks:
    """Altitude: roll and pitch sticks tilt the vehicle, which drifts with the wind when they are let go."""

    def __init__(self, craft: Craft, sticks: Sticks) -> None:
        self._craft, self._sticks = craft, sticks
        self._climb, self._heading = Climb(craft, sticks), Heading(craft, sticks, "MPC_MAN_Y_MAX")
        self._updated_s = 0.0

    def start(self, s: Snapshot, now_s: float) -> None:
        self._climb.start(s)
        self._heading.start(s)
        self._updated_s = now_s

    def update(self, s: Snapshot, now_s: float) -> bool:
        dt_s, self._updated_s = now_s - self._updated_s, now_s
        if s.landed and self._climb.stick <= 0.0:
            self.start(s, now_s)
            self._craft.control.idle()
            return False
        forward, right = _within(self._sticks.pitch, self._sticks.roll, 1.0)
        tilt_rad = math.hypot(forward, right) * math.radians(self._craft.parameters["MPC_MAN_TILT_MAX"])
        scale = GRAVITY_M_S2 * math.tan(tilt_rad) / max(math.hypot(forward, right), 1e-9)
        ax, ay = _turned(forward * scale, right * scale, s.yaw_rad)
        yaw_rad, yawspeed_rad_s = self._heading.update(s)
        z_m, vz_m_s = self._climb.update(s, dt_s)
        self._craft.control.track((NAN, NAN, z_m), (NAN, NAN, vz_m_s), (ax, ay, NAN), yaw_rad, yawspeed_rad_s)
        return False


class StabilizedSticks:
    """Stabilized, and Manual, which is the same for a multirotor: sticks are tilt, turn rate and thrust."""

    def __init__(self, craft: Craft, sticks: Sticks) -> None:
        self._craft, self._sticks = craft, sticks
        self._heading = Heading(craft, sticks, "MPC_MAN_Y_MAX")

    def start(self, s: Snapshot, now_s: float) -> None:
        self._heading.start(s)

    def update(self, s: Snapshot, now_s: float) -> bool:
        tilt_max_rad = math.radians(self._craft.parameters["MPC_MAN_TILT_MAX"])
        forward, right = _within(self._sticks.pitch, self._sticks.roll, 1.0)
        yaw_rad, yawspeed_rad_s = self._heading.update(s)
        yaw_rad = s.yaw_rad if math.isnan(yaw_rad) else yaw_rad
        attitude = _tilted(right * tilt_max_rad, -forward * tilt_max_rad, yaw_rad)
        self._craft.control.hold_attitude(attitude, thrust(self._craft, self._sticks), yawspeed_rad_s)
        return False


class AcroSticks:
    """Acro: sticks are body rates and thrust."""

    def __init__(self, craft: Craft, sticks: Sticks) -> None:
        self._craft, self._sticks = craft, sticks

    def start(self, s: Snapshot, now_s: float) -> None:
        """Nothing is remembered."""

    def update(self, s: Snapshot, now_s: float) -> bool:
        p, sticks = self._craft.parameters, self._sticks
        axes = (sticks.roll, "MC_ACRO_R_MAX"), (-sticks.pitch, "MC_ACRO_P_MAX"), (sticks.yaw, "MC_ACRO_Y_MAX")
        rates_rad_s = [stick * math.radians(p[name]) for stick, name in axes]
        self._craft.control.hold_rates(rates_rad_s, thrust(self._craft, sticks))
        return False


def thrust(craft: Craft, sticks: Sticks) -> float:
    """Share of full thrust: MPC_MANTHR_MIN with the throttle down, hover in the middle, MPC_THR_MAX up."""
    p = craft.parameters
    middle = p["MPC_THR_HOVER"]
    end = p["MPC_THR_MAX"] if sticks.throttle > 0.0 else p["MPC_MANTHR_MIN"]
    return middle + abs(sticks.throttle) * (end - middle)


def _within(x: float, y: float, longest: float) -> tuple[float, float]:
    """A vector no longer than `longest`."""
    length = math.hypot(x, y)
    return (x, y) if length <= longest else (x / length * longest, y / length * longest)


def _turned(forward: float, right: float, yaw_rad: float) -> tuple[float, float]:
    """A vector relative to the nose, in north and east."""
    cosine, sine = math.cos(yaw_rad), math.sin(yaw_rad)
    return forward * cosine - right * sine, forward * sine + right * cosine


def _tilted(roll_rad: float, pitch_rad: float, yaw_rad: float) -> tuple[float, float, float, float]:
    """Attitude (w, x, y, z; FRD -> NED): the heading, then a tilt about a horizontal axis of the body."""
    angle_rad = math.hypot(roll_rad, pitch_rad)
    w, scale = math.cos(0.5 * angle_rad), math.sin(0.5 * angle_rad) / max(angle_rad, 1e-9)
    x, y = roll_rad * scale, pitch_rad * scale
    c, s = math.cos(0.5 * yaw_rad), math.sin(0.5 * yaw_rad)
    return c * w, c * x - s * y, c * y + s * x, s * w
