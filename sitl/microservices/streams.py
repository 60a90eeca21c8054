"""Which messages a link gets by itself, and how often: PX4's set at lower rates, changed by SET_MESSAGE_INTERVAL."""

import heapq
import math
from dataclasses import dataclass
from typing import NamedTuple

from sitl.microservices import telemetry
from sitl.microservices.outbox import Link, Outbox
from sitl.microservices.telemetry import Build, Moment
from sitl.wire import LAYOUTS, Layout


class Stream(NamedTuple):
    """A message that can be streamed, with its default rates; 0 is off."""

    name: str
    build: Build
    ground_hz: float
    onboard_hz: float


STREAMS = (
    Stream("HEARTBEAT", telemetry.heartbeat, 1.0, 1.0),
    Stream("ATTITUDE", telemetry.attitude, 10.0, 50.0),
    Stream("ATTITUDE_QUATERNION", telemetry.attitude_quaternion, 2.0, 20.0),
    Stream("ATTITUDE_TARGET", telemetry.attitude_target, 2.0, 5.0),
    Stream("LOCAL_POSITION_NED", telemetry.local_position_ned, 10.0, 20.0),
    Stream("POSITION_TARGET_LOCAL_NED", telemetry.position_target_local_ned, 4.0, 5.0),
    Stream("POSITION_TARGET_GLOBAL_INT", telemetry.position_target_global_int, 1.0, 2.0),
    Stream("GLOBAL_POSITION_INT", telemetry.global_position_int, 10.0, 20.0),
    Stream("ODOMETRY", telemetry.odometry, 0.0, 30.0),
    Stream("HIGHRES_IMU", telemetry.highres_imu, 0.0, 10.0),
    Stream("SERVO_OUTPUT_RAW", telemetry.servo_output_raw, 2.0, 2.0),
    Stream("VFR_HUD", telemetry.vfr_hud, 4.0, 4.0),
    Stream("GPS_RAW_INT", telemetry.gps_raw_int, 2.0, 4.0),
    Stream("ALTITUDE", telemetry.altitude, 1.0, 4.0),
    Stream("TIMESYNC", telemetry.timesync, 0.0, 2.0),
    Stream("EXTENDED_SYS_STATE", telemetry.extended_sys_state, 2.0, 5.0),
    Stream("SYS_STATUS", telemetry.sys_status, 1.0, 2.0),
    Stream("MISSION_CURRENT", telemetry.mission_current, 1.0, 1.0),
    Stream("SCALED_PRESSURE", telemetry.scaled_pressure, 1.0, 1.0),
    Stream("ESTIMATOR_STATUS", telemetry.estimator_status, 0.5, 1.0),
    Stream("SYSTEM_TIME", telemetry.system_time, 1.0, 1.0),
    Stream("BATTERY_STATUS", telemetry.battery_status, 0.5, 0.5),
    Stream("CURRENT_MODE", telemetry.current_mode, 0.5, 0.5),
    Stream("HOME_POSITION", telemetry.home_position, 0.5, 0.5),
    Stream("VIBRATION", telemetry.vibration, 0.1, 0.5),
    Stream("PING", telemetry.ping, 0.1, 1.0),
    Stream("GPS_GLOBAL_ORIGIN", telemetry.gps_global_origin, 0.0, 0.0),
    Stream("AUTOPILOT_VERSION", telemetry.autopilot_version, 0.0, 0.0),
    Stream("OBSTACLE_DISTANCE", telemetry.obstacle_distance, 0.0, 10.0),
    Stream("UTM_GLOBAL_POSITION", telemetry.utm_global_position, 0.0, 0.0),
)
BY_ID = {LAYOUTS[stream.name].message_id: stream for stream in STREAMS}
"""Message id -> stream."""

_ABSENT = """
    ACTUATOR_OUTPUT_STATUS ADSB_VEHICLE ATT_POS_MOCAP AUTOPILOT_STATE_FOR_GIMBAL_DEVICE CAMERA_IMAGE_CAPTURED
    CAMERA_TRIGGER COLLISION DEBUG DEBUG_FLOAT_ARRAY DEBUG_VECT DISTANCE_SENSOR EFI_STATUS FLIGHT_INFORMATION
    GENERATOR_STATUS GIMBAL_DEVICE_ATTITUDE_STATUS GIMBAL_DEVICE_SET_ATTITUDE GIMBAL_MANAGER_STATUS GPS2_RAW
    GPS_RTCM_DATA GPS_STATUS HIGH_LATENCY2 HIL_ACTUATOR_CONTROLS HIL_STATE_QUATERNION MANUAL_CONTROL MOUNT_ORIENTATION
    NAMED_VALUE_FLOAT NAV_CONTROLLER_OUTPUT OPEN_DRONE_ID_BASIC_ID OPEN_DRONE_ID_LOCATION OPEN_DRONE_ID_SYSTEM
    OPTICAL_FLOW_RAD ORBIT_EXECUTION_STATUS RAW_RPM RC_CHANNELS SCALED_IMU SCALED_IMU2 SCALED_IMU3 SCALED_PRESSURE2
    SCALED_PRESSURE3 SMART_BATTERY_INFO STORAGE_INFORMATION WIND_COV
"""
WITHOUT_DATA = frozenset(LAYOUTS[name].message_id for name in _ABSENT.split())
"""Messages that a PX4 streams when told to, and that nothing here makes: the order is taken, and nothing comes."""


@dataclass(slots=True)
class _Schedule:
    layout: Layout
    build: Build
    interval_s: float = math.inf


class Streams:
    """The messages of one link, each when its time has come.

    Args:
        link: the link.
        outbox: where they go.
        tick_s: how often `tick` is called; nothing is sent more often.
    """

    def __init__(self, link: Link, outbox: Outbox, tick_s: float) -> None:
        self._link = link
        self._send = outbox.sender_of_values(link)
        self._tick_s = tick_s
        self._schedules = {stream.name: _Schedule(LAYOUTS[stream.name], stream.build) for stream in STREAMS}
        self._due: list[tuple[float, str]] = []
        """When each stream that is on is due, as a heap."""
        for phase, stream in enumerate(STREAMS):
            self._set(stream.name, self._default_s(stream), phase * tick_s)

    def tick(self, moment: Moment) -> None:
        """Send what is due."""
        limit_s = moment.now_s + 0.5 * self._tick_s
        while self._due and self._due[0][0] <= limit_s:
            due_s, name = self._due[0]
            schedule = self._schedules[name]
            next_s = due_s + schedule.interval_s
            if next_s <= limit_s:
                next_s = moment.now_s + schedule.interval_s
            heapq.heapreplace(self._due, (next_s, name))
            values = schedule.build(moment)
            if values is not None:
                self._send(schedule.layout, values)

    def send_now(self, name: str, moment: Moment) -> None:
        """Send one message out of turn."""
        schedule = self._schedules[name]
        values = schedule.build(moment)
        if values is not None:
            self._send(schedule.layout, values)

    def set_interval(self, message_id: int, interval_us: float, now_s: float) -> bool:
        """SET_MESSAGE_INTERVAL: -1 is off, 0 the default; False for a message that a PX4 cannot stream."""
        stream = BY_ID.get(message_id)
        if stream is None:
            return message_id in WITHOUT_DATA
        interval_s = self._default_s(stream) if interval_us == 0.0 else interval_us * 1e-6
        self._set(stream.name, interval_s, now_s)
        return True

    def interval_us(self, message_id: int) -> int:
        """MESSAGE_INTERVAL's field: -1 for what is off, 0 for what cannot be streamed."""
        stream = BY_ID.get(message_id)
        if stream is None:
            return 0
        interval_s = self._schedules[stream.name].interval_s
        return -1 if math.isinf(interval_s) else round(interval_s * 1e6)

    def _default_s(self, stream: Stream) -> float:
        rate_hz = stream.ground_hz if self._link is Link.GROUND else stream.onboard_hz
        return 1.0 / rate_hz if rate_hz > 0.0 else math.inf

    def _set(self, name: str, interval_s: float, first_s: float) -> None:
        interval_s = max(interval_s, self._tick_s) if interval_s > 0.0 else math.inf
        self._schedules[name].interval_s = interval_s
        self._due = [entry for entry in self._due if entry[1] != name]
        if math.isfinite(interval_s):
            self._due.append((first_s, name))
        heapq.heapify(self._due)
