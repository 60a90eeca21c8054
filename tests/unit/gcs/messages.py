"""MAVLink messages as they arrive at the ground station, for tests."""

from typing import Any

from gcs.dialect import AUTOPILOT, COMPANION, Mode, mavlink
from gcs.link.codec import Codec
from missions import tunnel
from missions.tunnel import CompanionState, CompanionStatus, Reason

ARMED = mavlink.MAV_MODE_FLAG_SAFETY_ARMED


def sent_by(sysid: int, component: int, message: Any, seq: int = 0) -> Any:
    """`message` as it is parsed when `sysid`/`component` has sent it."""
    (received,) = Codec().parse(frame_of(sysid, component, message, seq))
    return received


def frame_of(sysid: int, component: int, message: Any, seq: int = 0) -> bytes:
    sender = mavlink.MAVLink(None, sysid, component)
    sender.seq = seq
    return bytes(message.pack(sender))


def from_autopilot(message: Any, sysid: int = 1) -> Any:
    return sent_by(sysid, AUTOPILOT, message)


def heartbeat(mode: Mode = Mode.HOLD, *, armed: bool = False, sysid: int = 1, status: int = 3) -> Any:
    message = mavlink.MAVLink_heartbeat_message(2, 12, ARMED * armed | 1, int(mode), status, 3)
    return from_autopilot(message, sysid)


def companion_heartbeat(sysid: int = 1) -> Any:
    return sent_by(sysid, COMPANION, mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3))


def position(latitude_deg: float, longitude_deg: float, altitude_m: float, *, time_s: float = 0.0) -> Any:
    place = (round(latitude_deg * 1e7), round(longitude_deg * 1e7), round(altitude_m * 1e3))
    return from_autopilot(mavlink.MAVLink_global_position_int_message(round(time_s * 1e3), *place, 0, 100, -200, 50, 0))


def landed(state: int) -> Any:
    return from_autopilot(mavlink.MAVLink_extended_sys_state_message(0, state))


def system_status(*, ready: bool = True, battery_percent: int = 90) -> Any:
    health = 0x10000000 if ready else 0
    fields = (0, 0, health, 180, 16000, -1, battery_percent, 0, 0, 0, 0, 0, 0)
    return from_autopilot(mavlink.MAVLink_sys_status_message(*fields))


def home(latitude_deg: float, longitude_deg: float, altitude_m: float) -> Any:
    place = (round(latitude_deg * 1e7), round(longitude_deg * 1e7), round(altitude_m * 1e3))
    return from_autopilot(mavlink.MAVLink_home_position_message(*place, 0, 0, 0, [1.0, 0.0, 0.0, 0.0], 0, 0, 0))


def status_text(text: str, severity: int = 6) -> Any:
    return from_autopilot(mavlink.MAVLink_statustext_message(severity, text.encode()))


def companion_status(state: CompanionState, reason: Reason = Reason.NONE, **fields: Any) -> Any:
    payload = tunnel.encode_status(CompanionStatus(state=state, reason=reason, **fields))
    return tunnel_message(tunnel.PayloadType.COMPANION_STATUS, payload)


def tunnel_message(payload_type: int, payload: bytes, sysid: int = 1) -> Any:
    padded = list(payload) + [0] * (128 - len(payload))
    return sent_by(sysid, COMPANION, mavlink.MAVLink_tunnel_message(0, 0, payload_type, len(payload), padded))


def command_ack(command: int, result: int, *, sysid: int = 1, component: int = AUTOPILOT) -> Any:
    return sent_by(sysid, component, mavlink.MAVLink_command_ack_message(command, result))
