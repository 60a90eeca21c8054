"""Recordings of small made-up flights."""

import struct

import numpy as np

from gcs.dialect import Message, mavlink
from gcs.replay.recording import Recording, parse_recording
from missions import tunnel

BEGAN_US = 1_700_000_000_000_000
LATITUDE_E7, LONGITUDE_E7 = 473_977_000, 85_456_000


def record(time_s: float, message: Message, system: int = 1, component: int = 1, *, v1: bool = False) -> bytes:
    """A stamp and a frame, as they stand in a `.tlog`."""
    sender = mavlink.MAVLink(None, system, component)
    sender.seq = int(time_s * 10) % 256
    return struct.pack(">Q", BEGAN_US + round(time_s * 1e6)) + bytes(message.pack(sender, force_mavlink1=v1))


def heartbeat(armed: bool = False, mode: int = 0x04040000) -> Message:
    base = 1 | (mavlink.MAV_MODE_FLAG_SAFETY_ARMED if armed else 0)
    return mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_AUTOPILOT_PX4, base, mode, 4, 3)


def position(time_s: float, height_m: float = 10.0) -> Message:
    x, y = LATITUDE_E7 + round(100 * time_s), LONGITUDE_E7
    ms, mm = round(time_s * 1000), round(height_m * 1000)
    return mavlink.MAVLink_global_position_int_message(ms, x, y, 490_000 + mm, mm, 111, 22, -33, 0)


def text(words: str, severity: int = 6) -> Message:
    return mavlink.MAVLink_statustext_message(severity, words.encode())


def companion_status(state: tunnel.CompanionState) -> Message:
    payload = tunnel.encode_status(tunnel.CompanionStatus(state=state))
    return mavlink.MAVLink_tunnel_message(
        0, 0, tunnel.PayloadType.COMPANION_STATUS, len(payload), payload.ljust(128, b"\0")
    )


def flight(duration_s: float = 60.0, vehicles: int = 2) -> bytes:
    """Vehicles that arm at 10 s, say something every 7 s, and move all the time."""
    records = []
    for step in range(int(duration_s * 10) + 1):
        time_s = step / 10
        for system in range(1, vehicles + 1):
            if step % 10 == 0:
                records.append(record(time_s, heartbeat(armed=time_s >= 10.0), system))
                state = tunnel.CompanionState.FLYING if time_s >= 20.0 else tunnel.CompanionState.READY
                records.append(record(time_s, companion_status(state), system, 191))
            records.append(record(time_s, position(time_s, height_m=time_s), system))
            if step % 70 == 0:
                records.append(record(time_s, text(f"text at {time_s:g}"), system))
    return b"".join(records)


def parsed(data: bytes) -> Recording:
    return parse_recording(np.frombuffer(data, np.uint8))
