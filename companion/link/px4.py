"""A PX4, or the SITL, through MAVSDK: the only file that knows that library.

MAVSDK calls back from threads of its own; whatever it reports is handed over to the event loop at once. Messages are
read through its mavlink_direct plugin, since the telemetry plugin hides frames, boot times and estimator resets.
"""

import asyncio
import math
import socket
import threading
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any, TypeVar
from urllib.parse import urlsplit

import msgspec
from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.connection_result import ConnectionResult
from mavsdk.exceptions import MavsdkError
from mavsdk.logging import LogLevel, log_subscribe
from mavsdk.plugins.action import Action
from mavsdk.plugins.mavlink_direct import MavlinkDirect, MavlinkMessage
from mavsdk.plugins.mission_raw import MissionRaw
from mavsdk.plugins.offboard import AccelerationNed, Offboard, PositionNedYaw, VelocityNedYaw
from mavsdk.system import System

from companion.errors import CommandRefused, UsageError
from companion.events import (
    AutopilotFound,
    AutopilotLost,
    Event,
    FlightMode,
    RingReported,
    Sender,
    StartCommanded,
)
from companion.instructions import CommandResult
from companion.link.messages import EVENTS_OF, CommandAck, CommandLong, OdometryMessage, TunnelMessage
from companion.setpoints import Setpoint
from missions.mission_items import MissionItem
from missions.tunnel import MAX_PAYLOAD_BYTES, PayloadType, Reason

T = TypeVar("T")

COMPANION, AUTOPILOT = 191, 1
"""MAVLink component ids."""
SETUP_RETRY_S = 2.0
"""Between two rounds of asking for streams and for the origin, until the origin is known (wall clock)."""
LOOK_INTERVAL_S = 0.1
"""Between two looks at who is there (wall clock). MAVSDK would call back, too, but a subscription takes effect a little
after it was made, and a system that connects in between is never reported: a companion waited for ever."""

SET_MESSAGE_INTERVAL, REQUEST_MESSAGE, MISSION_START = 511, 512, 300
GPS_GLOBAL_ORIGIN = 49
OBSTACLE_DISTANCE = 330
RATES_HZ = {331: 30.0, 436: 10.0, 245: 5.0, 42: 5.0, 2: 1.0, 242: 1.0}
"""Of ODOMETRY, CURRENT_MODE, EXTENDED_SYS_STATE, MISSION_CURRENT (a PX4 keeps its own), SYSTEM_TIME, HOME_POSITION."""


class Px4:
    """One autopilot on one MAVSDK connection (see `companion.link.autopilot.Autopilot`).

    Args:
        sysid: of the vehicle; the companion is `sysid`/191.
        url: where it is heard, as MAVSDK writes it.
        complain: told of what MAVSDK itself finds wrong, once per text.
        ring_hz: how often OBSTACLE_DISTANCE is wanted; not at all for 0.
    """

    def __init__(self, sysid: int, url: str, complain: Callable[[str], None], ring_hz: float = 0.0) -> None:
        self._rates_hz = RATES_HZ | ({OBSTACLE_DISTANCE: ring_hz} if ring_hz > 0.0 else {})
        self._sysid = sysid
        self._url = url
        self._complain = complain
        self._events: asyncio.Queue[Event] = asyncio.Queue()
        self._mavsdk: Mavsdk | None = None
        self._system: System | None = None
        self._direct: dict[int, MavlinkDirect] = {}
        self._offboard: Offboard | None = None
        self._reset_counter = 0
        self._watch: asyncio.Task[None] | None = None
        self._setup: asyncio.Task[None] | None = None
        self._connected = self._has_origin = False
        self.dropped: Counter[str] = Counter()
        """Messages that could not be read, by name."""

    # ------------------------------------------------------------- coming and going

    async def open(self) -> None:
        """Listen on the URL; see `Autopilot.open`."""
        self._loop = asyncio.get_running_loop()
        refuse_busy_port(self._url)
        log_subscribe(self._on_log)
        configuration = Configuration.create_with_component_type(ComponentType.COMPANION_COMPUTER)
        configuration.system_id, configuration.component_id = self._sysid, COMPANION
        self._mavsdk = Mavsdk(configuration)
        result = self._mavsdk.add_any_connection(self._url)
        if result != ConnectionResult.SUCCESS:
            raise UsageError(f"--system {self._url}: {ConnectionResult(result).name.lower().replace('_', ' ')}")
        self._watch = self._loop.create_task(self._keep_looking(), name="systems")

    def close(self) -> None:
        """End everything; see `Autopilot.close`."""
        for task in (self._watch, self._setup):
            if task is not None:
                task.cancel()
        mavsdk, self._mavsdk = self._mavsdk, None
        if mavsdk is not None:
            mavsdk.destroy()

    async def receive(self) -> Event:
        """The next event; see `Autopilot.receive`."""
        return await self._events.get()

    async def _keep_looking(self) -> None:
        while self._mavsdk is not None:
            self._look_around(self._mavsdk)
            if self._system is not None and (connected := self._system.is_connected()) is not self._connected:
                self._connected = connected
                self._on_connected()
            await asyncio.sleep(LOOK_INTERVAL_S)

    def _look_around(self, mavsdk: Mavsdk) -> None:
        """Listen to whoever has turned up: our autopilot, a ground station through it, or somebody else."""
        if mavsdk.system_count() == len(self._direct):
            return
        for system in mavsdk.get_systems():
            sysid = system.get_system_id()
            if sysid in self._direct:
                continue
            direct = self._direct[sysid] = MavlinkDirect(system)
            if sysid == self._sysid:
                self._adopt(system, direct)
            else:
                direct.subscribe_message("COMMAND_LONG", lambda message, _: self._soon(self._on_command, message))
                direct.subscribe_message("TUNNEL", lambda message, _: self._soon(self._on_tunnel, message))

    def _adopt(self, system: System, direct: MavlinkDirect) -> None:
        self._system = system
        self._action, self._mission = Action(system), MissionRaw(system)
        direct.subscribe_message("ODOMETRY", lambda message, _: self._soon(self._on_odometry, message))
        if OBSTACLE_DISTANCE in self._rates_hz:
            direct.subscribe_message("OBSTACLE_DISTANCE", lambda message, _: self._soon(self._on_ring, message))
        for name in EVENTS_OF:
            direct.subscribe_message(name, lambda message, _: self._soon(self._on_message, message))

    def _on_connected(self) -> None:
        if self._setup is not None:
            self._setup.cancel()
        self._events.put_nowait(AutopilotFound() if self._connected else AutopilotLost())
        self._setup = self._loop.create_task(self._ask_for_streams(), name="streams") if self._connected else None

    async def _ask_for_streams(self) -> None:
        """Ask until the origin is known: the autopilot may still be booting."""
        self._has_origin = False
        while not self._has_origin:
            for message_id, rate_hz in self._rates_hz.items():
                await self._command(SET_MESSAGE_INTERVAL, message_id, 1e6 / rate_hz)
            await self._command(REQUEST_MESSAGE, GPS_GLOBAL_ORIGIN)
            await asyncio.sleep(SETUP_RETRY_S)

    # -------------------------------------------------------------------- messages

    def _soon(self, handler: Callable[..., None], *arguments: Any) -> None:
        """Called in MAVSDK's threads: go on in the event loop, unless that has ended, or the connection meanwhile."""
        with suppress(RuntimeError):  # the loop is closed
            self._loop.call_soon_threadsafe(self._if_open, handler, arguments)

    def _if_open(self, handler: Callable[..., None], arguments: tuple[Any, ...]) -> None:
        if self._mavsdk is not None:  # a destroyed one crashes when it is asked anything
            handler(*arguments)

    def _on_message(self, message: MavlinkMessage) -> None:
        if message.component_id == AUTOPILOT:
            for event in self._read(message, EVENTS_OF[message.message_name]):
                self._events.put_nowait(event)
            self._has_origin |= message.message_name == "GPS_GLOBAL_ORIGIN"

    def _on_odometry(self, message: MavlinkMessage) -> None:
        for odometry in self._read(message, lambda fields: [msgspec.json.decode(fields, type=OdometryMessage)]):
            if odometry.reset_counter != self._reset_counter:
                self._reset_counter = odometry.reset_counter
                self._loop.create_task(self._command(REQUEST_MESSAGE, GPS_GLOBAL_ORIGIN))
            for event in self._read(message, lambda _, odometry=odometry: [odometry.event()]):
                self._events.put_nowait(event)

    def _on_ring(self, message: MavlinkMessage) -> None:
        self._events.put_nowait(RingReported(message.fields_json.encode()))

    def _on_command(self, message: MavlinkMessage) -> None:
        for command in self._read(message, lambda fields: [msgspec.json.decode(fields, type=CommandLong)]):
            addressed = (command.target_system, command.target_component) == (self._sysid, COMPANION)
            if addressed and command.command == MISSION_START:
                self._events.put_nowait(StartCommanded(Sender(message.system_id, message.component_id)))

    def _on_tunnel(self, message: MavlinkMessage) -> None:
        sender = Sender(message.system_id, message.component_id)
        for tunnel in self._read(message, lambda fields: [msgspec.json.decode(fields, type=TunnelMessage)]):
            if (tunnel.target_system, tunnel.target_component) == (self._sysid, COMPANION):
                for event in self._read(message, lambda _, tunnel=tunnel: tunnel.receipt(sender)):
                    self._events.put_nowait(event)

    def _read(self, message: MavlinkMessage, reader: Callable[[bytes], list[T]]) -> list[T]:
        """What a message says; one that cannot be read is counted and dropped."""
        try:
            return reader(message.fields_json.encode())
        except (msgspec.DecodeError, ValueError) as unreadable:
            self.dropped[message.message_name] += 1
            if self.dropped[message.message_name] == 1:
                self._complain(f"{message.message_name} dropped: {unreadable}")
            return []

    def _on_log(self, level: LogLevel, text: str, file: str | None, line: int) -> bool:
        if level >= LogLevel.WARN:
            self._soon(self._complain, f"MAVSDK: {text}")
        return True

    # --------------------------------------------------------------------- actions

    def send_setpoint(self, setpoint: Setpoint) -> None:
        """Stream a setpoint; MAVSDK sends it now, and repeats it at 20 Hz until the next one."""
        if self._system is None:
            return
        if self._offboard is None:
            self._offboard = Offboard(self._system)
        yaw_deg = math.degrees(setpoint.yaw_rad)
        north_m, east_m, down_m = setpoint.position_m.tolist()
        north_m_s, east_m_s, down_m_s = setpoint.velocity_m_s.tolist()
        self._offboard.set_position_velocity_acceleration_ned(
            PositionNedYaw(north_m, east_m, down_m, yaw_deg),
            VelocityNedYaw(north_m_s, east_m_s, down_m_s, yaw_deg),
            AccelerationNed(*setpoint.acceleration_m_s2.tolist()),
        )

    def end_setpoints(self) -> None:
        """Destroying the plugin ends its stream at once; its own stop() would command Hold, and so overrule a pilot."""
        if self._offboard is not None:
            self._offboard.destroy()
            self._offboard = None

    async def command_mode(self, mode: FlightMode) -> None:
        """Command a mode; see `Autopilot.command_mode`."""
        calls = {
            FlightMode.OFFBOARD: lambda: self._offboard and self._offboard.start(),
            FlightMode.HOLD: lambda: self._action.hold(),
            FlightMode.LAND: lambda: self._action.land(),
            FlightMode.RTL: lambda: self._action.return_to_launch(),
        }
        await self._ask(f"mode {mode.value}", calls[mode])

    async def download_mission(self) -> tuple[MissionItem, ...]:
        """The stored mission; see `Autopilot.download_mission`."""
        items = await self._ask("mission download", lambda: self._mission.download_mission())
        return tuple(
            MissionItem(
                command=item.command,
                frame=item.frame,
                param1=item.param1,
                param2=item.param2,
                param3=item.param3,
                param4=item.param4,
                x=item.x,
                y=item.y,
                z=item.z,
            )
            for item in items
        )

    async def set_current_item(self, seq: int) -> None:
        """Make an item the current one; see `Autopilot.set_current_item`."""
        await self._ask(f"current item {seq}", lambda: self._mission.set_current_mission_item(seq))

    def acknowledge_start(self, sender: Sender, result: CommandResult, reason: Reason) -> None:
        """Answer a MISSION_START; see `Autopilot.acknowledge_start`."""
        fields = {
            "command": MISSION_START,
            "result": int(result),
            "result_param2": int(reason),
            "target_system": sender.system,
            "target_component": sender.component,
        }
        self._send(sender.system, "COMMAND_ACK", fields)

    def send_tunnel(self, kind: PayloadType, payload: bytes) -> None:
        """Broadcast a TUNNEL message; see `Autopilot.send_tunnel`."""
        padded = payload.ljust(MAX_PAYLOAD_BYTES, b"\0")
        fields = {
            "target_system": 0,
            "target_component": 0,
            "payload_type": int(kind),
            "payload_length": len(payload),
            "payload": list(padded),
        }
        self._send(self._sysid, "TUNNEL", fields)

    def _send(self, through: int, name: str, fields: dict[str, Any]) -> None:
        """Send a message; one that cannot be sent is counted, as it would be on a lossy link."""
        direct = self._direct.get(through)
        try:
            if direct is not None:
                direct.send_message(MavlinkMessage(name, fields_json=msgspec.json.encode(fields).decode()))
        except MavsdkError as unsent:
            self.dropped[name] += 1
            if self.dropped[name] == 1:
                self._complain(f"{name} not sent: {unsent}")

    async def _command(self, command: int, param1: float, param2: float = 0.0) -> bool:
        """Send a COMMAND_LONG to the autopilot; whether it was accepted."""
        target = {"target_system": self._sysid, "target_component": AUTOPILOT}
        fields = msgspec.json.encode({**target, "command": command, "param1": float(param1), "param2": param2})
        message = MavlinkMessage("COMMAND_LONG", fields_json=fields.decode())
        direct = self._direct[self._sysid]
        try:
            ack = await self._ask(f"command {command}", lambda: direct.send_command(message))
        except CommandRefused:
            return False
        return msgspec.json.decode(ack.fields_json, type=CommandAck).result == CommandResult.ACCEPTED

    async def _ask(self, what: str, call: Callable[[], T]) -> T:
        """Make a call that waits for an answer, in a thread of its own.

        One that gets no answer holds up neither the others nor the end of the program: MAVSDK never returns from the
        calls that are open when it is destroyed, so their threads must be daemons, which those of a pool are not.

        Raises:
            CommandRefused: the answer was no, or there was none.
        """
        answer: asyncio.Future[T] = self._loop.create_future()

        def settle(outcome: Callable[[], None]) -> None:
            if not answer.done():
                outcome()

        def ask() -> None:
            try:
                found = call()
            except Exception as problem:
                self._soon(settle, partial(answer.set_exception, problem))
            else:
                self._soon(settle, partial(answer.set_result, found))

        threading.Thread(target=ask, name=what, daemon=True).start()
        try:
            return await answer
        except (MavsdkError, RuntimeError) as refused:  # RuntimeError: the plugin was destroyed meanwhile
            raise CommandRefused(f"{what}: {refused}") from refused


def refuse_busy_port(url: str) -> None:
    """MAVSDK shares a UDP port that is in use, and then hears only part of what comes in: look before.

    Raises:
        UsageError: another program listens there, or the URL is none.
    """
    try:
        parts = urlsplit(url)
        host, port = parts.hostname or "0.0.0.0", parts.port
    except ValueError as wrong:
        raise UsageError(f"--system {url}: {wrong}") from None
    if parts.scheme not in {"udpin", "udp"}:
        return
    if port is None:
        raise UsageError(f"--system {url}: expected a port, as in udpin://127.0.0.1:14540")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((host, port))
        except OSError as problem:
            raise UsageError(f"--system {url}: {str(problem.strerror).lower()}") from None
