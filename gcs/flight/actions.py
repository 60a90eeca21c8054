"""The commands of a flight, built so that a repeated copy changes nothing."""

from gcs.dialect import Mode, mavlink
from gcs.microservices.command_client import NAN, Command, PlaceCommand
from missions.frames import GeodeticPoint

CUSTOM_MODE_ENABLED = 1.0
FORCE = 21196.0
"""Disarm whatever the vehicle does: in flight it falls."""
GROUND_SPEED, SAME_THROTTLE = 1.0, -1.0
SAME_SPEED = -1.0
CURRENT_ITEM = -1.0


def arm() -> Command:
    return Command("arm", mavlink.MAV_CMD_COMPONENT_ARM_DISARM, (1.0,))


def check_readiness() -> Command:
    """Have the autopilot say once more what keeps it from arming: we may not have heard it when it changed."""
    return Command("check readiness", mavlink.MAV_CMD_RUN_PREARM_CHECKS)


def disarm() -> Command:
    """Refused by the autopilot while it flies."""
    return Command("disarm", mavlink.MAV_CMD_COMPONENT_ARM_DISARM, (0.0,))


def kill() -> Command:
    """Stop the motors at once."""
    return Command("kill", mavlink.MAV_CMD_COMPONENT_ARM_DISARM, (0.0, FORCE))


def go_to(place: GeodeticPoint) -> Command:
    """Fly straight to a place, its altitude AMSL, and hold there."""
    params = (SAME_SPEED, float(mavlink.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE), 0.0, NAN)
    return PlaceCommand("go to", mavlink.MAV_CMD_DO_REPOSITION, params, place)


def change_speed(speed_m_s: float) -> Command:
    """Ground speed of the autopilot's own flight from now on."""
    params = (GROUND_SPEED, speed_m_s, SAME_THROTTLE)
    return Command(f"speed {speed_m_s:g} m/s", mavlink.MAV_CMD_DO_CHANGE_SPEED, params)


def take_off(altitude_amsl_m: float) -> Command:
    """Climb from where it stands to an altitude AMSL, and hold there."""
    return Command("take off", mavlink.MAV_CMD_NAV_TAKEOFF, (NAN, NAN, NAN, NAN, NAN, NAN, altitude_amsl_m))


def set_mode(mode: Mode) -> Command:
    """One of PX4's modes; hold, return and land are commanded so."""
    params = (CUSTOM_MODE_ENABLED, float(mode.main), float(mode.sub))
    return Command(mode.name.lower(), mavlink.MAV_CMD_DO_SET_MODE, params)


def start_mission() -> Command:
    """To a companion: take control and fly; to an autopilot: fly the stored mission from its current item on.

    With a first item named, each late copy of the command would turn a vehicle back that has passed it.
    """
    return Command("start the mission", mavlink.MAV_CMD_MISSION_START, (CURRENT_ITEM,))


def set_message_interval(message_id: int, rate_hz: float) -> Command:
    params = (float(message_id), 1e6 / rate_hz)
    return Command("set a message interval", mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, params)
