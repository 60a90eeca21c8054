"""What the vehicle can tell: one function per MAVLink message, from the autopilot's state to the message's fields.

Fields stand in the order of the message's definition. Values that PX4's simulator holds constant are constant here too;
they were read off a real PX4. A function returns None while it has nothing to say.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from missions.mission import Positioning
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.modes import SAFETY_ARMED, Mode
from sitl.autopilot.offboard import Ignore
from sitl.autopilot.places import LocalPoint
from sitl.dialect import mavlink
from sitl.dynamics.airframe import GRAVITY_M_S2
from sitl.dynamics.state import Guidance
from sitl.snapshot import Snapshot
from sitl.wire import FieldValues

NAN = math.nan

SENSORS_PRESENT, SENSORS_ENABLED = 0x0300402D, 0x0301402D
SENSORS_HEALTHY = 0x2320C83F
PREARM_BIT = 0x10000000
MISSION_NONE = 65535
NEAREST_CM = 10
"""OBSTACLE_DISTANCE's min_distance."""
PWM_OFF = 900
"""Of an output that drives nothing, or a motor that is disarmed."""
UTM_AVAILABLE = 0b0111_1111
"""UTM_DATA_AVAIL_FLAGS: everything but the next waypoint."""


class Surroundings(NamedTuple):
    """What a vehicle's range sensor has seen around it."""

    time_s: float
    """Of the vehicle's clock."""
    distances_m: tuple[float, ...]
    """In equal sectors clockwise from ahead; infinite for nothing, NaN for unseen."""
    range_m: float
    """How far it sees."""


class Moment(NamedTuple):
    """All that a message is made from."""

    autopilot: Autopilot
    s: Snapshot
    now_s: float
    utc_us: int
    """UTC of now: the simulation's start plus simulated time."""
    positioning: Positioning
    sysid: int
    body: np.void
    """The vehicle's record in the fleet, the truth included."""
    surroundings: Surroundings | None = None
    """None without a range sensor."""

    @property
    def time_boot_ms(self) -> int:
        return round(self.now_s * 1e3)

    @property
    def time_us(self) -> int:
        return round(self.now_s * 1e6)


Build = Callable[[Moment], FieldValues | None]


# ---------------------------------------------------------------- state
def heartbeat(m: Moment) -> FieldValues:
    commander = m.autopilot.commander
    mode = commander.mode
    base = mode.value.base_mode
    if mode is Mode.OFFBOARD and not m.autopilot.offboard.ever_heard:
        base = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    base |= SAFETY_ARMED if commander.armed or mode is Mode.TERMINATION else 0
    status = commander.system_status.value
    return mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_AUTOPILOT_PX4, base, mode.custom_mode, status, 3


def sys_status(m: Moment) -> FieldValues:
    battery = m.autopilot.battery
    armable = m.autopilot.commander.armed or m.autopilot.commander.ready
    health = SENSORS_HEALTHY | (PREARM_BIT if armable else 0)
    if m.s.dead_reckoning:
        health &= ~mavlink.MAV_SYS_STATUS_SENSOR_GPS
    voltage_mv, percent = round(battery.voltage_v * 1e3), round(battery.remaining * 100.0)
    load = 180
    return SENSORS_PRESENT, SENSORS_ENABLED, health, load, voltage_mv, -100, percent, 0, 0, 0, 0, 0, 0, 0, 0, 1


def extended_sys_state(m: Moment) -> FieldValues:
    return mavlink.MAV_VTOL_STATE_UNDEFINED, landed_state(m)


def landed_state(m: Moment) -> int:
    """MAV_LANDED_STATE."""
    autopilot = m.autopilot
    if m.s.landed or not autopilot.armed:
        return mavlink.MAV_LANDED_STATE_ON_GROUND
    control = autopilot.craft.control
    if control.guidance is Guidance.LAND:
        return mavlink.MAV_LANDED_STATE_LANDING
    taking_off = control.guidance is Guidance.WAYPOINT and control.taking_off
    return mavlink.MAV_LANDED_STATE_TAKEOFF if taking_off else mavlink.MAV_LANDED_STATE_IN_AIR


def current_mode(m: Moment) -> FieldValues:
    commander = m.autopilot.commander
    mode = commander.mode
    return mode.value.standard_mode, mode.custom_mode, commander.intended.custom_mode


def battery_status(m: Moment) -> FieldValues:
    battery = m.autopilot.battery
    voltages = (round(battery.voltage_v * 1e3),) + (65535,) * 9
    return 0, 1, 1, 32767, voltages, -100, 0, -1, round(battery.remaining * 100.0), 0, 1, (0,) * 4, 0, 0


def mission_current(m: Moment) -> FieldValues:
    mission = m.autopilot.navigator.mission
    total = len(mission.plan.items) or MISSION_NONE
    ids = (mission.plan.plan_id, m.autopilot.fence.plan.plan_id, m.autopilot.rally.plan_id)
    return mission.current, total, 0, 0, *ids


def home_position(m: Moment) -> FieldValues | None:
    autopilot = m.autopilot
    if not autopilot.home_known:
        return None
    craft = autopilot.craft
    place = craft.frame.on_earth(craft.home)
    half_yaw = 0.5 * craft.home_yaw_rad
    q = (math.cos(half_yaw), 0.0, 0.0, math.sin(half_yaw))
    here = e7(place.latitude_deg), e7(place.longitude_deg), round(place.altitude_m * 1e3)
    return *here, *craft.home, q, 0.0, 0.0, 0.0, round(craft.home_set_s * 1e6)


def gps_global_origin(m: Moment) -> FieldValues:
    origin = m.autopilot.craft.frame.origin
    return e7(origin.latitude_deg), e7(origin.longitude_deg), round(origin.altitude_m * 1e3), m.time_us


def system_time(m: Moment) -> FieldValues:
    return m.utc_us, m.time_boot_ms


def timesync(m: Moment) -> FieldValues:
    return 0, round(m.now_s * 1e9)


def ping(m: Moment) -> FieldValues:
    return m.time_us, round(m.now_s) & 0xFFFFFFFF, 0, 0


def autopilot_version(m: Moment) -> FieldValues:
    c = mavlink
    capabilities = (
        c.MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT
        | c.MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT
        | c.MAV_PROTOCOL_CAPABILITY_MISSION_INT
        | c.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
        | c.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
        | c.MAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET
        | c.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
        | c.MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION
        | c.MAV_PROTOCOL_CAPABILITY_MAVLINK2
        | c.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
        | c.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY
    )
    version = 0x01100040  # 1.16.0 alpha, which this simulator was compared with
    nothing = (0,) * 8
    return capabilities, version, version, 0, 1, nothing, nothing, nothing, 0, 0, m.sysid, (0,) * 18


# --------------------------------------------------------------- motion
def attitude(m: Moment) -> FieldValues:
    s = m.s
    return m.time_boot_ms, s.roll_rad, s.pitch_rad, s.yaw_rad, s.p_rad_s, s.q_rad_s, s.r_rad_s


def attitude_quaternion(m: Moment) -> FieldValues:
    s = m.s
    return m.time_boot_ms, s.qw, s.qx, s.qy, s.qz, s.p_rad_s, s.q_rad_s, s.r_rad_s, (0.0,) * 4


def local_position_ned(m: Moment) -> FieldValues:
    """Where it believes to be, also when it only reckons: a PX4 goes on to say so."""
    s = m.s
    return m.time_boot_ms, s.x_m, s.y_m, s.z_m, s.vx_m_s, s.vy_m_s, s.vz_m_s


def odometry(m: Moment) -> FieldValues:
    """As PX4's estimator has it: pose and velocity both in the local NED frame."""
    s, ned = m.s, mavlink.MAV_FRAME_LOCAL_NED
    across, up = m.positioning.horizontal_std_m**2, m.positioning.vertical_std_m**2
    speed = m.positioning.velocity_std_m_s**2
    pose_covariance = (across, *_NANS_5, across, *_NANS_4, up, *_NANS_3, 3e-4, NAN, NAN, 3e-4, NAN, 1.5e-3)
    velocity_covariance = (speed, *_NANS_5, speed, *_NANS_4, speed, *_NANS_9)
    pose = s.x_m, s.y_m, s.z_m, (s.qw, s.qx, s.qy, s.qz)
    motion = s.vx_m_s, s.vy_m_s, s.vz_m_s, s.p_rad_s, s.q_rad_s, s.r_rad_s
    autopilot = mavlink.MAV_ESTIMATOR_TYPE_AUTOPILOT
    return m.time_us, ned, ned, *pose, *motion, pose_covariance, velocity_covariance, 0, autopilot, 0


def global_position_int(m: Moment) -> FieldValues:
    s = m.s
    place = e7(s.latitude_deg), e7(s.longitude_deg), round(s.altitude_m * 1e3), round(s.height_m * 1e3)
    velocity = round(s.vx_m_s * 100.0), round(s.vy_m_s * 100.0), round(s.vz_m_s * 100.0)
    return m.time_boot_ms, *place, *velocity, round(_heading_deg(s.yaw_rad) * 100.0) % 36000


def gps_raw_int(m: Moment) -> FieldValues:
    s = m.s
    if s.dead_reckoning:
        return m.time_us, 0, 0, 0, 0, 65535, 65535, 65535, 65535, 0, 0, 0, 0, 0, 0, 0
    altitude_mm = round(s.altitude_m * 1e3)
    course = round(_heading_deg(math.atan2(s.vy_m_s, s.vx_m_s)) * 100.0) % 36000
    place = e7(s.latitude_deg), e7(s.longitude_deg), altitude_mm
    speed = round(s.ground_speed_m_s * 100.0)
    return m.time_us, 3, *place, 70, 110, speed, course, 10, altitude_mm, 900, 1780, 400, 0, 0


def vfr_hud(m: Moment) -> FieldValues:
    s = m.s
    heading = round(_heading_deg(s.yaw_rad)) % 360
    return 0.0, s.ground_speed_m_s, heading, round(s.thrust * 100.0), s.altitude_m, -s.vz_m_s


def altitude(m: Moment) -> FieldValues:
    s = m.s
    return m.time_us, s.altitude_m, s.altitude_m, -s.z_m, s.height_m, 0.0, s.height_m


def highres_imu(m: Moment) -> FieldValues:
    s = m.s
    felt = s.force_x_m_s2, s.force_y_m_s2, s.force_z_m_s2, s.p_rad_s, s.q_rad_s, s.r_rad_s
    updated = 0b1_1010_0011_1111  # accelerometer, gyroscope, pressure and its altitude, temperature
    return m.time_us, *felt, 0.0, 0.0, 0.0, _pressure_hpa(s), 0.0, s.altitude_m, _temperature_c(s), updated, 0


def scaled_pressure(m: Moment) -> FieldValues:
    return m.time_boot_ms, _pressure_hpa(m.s), 0.0, round(_temperature_c(m.s) * 100.0), 0


def estimator_status(m: Moment) -> FieldValues:
    flags = 895  # attitude, velocities, positions absolute and predicted, height above ground
    if not m.autopilot.craft.position_valid:
        flags &= ~(2 | 8 | 16 | 256 | 512)  # horizontal velocity and positions
    across, up = m.positioning.horizontal_std_m, m.positioning.vertical_std_m
    return m.time_us, flags, 0.1, 0.05, 0.04, 0.08, 0.01, NAN, across, up


def vibration(m: Moment) -> FieldValues:
    return m.time_us, 0.0, 0.0, 0.0, 0, 0, 0


def obstacle_distance(m: Moment) -> FieldValues | None:
    """What the range sensor sees around, in the body's frame."""
    if m.surroundings is None:
        return None
    time_s, distances_m, range_m = m.surroundings
    farthest_cm = round(min(range_m * 100.0, 65533.0))
    distances = tuple(_sector_cm(distance_m, farthest_cm) for distance_m in distances_m)
    width_deg = 360 // len(distances)
    kind, frame = mavlink.MAV_DISTANCE_SENSOR_LASER, mavlink.MAV_FRAME_BODY_FRD
    return round(time_s * 1e6), kind, distances, width_deg, NEAREST_CM, farthest_cm, 0.0, 0.0, frame


def _sector_cm(distance_m: float, farthest_cm: int) -> int:
    """OBSTACLE_DISTANCE's: one more than the farthest is free, 65535 unknown."""
    if math.isnan(distance_m):
        return 65535
    return farthest_cm + 1 if math.isinf(distance_m) else min(round(distance_m * 100.0), farthest_cm)


def utm_global_position(m: Moment) -> FieldValues:
    """For everybody else in the air; the id is the system's."""
    s = m.s
    across, up = (round(std * 1e3) for std in (m.positioning.horizontal_std_m, m.positioning.vertical_std_m))
    uas_id = (m.sysid,) + (0,) * 17
    place = e7(s.latitude_deg), e7(s.longitude_deg), round(s.altitude_m * 1e3), round(s.height_m * 1e3)
    velocity = round(s.vx_m_s * 100.0), round(s.vy_m_s * 100.0), round(s.vz_m_s * 100.0)
    accuracy = min(across, 65535), min(up, 65535), min(round(m.positioning.velocity_std_m_s * 100.0), 65535)
    state = mavlink.UTM_FLIGHT_STATE_AIRBORNE if not m.s.landed else mavlink.UTM_FLIGHT_STATE_GROUND
    return m.utc_us, uas_id, *place, *velocity, *accuracy, 0, 0, 0, 0, state, UTM_AVAILABLE


# ------------------------------------------------------------- setpoints
def attitude_target(m: Moment) -> FieldValues:
    s = m.s
    q = s.setpoint_qw, s.setpoint_qx, s.setpoint_qy, s.setpoint_qz
    return m.time_boot_ms, 0, q, s.setpoint_p_rad_s, s.setpoint_q_rad_s, s.setpoint_r_rad_s, s.thrust


def position_target_local_ned(m: Moment) -> FieldValues:
    s = m.s
    motion = _setpoint_velocity(s), _setpoint_acceleration(s)
    position = s.setpoint_x_m, s.setpoint_y_m, s.setpoint_z_m
    mask = _ignored((*position, *motion[0], *motion[1]))
    heading = s.setpoint_yaw_rad, _finite(s.setpoint_yawspeed_rad_s)
    return m.time_boot_ms, 1, mask, *position, *motion[0], *motion[1], *heading


def position_target_global_int(m: Moment) -> FieldValues | None:
    """The target of an auto mode; only in the air."""
    autopilot, s = m.autopilot, m.s
    if s.landed or autopilot.craft.control.guidance not in (Guidance.WAYPOINT, Guidance.LAND):
        return None
    place = autopilot.craft.frame.on_earth(LocalPoint(*autopilot.craft.control.target_m))
    target = e7(place.latitude_deg), e7(place.longitude_deg), place.altitude_m
    heading = s.setpoint_yaw_rad, _finite(s.setpoint_yawspeed_rad_s)
    return m.time_boot_ms, 5, 0, *target, *_setpoint_velocity(s), *_setpoint_acceleration(s), *heading


def servo_output_raw(m: Moment) -> FieldValues:
    return m.time_us & 0xFFFFFFFF, 0, *motor_pwm(m), *(PWM_OFF,) * 12


def motor_pwm(m: Moment) -> tuple[int, int, int, int]:
    """The signals to the motors, in microseconds."""
    if not m.autopilot.armed:
        return PWM_OFF, PWM_OFF, PWM_OFF, PWM_OFF
    u1, u2, u3, u4 = (round(1000.0 + 1000.0 * u) for u in (m.s.motor_1, m.s.motor_2, m.s.motor_3, m.s.motor_4))
    return u1, u2, u3, u4


# --------------------------------------------------------------- details
_NANS_3, _NANS_4, _NANS_5, _NANS_9 = (NAN,) * 3, (NAN,) * 4, (NAN,) * 5, (NAN,) * 9


def e7(degrees: float) -> int:
    return round(degrees * 1e7)


def _heading_deg(yaw_rad: float) -> float:
    return math.degrees(yaw_rad) % 360.0


def _finite(value: float) -> float:
    return value if math.isfinite(value) else 0.0


def _setpoint_velocity(s: Snapshot) -> tuple[float, float, float]:
    return s.setpoint_vx_m_s, s.setpoint_vy_m_s, s.setpoint_vz_m_s


def _setpoint_acceleration(s: Snapshot) -> tuple[float, float, float]:
    return s.setpoint_ax_m_s2, s.setpoint_ay_m_s2, s.setpoint_az_m_s2


def _ignored(numbers: tuple[float, ...]) -> int:
    """POSITION_TARGET_TYPEMASK of nine numbers, NaN for what is not controlled."""
    return sum(int(bit) for bit, number in zip(Ignore, numbers, strict=False) if math.isnan(number))


def _pressure_hpa(s: Snapshot) -> float:
    """Of the standard atmosphere."""
    return 1013.25 * (1.0 - 2.25577e-5 * s.altitude_m) ** 5.25588


def _temperature_c(s: Snapshot) -> float:
    return 15.0 - 6.65e-4 * GRAVITY_M_S2 * s.altitude_m
