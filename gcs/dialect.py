"""MAVLink as the ground station speaks it: pymavlink's `development` dialect (as PX4 is built with), as codec alone."""

from enum import IntEnum
from typing import Any

from pymavlink.dialects.v20 import development as mavlink

from missions.mavlink_extensions import add_extension_fields

add_extension_fields(mavlink)

Message = Any
"""A message of the dialect; its class, and so its fields, depend on the message and are known at run time."""

GCS_SYSTEM, GCS_COMPONENT = 255, mavlink.MAV_COMP_ID_MISSIONPLANNER
"""255/190: who this ground station is."""

AUTOPILOT, COMPANION = mavlink.MAV_COMP_ID_AUTOPILOT1, mavlink.MAV_COMP_ID_ONBOARD_COMPUTER
"""Component ids 1 and 191 of every vehicle."""


class Mode(IntEnum):
    """PX4's flight modes as HEARTBEAT.custom_mode carries them: sub mode << 24 | main mode << 16."""

    MANUAL = 0x00010000
    ALTITUDE = 0x00020000
    POSITION = 0x00030000
    ACRO = 0x00050000
    OFFBOARD = 0x00060000
    STABILIZED = 0x00070000
    TERMINATION = 0x000A0000
    READY = 0x01040000
    TAKEOFF = 0x02040000
    HOLD = 0x03040000
    MISSION = 0x04040000
    RTL = 0x05040000
    LAND = 0x06040000
    FOLLOW = 0x08040000
    PRECISION_LAND = 0x09040000
    UNKNOWN = 0

    @classmethod
    def _missing_(cls, value: object) -> "Mode":
        return cls.UNKNOWN

    @property
    def main(self) -> int:
        """DO_SET_MODE's param2."""
        return self >> 16 & 0xFF

    @property
    def sub(self) -> int:
        """DO_SET_MODE's param3."""
        return self >> 24 & 0xFF


def enum_name(enum: str, value: int) -> str:
    """The MAVLink name of an enum's value, or its number where it has none."""
    entry = mavlink.enums[enum].get(value)
    return entry.name if entry else str(value)
