"""Frames as vehicles, and attackers, send them."""

from gcs.dialect import mavlink
from gcs.security.signing import EPOCH_UNIX_US, TICKS_PER_S

KEY, OTHER_KEY = bytes(range(1, 33)), bytes(range(33, 65))
NOW_UNIX_US = EPOCH_UNIX_US + 1_000_000 * 350_000_000
NOW = 350_000_000 * TICKS_PER_S
"""The same moment as a timestamp of signing."""


def heartbeat() -> mavlink.MAVLink_heartbeat_message:
    return mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_AUTOPILOT_PX4, 0, 0, 4, 3)


def frame(
    key: bytes | None = KEY,
    timestamp: int = NOW,
    *,
    system: int = 1,
    component: int = 1,
    link: int = 0,
    v1: bool = False,
) -> bytes:
    """A heartbeat, signed where there is a key."""
    sender = mavlink.MAVLink(None, system, component)
    sender.signing.secret_key, sender.signing.sign_outgoing = key, key is not None
    sender.signing.timestamp, sender.signing.link_id = timestamp, link
    return bytes(heartbeat().pack(sender, force_mavlink1=v1))


def damaged(signed: bytes) -> bytes:
    """A frame whose signature is not that of its content."""
    return signed[:-1] + bytes([signed[-1] ^ 1])
