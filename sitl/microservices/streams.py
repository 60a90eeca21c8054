"""Which messages a link gets by itself, and how often: PX4's set at lower rates, changed by SET_MESSAGE_INTERVAL."""

import heapq
import math
from dataclasses import dataclass
from typing import NamedTuple

from sitl.microservices import telemetry, telemetry_on_demand
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
    Stream("DISTANCE_SENSOR", telemetry_on_demand.distance_sensor, 0.5, 2.0),
    Stream("ORBIT_EXECUTION_STATUS", telemetry_on_demand.orbit_execution_status, 1.0, 1.0),
    Stream("SCALED_IMU", telemetry_on_demand.scaled_imu, 0.0, 0.0),
    Stream("ACTUATOR_OUTPUT_STATUS", telemetry_on_demand.actuator_output_status, 0.0, 0.0),
    Stream("FLIGHT_INFORMATION", telemetry_on_demand.flight_information, 0.0, 0.0),
    Stream("HIL_STATE_QUATERNION", telemetry_on_demand.hil_state_quaternion, 0.0, 0.0),
    Stream("PROTOCOL_VERSION", telemetry_on_demand.protocol_version, 0.0, 0.0),
    Stream("COMPONENT_INFORMATION", telemetry_on_demand.component_information, 0.0, 0.0),
    Stream("COMPONENT_METADATA", telemetry_on_demand.component_metadata, 0.0, 0.0),
)
_OWN_LAYOUTS = {
    layout.name: layout
    for layout in (
        telemetry_on_demand.PROTOCOL_VERSION,
        telemetry_on_demand.COMPONENT_INFORMATION,
        telemetry_on_demand.COMPONENT_METADATA,
    )
}
LAYOUT_OF = {stream.name: _OWN_LAYOUTS.get(stream.name) or LAYOUTS[stream.name] for stream in STREAMS}
"""Message name -> layout, for all streams."""
BY_ID = {LAYOUT_OF[stream.name].message_id: stream for stream in STREAMS}
"""Message id -> stream."""
KEEP_THEIR_RATE = {"HEARTBEAT", "PROTOCOL_VERSION", "COMPONENT_INFORMATION", "COMPONENT_METADATA"}
"""Streams whose rate nobody can order; the last three come once, when they are asked for."""

_ABSENT = """
    ADSB_VEHICLE AUTOPILOT_STATE_FOR_GIMBAL_DEVICE AVAILABLE_MODES CAMERA_IMAGE_CAPTURED CAMERA_TRIGGER COMMAND_LONG
    DEBUG DEBUG_FLOAT_ARRAY DEBUG_VECT EFI_STATUS GIMBAL_DEVICE_ATTITUDE_STATUS GIMBAL_DEVICE_INFORMATION
    GIMBAL_DEVICE_SET_ATTITUDE GIMBAL_MANAGER_INFORMATION GIMBAL_MANAGER_STATUS GPS2_RAW GPS_RTCM_DATA GPS_STATUS
    HIGH_LATENCY2 HIL_ACTUATOR_CONTROLS HYGROMETER_SENSOR LANDING_TARGET MAG_CAL_REPORT MANUAL_CONTROL
    MOUNT_ORIENTATION NAMED_VALUE_FLOAT NAV_CONTROLLER_OUTPUT OPEN_DRONE_ID_ARM_STATUS OPEN_DRONE_ID_BASIC_ID
    OPEN_DRONE_ID_LOCATION OPEN_DRONE_ID_SYSTEM OPTICAL_FLOW_RAD RAW_RPM RC_CHANNELS SCALED_IMU2 SCALED_IMU3
    SCALED_PRESSURE2 SCALED_PRESSURE3 STATUSTEXT STORAGE_INFORMATION TRAJECTORY_REPRESENTATION_WAYPOINTS WIND_COV
"""
_LINK_NODE_STATUS, _TIME_ESTIMATE_TO_TARGET = 8, 380
WITHOUT_DATA = frozenset(LAYOUTS[name].message_id for name in _ABSENT.split()) | {
    _LINK_NODE_STATUS,
    _TIME_ESTIMATE_TO_TARGET,
}
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
        self._schedules = {stream.name: _Schedule(LAYOUT_OF[stream.name], stream.build) for stream in STREAMS}
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

    def send_now(self, name: str, moment: Moment) -> bool:
        """Send one message out of turn; returns whether there was anything to say."""
        schedule = self._schedules[name]
        values = schedule.build(moment)
        if values is not None:
            self._send(schedule.layout, values)
        return values is not None

    def set_interval(self, message_id: int, interval_us: float, now_s: float) -> bool:
        """SET_MESSAGE_INTERVAL: -1 is off, 0 the default; False for a message that a PX4 cannot stream."""
        stream = BY_ID.get(message_id)
        if stream is None or stream.name in KEEP_THEIR_RATE:
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
