"""What the vehicle tells only when it is asked to, or in one mode alone; built as in `telemetry`.

Here are also the messages that PyPI's dialect lacks, with layouts of their own.
"""

import struct

from sitl.autopilot.modes import Mode
from sitl.autopilot.places import LocalPoint
from sitl.dialect import mavlink
from sitl.dynamics.airframe import GRAVITY_M_S2
from sitl.microservices.telemetry import PWM_OFF, Moment, e7, motor_pwm
from sitl.wire import FieldValues, Layout

RANGE_CM = 10_000
"""How far the range finder looks that points down."""
MILLI_G = 1e3 / GRAVITY_M_S2
OUTPUTS, OUTPUT_FIELDS = 16, 32

PROTOCOL_VERSION = Layout.of_own("PROTOCOL_VERSION", 300, 217, struct.Struct("<HHH8B8B"))
COMPONENT_INFORMATION = Layout.of_own("COMPONENT_INFORMATION", 395, 0, struct.Struct("<III100s100s"))
COMPONENT_METADATA = Layout.of_own("COMPONENT_METADATA", 397, 182, struct.Struct("<II100s"))


def int16(value: float) -> int:
    """As the message's field can hold it: an impact is felt as more than 32 g."""
    return min(max(round(value), -(2**15)), 2**15 - 1)


def distance_sensor(m: Moment) -> FieldValues:
    """As PX4's simulation in hardware has it: looking down, on ground that is as high as home."""
    height_cm = min(max(round(m.s.height_m * 100.0), 0), RANGE_CM)
    down = mavlink.MAV_SENSOR_ROTATION_PITCH_270
    return (
        m.time_boot_ms,
        0,
        RANGE_CM,
        height_cm,
        mavlink.MAV_DISTANCE_SENSOR_LASER,
        0,
        down,
        0,
        0.0,
        0.0,
        (0.0,) * 4,
        0,
    )


def scaled_imu(m: Moment) -> FieldValues:
    """The accelerometer and gyroscope in thousandths; there is no magnetometer."""
    s = m.s
    felt = (int16(force * MILLI_G) for force in (s.force_x_m_s2, s.force_y_m_s2, s.force_z_m_s2))
    rates = (int16(rate * 1e3) for rate in (s.p_rad_s, s.q_rad_s, s.r_rad_s))
    return m.time_boot_ms, *felt, *rates, 0, 0, 0, 0


def actuator_output_status(m: Moment) -> FieldValues:
    outputs = (*(float(pwm) for pwm in motor_pwm(m)), *(float(PWM_OFF),) * (OUTPUTS - 4))
    return m.time_us, OUTPUTS, outputs + (0.0,) * (OUTPUT_FIELDS - OUTPUTS)


def flight_information(m: Moment) -> FieldValues:
    """When this or the last flight began; 0 before the first."""
    commander = m.autopilot.commander
    boot_us = m.utc_us - m.time_us
    armed, airborne = (
        0 if since_s is None else boot_us + round(since_s * 1e6)
        for since_s in (commander.armed_s, commander.airborne_s)
    )
    return m.time_boot_ms, armed, airborne, commander.n_armed, 0


def hil_state_quaternion(m: Moment) -> FieldValues:
    """The ground truth, as PX4's simulators give it away."""
    body, s = m.body, m.s
    x, y, z = (float(here - error) for here, error in zip((s.x_m, s.y_m, s.z_m), body["position_error_m"], strict=True))
    place = m.autopilot.craft.frame.on_earth(LocalPoint(x, y, z))
    attitude, rates = tuple(body["attitude"].tolist()), body["rates_rad_s"].tolist()
    velocity = (int16(speed * 100.0) for speed in body["velocity_m_s"].tolist())
    felt = (int16(force * MILLI_G) for force in body["specific_force_m_s2"].tolist())
    here = e7(place.latitude_deg), e7(place.longitude_deg), round(place.altitude_m * 1e3)
    return m.time_us, attitude, *rates, *here, *velocity, 0, 0, *felt


def orbit_execution_status(m: Moment) -> FieldValues | None:
    """Around what Orbit circles, while it does."""
    autopilot = m.autopilot
    if autopilot.mode is not Mode.ORBIT or not autopilot.armed:
        return None
    centre, radius_m = autopilot.navigator.orbit.circle
    place = autopilot.craft.frame.on_earth(centre)
    where = e7(place.latitude_deg), e7(place.longitude_deg), place.altitude_m
    return m.time_us, radius_m, mavlink.MAV_FRAME_GLOBAL, *where


def protocol_version(m: Moment) -> FieldValues:
    """MAVLink 2, and 1 is understood."""
    return 200, 100, 200, *(0,) * 16


def component_metadata(m: Moment) -> FieldValues:
    """There are no files to be fetched, so their addresses are empty."""
    return m.time_boot_ms, 0, b""


def component_information(m: Moment) -> FieldValues:
    return m.time_boot_ms, 0, 0, b"", b""
