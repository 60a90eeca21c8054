"""COMMAND_LONG, COMMAND_INT and SET_MODE: every command that this autopilot knows, answered as PX4 answers it."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.modes import Mode, mode_of
from sitl.autopilot.places import LocalPoint, is_place
from sitl.autopilot.reports import Result, Say, Severity
from sitl.dialect import Message, mavlink
from sitl.microservices.outbox import Link, Outbox, Sender
from sitl.microservices.streams import BY_ID, Streams
from sitl.microservices.telemetry import Moment

FORCE = 21196
"""ARM_DISARM's magic number: whatever the checks say."""
REPEATED_WITHIN_S = 5.0
"""Wall clock: a copy of a command with confirmation > 0 that comes this soon after the last copy is the same order."""

_KNOWN_MAIN_MODES = range(1, 8)
_AUTO = 4


@dataclass(frozen=True)
class Command:
    """A command, whichever message it came in."""

    number: int
    params: tuple[float, float, float, float, float, float, float]
    """Of COMMAND_INT too: 5 and 6 are degrees where they are a place."""

    @property
    def place(self) -> tuple[float, float]:
        """Latitude and longitude [deg]; NaN for none."""
        return self.params[4], self.params[5]


@dataclass
class _Last:
    command: Command
    result: Result | None
    time_s: float


Handler = Callable[["CommandServer", Command, Sender], Result | None]
"""Executes a command; None is answered with silence."""


class CommandServer:
    """Executes commands and acknowledges them.

    Args:
        autopilot: who executes.
        outbox: where answers go.
        streams: of each link, for message requests.
        moment: what messages are made of, now.
        say: where complaints go.
        speed: simulated seconds per wall-clock second.
    """

    def __init__(
        self,
        autopilot: Autopilot,
        outbox: Outbox,
        streams: dict[Link, Streams],
        moment: Callable[[], Moment],
        say: Say,
        speed: float,
    ) -> None:
        self.autopilot = autopilot
        self.outbox = outbox
        self.streams = streams
        self.moment = moment
        self.say = say
        self._repeated_within_s = REPEATED_WITHIN_S * speed
        self._last: dict[tuple[Sender, int], _Last] = {}

    def receive_long(self, message: Message, sender: Sender, now_s: float) -> None:
        m = message
        params = (m.param1, m.param2, m.param3, m.param4, m.param5, m.param6, m.param7)
        self._receive(Command(m.command, params), m.confirmation, sender, now_s)

    def receive_int(self, message: Message, sender: Sender, now_s: float) -> None:
        m = message
        x = math.nan if m.x == 2**31 - 1 else m.x * 1e-7
        y = math.nan if m.y == 2**31 - 1 else m.y * 1e-7
        self._receive(Command(m.command, (m.param1, m.param2, m.param3, m.param4, x, y, m.z)), 0, sender, now_s)

    def receive_set_mode(self, message: Message, sender: Sender, now_s: float) -> None:
        """SET_MODE, the old message: answered as if it were DO_SET_MODE."""
        main, sub = message.custom_mode >> 16 & 0xFF, message.custom_mode >> 24 & 0xFF
        params = (float(message.base_mode), float(main), float(sub), 0.0, 0.0, 0.0, 0.0)
        self._receive(Command(mavlink.MAV_CMD_DO_SET_MODE, params), 0, sender, now_s)

    def acknowledge(self, number: int, result: int, sender: Sender) -> None:
        ack = mavlink.MAVLink_command_ack_message(number, result, 0, 0, sender.sysid, sender.compid)
        self.outbox.send(sender.link, ack)

    def _receive(self, command: Command, confirmation: int, sender: Sender, now_s: float) -> None:
        key = (sender, command.number)
        last = self._last.get(key)
        fresh = last is not None and now_s - last.time_s <= self._repeated_within_s
        if last is not None and fresh and confirmation > 0 and _is_same(last.command, command):
            result, last.time_s = last.result, now_s
        else:
            result = self._execute(command, sender)
            self._last[key] = _Last(command, result, now_s)
        if result is not None:
            self.acknowledge(command.number, result, sender)

    def _execute(self, command: Command, sender: Sender) -> Result | None:
        if any(math.isinf(param) for param in command.params):
            return Result.DENIED
        handler = HANDLERS.get(command.number)
        return handler(self, command, sender) if handler is not None else Result.UNSUPPORTED


def _is_same(one: Command, other: Command) -> bool:
    """Equal, where NaN equals NaN."""
    pairs = zip(one.params, other.params, strict=True)
    return one.number == other.number and all(a == b or (a != a and b != b) for a, b in pairs)


# -------------------------------------------------------------- arming, modes
def _arm(server: CommandServer, command: Command, sender: Sender) -> Result | None:
    wanted, force = command.params[0], command.params[1] == FORCE
    if math.isnan(wanted) or int(wanted + 0.5) not in (0, 1):
        server.say(Severity.CRITICAL, f"Unsupported ARM_DISARM param: {wanted:.3f}")
        return None
    return server.autopilot.arm(forced=force) if int(wanted + 0.5) else server.autopilot.disarm(forced=force)


def _set_mode(server: CommandServer, command: Command, sender: Sender) -> Result:
    base, main, sub = (_number(param) for param in command.params[:3])
    if not base & mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED or main not in _KNOWN_MAIN_MODES:
        return Result.ACCEPTED  # as PX4: taken, without effect
    mode = mode_of(main, sub)
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
    """Only with the bit that switches to Hold; the altitude is AMSL whatever the frame."""
    if _number(command.params[1]) != 1:
        return Result.UNSUPPORTED
    autopilot = server.autopilot
    frame, (latitude_deg, longitude_deg) = autopilot.craft.frame, command.place
    z_m = frame.origin.altitude_m - command.params[6]
    target = LocalPoint(math.nan, math.nan, z_m)
    if is_place(latitude_deg, longitude_deg):
        target = frame.local(latitude_deg, longitude_deg, command.params[6])
    elif not (math.isnan(latitude_deg) and math.isnan(longitude_deg)):
        return Result.DENIED
    result = autopilot.request_mode(Mode.HOLD)
    if result is not Result.ACCEPTED:
        return result
    if command.params[0] > 0.0:
        autopilot.craft.change_speed(command.params[0])
    yaw_rad = command.params[3]
    autopilot.navigator.reposition(target, yaw_rad, autopilot.snapshot, autopilot.now_s)
    return Result.ACCEPTED


def _change_speed(server: CommandServer, command: Command, sender: Sender) -> Result:
    server.autopilot.craft.change_speed(command.params[1])
    return Result.ACCEPTED


def _set_home(server: CommandServer, command: Command, sender: Sender) -> Result:
    autopilot = server.autopilot
    if command.params[0] > 0.5:
        autopilot.set_home()
        return Result.ACCEPTED
    latitude_deg, longitude_deg = command.place
    if not is_place(latitude_deg, longitude_deg) or not math.isfinite(command.params[6]):
        return Result.DENIED
    autopilot.set_home(autopilot.craft.frame.local(latitude_deg, longitude_deg, command.params[6]))
    return Result.ACCEPTED


def _check(server: CommandServer, command: Command, sender: Sender) -> Result:
    server.autopilot.refresh()
    return Result.ACCEPTED


def _reboot(server: CommandServer, command: Command, sender: Sender) -> Result:
    """There is nothing to reboot; 0 asks for nothing."""
    if server.autopilot.armed:
        return Result.DENIED
    return Result.ACCEPTED if command.params[0] == 0.0 else Result.UNSUPPORTED


def _silence(server: CommandServer, command: Command, sender: Sender) -> None:
    """Commands for equipment that is not there: PX4 leaves the answer to that equipment."""


# ------------------------------------------------------------------ messages
def _request_message(server: CommandServer, command: Command, sender: Sender) -> Result:
    number = _number(command.params[0])
    if number == mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES:
        _send_available_modes(server, _number(command.params[1]), sender)
        return Result.ACCEPTED
    stream = BY_ID.get(number)
    if stream is None:
        return Result.DENIED
    server.streams[sender.link].send_now(stream.name, server.moment())
    return Result.ACCEPTED


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
            properties = 0 if mode.value.flies else mavlink.MAV_MODE_PROPERTY_NOT_USER_SELECTABLE
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
    _m.MAV_CMD_RUN_PREARM_CHECKS: _check,
    _m.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: _reboot,
    _m.MAV_CMD_REQUEST_MESSAGE: _request_message,
    _m.MAV_CMD_SET_MESSAGE_INTERVAL: _set_interval,
    _m.MAV_CMD_GET_MESSAGE_INTERVAL: _get_interval,
    _m.MAV_CMD_GET_HOME_POSITION: _request_named("HOME_POSITION"),
    _m.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: _request_named("AUTOPILOT_VERSION"),
    _m.MAV_CMD_DO_VTOL_TRANSITION: _silence,
    _m.MAV_CMD_DO_GRIPPER: _silence,
    _m.MAV_CMD_INJECT_FAILURE: _silence,
    _m.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW: _silence,
}
