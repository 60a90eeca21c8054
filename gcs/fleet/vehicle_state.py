"""One vehicle as the ground station knows it: each message that arrives is folded into this state."""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import IntEnum
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from gcs.dialect import AUTOPILOT, COMPANION, Message, Mode, mavlink
from gcs.fleet.status_texts import StatusText, StatusTexts
from missions import tunnel
from missions.errors import WireFormatError
from missions.frames import GeodeticPoint, LocalFrame
from missions.trajectory import Trajectory

Array = npt.NDArray[np.float64]

PREARM_BIT = 0x10000000
"""MAV_SYS_STATUS_PREARM_CHECK in SYS_STATUS.onboard_control_sensors_health."""

LINK_TIMEOUT_S = 3.0
"""A vehicle unheard for so long is shown as lost."""

LINK_GAP_S = 0.5
"""A pause in a vehicle's telemetry longer than this is a gap in the link: nothing said in it was to be heard."""

TEXTS_KEPT = 50


class LandedState(IntEnum):
    """EXTENDED_SYS_STATE.landed_state."""

    UNDEFINED = 0
    ON_GROUND = 1
    IN_AIR = 2
    TAKEOFF = 3
    LANDING = 4

    @classmethod
    def _missing_(cls, value: object) -> "LandedState":
        return cls.UNDEFINED


@dataclass
class CompanionView:
    """What is known of a vehicle's companion."""

    heard_s: float = -math.inf
    """Last message of any kind."""
    status: tunnel.CompanionStatus | None = None
    status_s: float = -math.inf
    """When that came."""
    observations_heard: int = 0
    """Messages about what it has seen."""
    trajectory: Trajectory | None = None
    """The trajectory that it flies; its `start_s` is UTC [s]."""
    trajectory_revision: int = -1


@dataclass
class VehicleState:
    """Everything that one vehicle has told; times are on the ground station's monotonic clock [s]."""

    sysid: int
    heard_s: float = -math.inf
    """Last heartbeat of the autopilot."""
    telemetry_s: float = -math.inf
    """Last message of any kind from the autopilot."""
    link_since_s: float = -math.inf
    """Since when telemetry has been coming in without a gap."""
    armed: bool = False
    mode: Mode = Mode.UNKNOWN
    failsafe: bool = False
    landed: LandedState = LandedState.UNDEFINED
    ready_to_arm: bool = False
    status_s: float = -math.inf
    """Last SYS_STATUS: before it, nobody knows whether it is ready."""
    place: GeodeticPoint | None = None
    place_s: float = -math.inf
    velocity_enu_m_s: Array = field(default_factory=lambda: np.zeros(3))
    attitude_wxyz: Array = field(default_factory=lambda: np.array([1.0, 0.0, 0.0, 0.0]))
    """Rotation from the body (FRD) to NED."""
    home: GeodeticPoint | None = None
    battery_percent: float = math.nan
    boot_time_s: float = math.nan
    """The vehicle's own clock, as of `boot_heard_s`."""
    boot_heard_s: float = -math.inf
    mission_seq: int = 0
    mission_id: int = 0
    speech: StatusTexts = field(default_factory=StatusTexts)
    texts: deque[StatusText] = field(default_factory=lambda: deque(maxlen=TEXTS_KEPT))
    companion: CompanionView = field(default_factory=CompanionView)
    undecodable: int = 0

    def fold(self, message: Message, now_s: float) -> None:
        """Take in one message from this system; what is not understood, or not finite, changes nothing."""
        if message.get_srcComponent() == COMPANION:
            self._fold_companion(message, now_s)
        elif message.get_srcComponent() == AUTOPILOT:
            if now_s - self.telemetry_s > LINK_GAP_S:
                self.link_since_s = now_s
            self.telemetry_s = now_s
            handler = self._HANDLERS.get(message.get_type())
            if handler is not None:
                handler(self, message, now_s)

    def online(self, now_s: float) -> bool:
        return now_s - self.heard_s < LINK_TIMEOUT_S

    def companion_online(self, now_s: float) -> bool:
        return now_s - self.companion.heard_s < LINK_TIMEOUT_S

    def companion_silence_s(self, now_s: float) -> float:
        """For how long the companion has said nothing although the link carried; 0 while the link itself is down."""
        if now_s - self.telemetry_s > LINK_GAP_S:
            return 0.0
        return now_s - max(self.companion.heard_s, self.link_since_s)

    def vehicle_time_s(self, now_s: float, speed: float) -> float:
        """The vehicle's clock now: as it last said, and gone on since at `speed` times the wall clock."""
        return self.boot_time_s + (now_s - self.boot_heard_s) * speed

    def position_m(self, frame: LocalFrame, ground_offset_m: float = 0.0) -> Array | None:
        """(3,) ENU position [m], or None before the first GLOBAL_POSITION_INT."""
        if self.place is None:
            return None
        place = self.place
        return frame.enu(place.latitude_deg, place.longitude_deg, place.altitude_amsl_m - ground_offset_m)

    @property
    def airborne(self) -> bool:
        return self.armed and self.landed not in {LandedState.ON_GROUND, LandedState.UNDEFINED}

    def _fold_companion(self, message: Message, now_s: float) -> None:
        self.companion.heard_s = now_s
        if message.get_type() == "TUNNEL":
            try:
                self._fold_tunnel(message, now_s)
            except WireFormatError:
                self.undecodable += 1

    def _fold_tunnel(self, message: Message, now_s: float) -> None:
        payload = bytes(message.payload[: message.payload_length])
        match message.payload_type:
            case tunnel.PayloadType.COMPANION_STATUS:
                self.companion.status, self.companion.status_s = tunnel.decode_status(payload), now_s
            case tunnel.PayloadType.OCCUPANCY:
                self.companion.observations_heard += 1
            case tunnel.PayloadType.TRAJECTORY:
                received = tunnel.decode_trajectory(payload)
                self.companion.trajectory = received.trajectory
                self.companion.trajectory_revision = received.revision
            case _:
                pass

    def _heartbeat(self, message: Message, now_s: float) -> None:
        self.heard_s = now_s
        self.texts.extend(self.speech.overdue(now_s))
        self.armed = bool(message.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
        self.mode = Mode(message.custom_mode)
        self.failsafe = message.system_status == mavlink.MAV_STATE_CRITICAL

    def _extended_state(self, message: Message, now_s: float) -> None:
        self.landed = LandedState(message.landed_state)

    def _sys_status(self, message: Message, now_s: float) -> None:
        self.status_s = now_s
        self.ready_to_arm = bool(message.onboard_control_sensors_health & PREARM_BIT)
        if 0 <= message.battery_remaining <= 100:
            self.battery_percent = float(message.battery_remaining)

    def _global_position(self, message: Message, now_s: float) -> None:
        place = _place(message.lat, message.lon, message.alt)
        if place is None:
            return
        self.place, self.place_s = place, now_s
        self.velocity_enu_m_s = np.array([message.vy, message.vx, -message.vz]) / 100.0
        self._clock(message, now_s)

    def _attitude_quaternion(self, message: Message, now_s: float) -> None:
        attitude = np.array([message.q1, message.q2, message.q3, message.q4])
        if np.all(np.isfinite(attitude)) and np.linalg.norm(attitude) > 0.5:
            self.attitude_wxyz = attitude

    def _attitude(self, message: Message, now_s: float) -> None:
        angles = np.array([message.roll, message.pitch, message.yaw])
        if np.all(np.isfinite(angles)):
            self.attitude_wxyz = _quaternion_from_euler(*angles)

    def _home(self, message: Message, now_s: float) -> None:
        self.home = _place(message.latitude, message.longitude, message.altitude)

    def _mission_current(self, message: Message, now_s: float) -> None:
        self.mission_seq, self.mission_id = message.seq, message.mission_id

    def _status_text(self, message: Message, now_s: float) -> None:
        self.texts.extend(self.speech.receive(message, now_s))

    def _clock(self, message: Message, now_s: float) -> None:
        self.boot_time_s, self.boot_heard_s = message.time_boot_ms / 1000.0, now_s

    _HANDLERS: ClassVar[dict[str, Callable[["VehicleState", Message, float], None]]] = {
        "HEARTBEAT": _heartbeat,
        "EXTENDED_SYS_STATE": _extended_state,
        "SYS_STATUS": _sys_status,
        "GLOBAL_POSITION_INT": _global_position,
        "ATTITUDE_QUATERNION": _attitude_quaternion,
        "ATTITUDE": _attitude,
        "HOME_POSITION": _home,
        "MISSION_CURRENT": _mission_current,
        "STATUSTEXT": _status_text,
    }


def _place(latitude_e7: int, longitude_e7: int, altitude_mm: int) -> GeodeticPoint | None:
    """A place from MAVLink's integers, or None where it is none (0/0 is what an autopilot without a fix sends)."""
    if (latitude_e7, longitude_e7) == (0, 0) or abs(latitude_e7) > 85e7 or abs(longitude_e7) > 180e7:
        return None
    return GeodeticPoint(
        latitude_deg=latitude_e7 / 1e7, longitude_deg=longitude_e7 / 1e7, altitude_amsl_m=altitude_mm / 1e3
    )


def _quaternion_from_euler(roll: float, pitch: float, yaw: float) -> Array:
    cr, sr, cp, sp = math.cos(roll / 2), math.sin(roll / 2), math.cos(pitch / 2), math.sin(pitch / 2)
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    return np.array(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ]
    )
