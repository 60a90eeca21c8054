"""MAVLink messages, as MAVSDK hands them over (names, and fields as JSON), to the pilot's events. No MAVSDK in here.

NaN arrives as null. Whatever cannot be read raises `msgspec.DecodeError` or `ValueError`; the link counts and drops it.
"""

from collections.abc import Callable

import msgspec
import numpy as np

from companion.events import (
    ArmingReported,
    Event,
    FlightMode,
    HomeReported,
    LandedReported,
    MissionReported,
    ModeReported,
    Odometry,
    OriginReported,
    ReceiptHeard,
    Sender,
    UtcReported,
)
from missions.errors import WireFormatError
from missions.frames import GeodeticPoint
from missions.tunnel import PayloadType, decode_receipt

MAV_FRAME_LOCAL_NED = 1
SAFETY_ARMED = 128
LANDED_UNDEFINED, LANDED_ON_GROUND = 0, 1
NO_MISSION = {0, 65535}

MODES = {
    (6, 0): FlightMode.OFFBOARD,
    (4, 2): FlightMode.TAKEOFF,
    (4, 3): FlightMode.HOLD,
    (4, 4): FlightMode.MISSION,
    (4, 5): FlightMode.RTL,
    (4, 6): FlightMode.LAND,
}
"""PX4's (main, sub) modes."""


class OdometryMessage(msgspec.Struct, frozen=True):
    """ODOMETRY; its reset counter tells that the estimator has jumped."""

    time_usec: int
    frame_id: int
    child_frame_id: int
    x: float
    y: float
    z: float
    vx: float
    vy: float
    vz: float
    q: tuple[float, float, float, float]
    reset_counter: int = 0

    def event(self) -> Odometry:
        """The estimate.

        Raises:
            ValueError: it is not in the frame that a PX4's estimator uses.
        """
        if (self.frame_id, self.child_frame_id) != (MAV_FRAME_LOCAL_NED, MAV_FRAME_LOCAL_NED):
            frames = f"{self.frame_id} and {self.child_frame_id}"
            raise ValueError(f"ODOMETRY: expected position and velocity in frame {MAV_FRAME_LOCAL_NED}, found {frames}")
        return Odometry(
            time_s=self.time_usec / 1e6,
            position_m=np.array([self.x, self.y, self.z]),
            velocity_m_s=np.array([self.vx, self.vy, self.vz]),
            attitude=np.array(self.q),
        )


class CommandLong(msgspec.Struct, frozen=True):
    """COMMAND_LONG."""

    command: int
    target_system: int
    target_component: int


class TunnelMessage(msgspec.Struct, frozen=True):
    """TUNNEL."""

    target_system: int
    target_component: int
    payload_type: int
    payload_length: int
    payload: tuple[int, ...]

    def receipt(self, sender: Sender) -> list[Event]:
        """What a ground station says of how it hears us; nothing if this is something else.

        Raises:
            ValueError: it cannot be read.
        """
        if self.payload_type != PayloadType.RECEIPT:
            return []
        try:
            return [ReceiptHeard(sender, decode_receipt(bytes(self.payload[: self.payload_length])))]
        except WireFormatError as unreadable:
            raise ValueError(str(unreadable)) from None


class CommandAck(msgspec.Struct, frozen=True):
    """COMMAND_ACK."""

    result: int


class _Heartbeat(msgspec.Struct, frozen=True):
    custom_mode: int
    base_mode: int


class _CurrentMode(msgspec.Struct, frozen=True):
    custom_mode: int


class _ExtendedSysState(msgspec.Struct, frozen=True):
    landed_state: int


class _SystemTime(msgspec.Struct, frozen=True):
    time_unix_usec: int
    time_boot_ms: int


class _MissionCurrent(msgspec.Struct, frozen=True):
    seq: int
    total: int = 65535
    mission_id: int = 0


class _GlobalPlace(msgspec.Struct, frozen=True):
    latitude: int
    longitude: int
    altitude: int

    def place(self) -> GeodeticPoint:
        return GeodeticPoint(
            latitude_deg=self.latitude / 1e7, longitude_deg=self.longitude / 1e7, altitude_amsl_m=self.altitude / 1e3
        )


def _heartbeat(fields: bytes) -> list[Event]:
    message = msgspec.json.decode(fields, type=_Heartbeat)
    return [ModeReported(mode_of(message.custom_mode)), ArmingReported(bool(message.base_mode & SAFETY_ARMED))]


def _current_mode(fields: bytes) -> list[Event]:
    return [ModeReported(mode_of(msgspec.json.decode(fields, type=_CurrentMode).custom_mode))]


def _extended_sys_state(fields: bytes) -> list[Event]:
    landed = msgspec.json.decode(fields, type=_ExtendedSysState).landed_state
    return [] if landed == LANDED_UNDEFINED else [LandedReported(landed == LANDED_ON_GROUND)]


def _system_time(fields: bytes) -> list[Event]:
    message = msgspec.json.decode(fields, type=_SystemTime)
    known = message.time_unix_usec > 0
    return [UtcReported(message.time_unix_usec / 1e6 - message.time_boot_ms / 1e3)] if known else []


def _mission_current(fields: bytes) -> list[Event]:
    """Autopilots that know no `mission_id` are told apart by the number of items."""
    message = msgspec.json.decode(fields, type=_MissionCurrent)
    none = message.total in NO_MISSION
    return [MissionReported(0 if none else message.mission_id or message.total, message.seq)]


def _gps_global_origin(fields: bytes) -> list[Event]:
    return [OriginReported(msgspec.json.decode(fields, type=_GlobalPlace).place())]


def _home_position(fields: bytes) -> list[Event]:
    return [HomeReported(msgspec.json.decode(fields, type=_GlobalPlace).place())]


EVENTS_OF: dict[str, Callable[[bytes], list[Event]]] = {
    "HEARTBEAT": _heartbeat,
    "CURRENT_MODE": _current_mode,
    "EXTENDED_SYS_STATE": _extended_sys_state,
    "SYSTEM_TIME": _system_time,
    "MISSION_CURRENT": _mission_current,
    "GPS_GLOBAL_ORIGIN": _gps_global_origin,
    "HOME_POSITION": _home_position,
}
"""Message -> the events that its fields (JSON) stand for."""


def mode_of(custom_mode: int) -> FlightMode:
    """PX4's custom mode: main mode in the third byte, sub mode in the fourth."""
    main, sub = custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF
    return MODES.get((main, sub if main == 4 else 0), FlightMode.OTHER)
