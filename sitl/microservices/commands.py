"""Every command that this autopilot knows, executed and answered as PX4 does it."""

import math
from typing import Any

from sitl.autopilot.modes import Mode, mode_of, mode_of_flags
from sitl.autopilot.orbit import OrbitOrder
from sitl.autopilot.places import HIGHEST_M, LocalPoint, is_place
from sitl.autopilot.reports import Result, Severity
from sitl.dialect import mavlink
from sitl.microservices.command_server import Command, CommandServer, Handler
from sitl.microservices.outbox import Sender
from sitl.microservices.streams import BY_ID

FORCE = 21196
"""ARM_DISARM's magic number: whatever the checks say."""
NOT_ON_REQUEST = {mavlink.MAVLINK_MSG_ID_MISSION_CURRENT, mavlink.MAVLINK_MSG_ID_UTM_GLOBAL_POSITION}
"""Messages that a PX4 sends by itself only."""
_KNOWN_MAIN_MODES = range(1, 8)
_AUTO = 4


# -------------------------------------------------------------- arming, modes
def _arm(server: CommandServer, command: Command, sender: Sender) -> Result | None:
    wanted, force = command.params[0], command.params[1] == FORCE
    if math.isnan(wanted) or int(wanted + 0.5) not in (0, 1):
        server.say(Severity.CRITICAL, f"Unsupported ARM_DISARM param: {wanted:.3f}")
        return None
    return server.autopilot.arm(forced=force) if int(wanted + 0.5) else server.autopilot.disarm(forced=force)


def _set_mode(server: CommandServer, command: Command, sender: Sender) -> Result:
    base, main, sub = (_number(param) for param in command.params[:3])
    by_number = bool(base & mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED)
    mode = mode_of(main, sub) if by_number else mode_of_flags(base)
    if mode is None and (not by_number or main not in _KNOWN_MAIN_MODES):
        return Result.ACCEPTED  # as PX4: taken, without effect
    if mode is None:
        server.say(Severity.CRITICAL, "Unsupported auto mode" if main == _AUTO else "Unsupported mode")
        return Result.TEMPORARILY_REJECTED
    return server.autopilot.request_mode(mode)


def _set_standard_mode(server: CommandServer, command: Command, sender: Sender) -> Result:
    wanted = _number(command.params[0])
    for mode in Mode:
        if wanted != 0 and mode.value.standard_mode == wanted:
            return server.autopilot.request_mode(mode)
    return Result.FAILED


def _takeoff(server: CommandServer, command: Command, sender: Sender) -> Result:
    result = server.autopilot.request_mode(Mode.TAKEOFF)
    if result is Result.ACCEPTED:
        yaw_deg = command.params[3]
        server.autopilot.navigator.order_takeoff(command.params[6], math.radians(yaw_deg))
    return result


def _land(server: CommandServer, command: Command, sender: Sender) -> Result:
    result = server.autopilot.request_mode(Mode.LAND)
    if result is Result.ACCEPTED:
        server.say(Severity.INFO, "Landing at current position")
    return result


def _return(server: CommandServer, command: Command, sender: Sender) -> Result:
    result = server.autopilot.request_mode(Mode.RTL)
    if result is Result.ACCEPTED:
        server.say(Severity.INFO, "Returning to launch")
    return result


def _start_mission(server: CommandServer, command: Command, sender: Sender) -> Result:
    """From its first item on, whichever that is; from the current one for -1."""
    mission, first = server.autopilot.navigator.mission, command.params[0]
    commander = server.autopilot.refresh()
    if server.autopilot.mission_ready and not -1 <= first < len(mission.plan.items):
        return Result.DENIED
    result = commander.start_mission()
    if result is Result.ACCEPTED and first >= 0:
        mission.set_current(int(first))
    return result


def _terminate(server: CommandServer, command: Command, sender: Sender) -> Result:
    return server.autopilot.refresh().terminate() if command.params[0] > 0.5 else Result.DENIED


# -------------------------------------------------------------------- flight
def _reposition(server: CommandServer, command: Command, sender: Sender) -> Result:
    """The altitude is AMSL whatever the frame; without the bit that switches to Hold it counts only for who holds.

    A PX4 then calls the command unsupported, and flies to the place all the same.
    """
    autopilot = server.autopilot
    frame, (latitude_deg, longitude_deg) = autopilot.craft.frame, command.place
    z_m = frame.origin.altitude_m - command.params[6]
    target = LocalPoint(math.nan, math.nan, z_m)
    if is_place(latitude_deg, longitude_deg):
        target = frame.local(latitude_deg, longitude_deg, command.params[6])
    elif not (math.isnan(latitude_deg) and math.isnan(longitude_deg)):
        return Result.DENIED
    switches = _number(command.params[1]) & mavlink.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE
    if not switches and autopilot.mode is not Mode.HOLD:
        return Result.UNSUPPORTED
    if switches and (refused := autopilot.request_mode(Mode.HOLD)) is not Result.ACCEPTED:
        return refused
    if command.params[0] > 0.0:
        autopilot.craft.change_speed(command.params[0])
    yaw_rad = command.params[3]
    autopilot.navigator.reposition(target, yaw_rad, autopilot.snapshot, autopilot.now_s)
    return Result.ACCEPTED if switches else Result.UNSUPPORTED


def _change_speed(server: CommandServer, command: Command, sender: Sender) -> Result:
    server.autopilot.craft.change_speed(command.params[1])
    return Result.ACCEPTED


def _set_home(server: CommandServer, command: Command, sender: Sender) -> Result:
    autopilot = server.autopilot
    if command.params[0] > 0.5:
        autopilot.set_home()
        return Result.ACCEPTED
    latitude_deg, longitude_deg = command.place
    if not is_place(latitude_deg, longitude_deg) or not abs(command.params[6]) <= HIGHEST_M:  # nor is NaN
        return Result.DENIED
    autopilot.set_home(autopilot.craft.frame.local(latitude_deg, longitude_deg, command.params[6]))
    return Result.ACCEPTED


def _orbit(server: CommandServer, command: Command, sender: Sender) -> Result:
    """Circle around a place, or around where the vehicle is; NaN leaves the size of the circle to the autopilot."""
    autopilot, (latitude_deg, longitude_deg) = server.autopilot, command.place
    centre = None
    if is_place(latitude_deg, longitude_deg):
        centre = autopilot.craft.frame.local(latitude_deg, longitude_deg, 0.0)
    radius_m, speed_m_s, _, _, _, _, altitude_m = command.params
    result = autopilot.request_mode(Mode.ORBIT)
    if result is Result.ACCEPTED:
        z_m = autopilot.craft.frame.origin.altitude_m - altitude_m
        autopilot.navigator.order_orbit(OrbitOrder(centre, radius_m, speed_m_s, z_m))
    return result


def _look_at(server: CommandServer, command: Command, sender: Sender) -> Result:
    """DO_SET_ROI_LOCATION: auto modes turn the nose towards this place."""
    latitude_deg, longitude_deg = command.place
    if not is_place(latitude_deg, longitude_deg):
        return Result.DENIED
    craft = server.autopilot.craft
    craft.look_at(craft.frame.local(latitude_deg, longitude_deg, 0.0))
    return Result.ACCEPTED


def _look_ahead(server: CommandServer, command: Command, sender: Sender) -> Result:
    server.autopilot.craft.look_at(None)
    return Result.ACCEPTED


def _look(server: CommandServer, command: Command, sender: Sender) -> Result:
    """DO_SET_ROI, the old command: a place, or none; at other things no nose can be turned."""
    wanted = _number(command.params[0])
    if wanted == mavlink.MAV_ROI_LOCATION:
        return _look_at(server, command, sender)
    return _look_ahead(server, command, sender) if wanted == mavlink.MAV_ROI_NONE else Result.UNSUPPORTED


def _change_altitude(server: CommandServer, command: Command, sender: Sender) -> Result:
    """Hold, here, at another altitude; AMSL whatever the frame, as for DO_REPOSITION."""
    here = (-1.0, float(mavlink.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE), 0.0, math.nan, math.nan, math.nan)
    return _reposition(server, Command(command.number, (*here, command.params[0])), sender)


def _cancelled(server: CommandServer, command: Command, sender: Sender) -> Result:
    """DO_LAND_START: there are no landing patterns to jump to."""
    return Result.CANCELLED


def _store_parameters(server: CommandServer, command: Command, sender: Sender) -> Result:
    """0 reads and 1 writes, which happens by itself; 2 and 4 go back to the defaults, 3 to those of sensors."""
    wanted = _number(command.params[0])
    if server.autopilot.armed:
        return Result.TEMPORARILY_REJECTED
    if wanted not in range(5):
        return Result.DENIED
    if wanted in (2, 4):
        server.autopilot.parameters.reset()
    return Result.ACCEPTED


def _check(server: CommandServer, command: Command, sender: Sender) -> Result:
    server.autopilot.refresh()
    return Result.ACCEPTED


def _reboot(server: CommandServer, command: Command, sender: Sender) -> Result:
    """1 boots the autopilot anew, 0 asks for nothing; never while armed."""
    wanted = _number(command.params[0])
    if server.autopilot.armed:
        return Result.DENIED
    if wanted not in (0, 1):
        return Result.UNSUPPORTED
    server.autopilot.reboot_ordered = wanted == 1
    return Result.ACCEPTED


def _nothing_to_do(server: CommandServer, command: Command, sender: Sender) -> Result:
    """DO_SET_ACTUATOR: no output is assigned to it, here as there."""
    return Result.ACCEPTED


def _inject_failure(server: CommandServer, command: Command, sender: Sender) -> Result | None:
    """Failures are ordered over the control port; PX4 is silent about them unless SYS_FAILURE_EN allows them."""
    return Result.UNSUPPORTED if server.autopilot.parameters["SYS_FAILURE_EN"] else None


def _silence(server: CommandServer, command: Command, sender: Sender) -> None:
    """Commands for equipment that is not there: PX4 leaves the answer to that equipment."""


# ------------------------------------------------------------------ messages
def _request_message(server: CommandServer, command: Command, sender: Sender) -> Result:
    number = _number(command.params[0])
    if number == mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES:
        _send_available_modes(server, _number(command.params[1]), sender)
        return Result.ACCEPTED
    stream = BY_ID.get(number)
    if stream is None or number in NOT_ON_REQUEST:
        return Result.DENIED
    sent = server.streams[sender.link].send_now(stream.name, server.moment())
    return Result.ACCEPTED if sent else Result.DENIED


def _request_named(name: str) -> Handler:
    """An old command that asks for one message."""

    def handle(server: CommandServer, command: Command, sender: Sender) -> Result:
        server.streams[sender.link].send_now(name, server.moment())
        return Result.ACCEPTED

    return handle


def _set_interval(server: CommandServer, command: Command, sender: Sender) -> Result:
    number, interval_us = _number(command.params[0]), command.params[1]
    if math.isnan(interval_us):
        return Result.DENIED
    known = server.streams[sender.link].set_interval(number, interval_us, server.autopilot.now_s)
    return Result.ACCEPTED if known else Result.FAILED


def _get_interval(server: CommandServer, command: Command, sender: Sender) -> Result:
    number = _number(command.params[0])
    if not 0 <= number <= 0xFFFF:
        return Result.DENIED
    interval_us = server.streams[sender.link].interval_us(number)
    server.outbox.send(sender.link, mavlink.MAVLink_message_interval_message(number, interval_us))
    return Result.ACCEPTED


def _send_available_modes(server: CommandServer, index: int, sender: Sender) -> None:
    """AVAILABLE_MODES: one by its number, from 1, or all for 0."""
    modes = list(Mode)
    for number, mode in enumerate(modes, start=1):
        if index in (0, number):
            selectable = mode is not Mode.TERMINATION
            properties = 0 if selectable else mavlink.MAV_MODE_PROPERTY_NOT_USER_SELECTABLE
            message = mavlink.MAVLink_available_modes_message(
                len(modes), number, mode.value.standard_mode, mode.custom_mode, properties, mode.label.encode()
            )
            server.outbox.send(sender.link, message)


def _number(param: float) -> int:
    """A parameter that is an integer, -1 where it is none."""
    return int(param) if math.isfinite(param) and abs(param) < 2**31 else -1


_m: Any = mavlink
HANDLERS: dict[int, Handler] = {
    _m.MAV_CMD_COMPONENT_ARM_DISARM: _arm,
    _m.MAV_CMD_DO_SET_MODE: _set_mode,
    _m.MAV_CMD_DO_SET_STANDARD_MODE: _set_standard_mode,
    _m.MAV_CMD_NAV_TAKEOFF: _takeoff,
    _m.MAV_CMD_NAV_LAND: _land,
    _m.MAV_CMD_NAV_RETURN_TO_LAUNCH: _return,
    _m.MAV_CMD_MISSION_START: _start_mission,
    _m.MAV_CMD_DO_FLIGHTTERMINATION: _terminate,
    _m.MAV_CMD_DO_REPOSITION: _reposition,
    _m.MAV_CMD_DO_CHANGE_SPEED: _change_speed,
    _m.MAV_CMD_DO_SET_HOME: _set_home,
    _m.MAV_CMD_DO_ORBIT: _orbit,
    _m.MAV_CMD_DO_SET_ROI_LOCATION: _look_at,
    _m.MAV_CMD_DO_SET_ROI_NONE: _look_ahead,
    _m.MAV_CMD_DO_SET_ROI: _look,
    _m.MAV_CMD_DO_CHANGE_ALTITUDE: _change_altitude,
    _m.MAV_CMD_DO_LAND_START: _cancelled,
    _m.MAV_CMD_DO_GO_AROUND: _nothing_to_do,
    _m.MAV_CMD_PREFLIGHT_STORAGE: _store_parameters,
    _m.MAV_CMD_DO_SET_ACTUATOR: _nothing_to_do,
    _m.MAV_CMD_RUN_PREARM_CHECKS: _check,
    _m.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: _reboot,
    _m.MAV_CMD_REQUEST_MESSAGE: _request_message,
    _m.MAV_CMD_SET_MESSAGE_INTERVAL: _set_interval,
    _m.MAV_CMD_GET_MESSAGE_INTERVAL: _get_interval,
    _m.MAV_CMD_GET_HOME_POSITION: _request_named("HOME_POSITION"),
    _m.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: _request_named("AUTOPILOT_VERSION"),
    _m.MAV_CMD_REQUEST_PROTOCOL_VERSION: _request_named("PROTOCOL_VERSION"),
    _m.MAV_CMD_REQUEST_FLIGHT_INFORMATION: _request_named("FLIGHT_INFORMATION"),
    _m.MAV_CMD_DO_VTOL_TRANSITION: _silence,
    _m.MAV_CMD_DO_GRIPPER: _silence,
    _m.MAV_CMD_INJECT_FAILURE: _inject_failure,
    _m.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW: _silence,
}
