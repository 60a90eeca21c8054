"""A companion's link to a simulated vehicle, in memory: plain MAVLink instead of MAVSDK."""

import asyncio
import math
from collections.abc import Iterable
from typing import Any

import msgspec

from companion.errors import CommandRefused
from companion.events import AutopilotFound, Event, FlightMode, RingReported, Sender, StartCommanded
from companion.instructions import CommandResult
from companion.link.messages import EVENTS_OF, OdometryMessage, TunnelMessage
from companion.setpoints import Setpoint
from gcs.dialect import AUTOPILOT, COMPANION, Mode, mavlink
from gcs.errors import GcsError
from gcs.flight import actions
from gcs.link.codec import Codec
from gcs.microservices.command_client import Command, CommandClient
from gcs.microservices.mission_download import MissionDownload
from gcs.station import Station
from missions.mission_items import MissionItem
from missions.tunnel import PayloadType, Reason
from sitl.microservices.outbox import Link
from sitl.microservices.streams import BY_ID as STREAMED_BY_ID
from sitl.simulator import Simulator

RATES_HZ = {331: 30.0, 436: 10.0, 245: 5.0, 242: 1.0}
OBSTACLE_DISTANCE = 330
GPS_GLOBAL_ORIGIN = 49
HEARTBEAT_INTERVAL_S = 1.0
YAW_RATE_IGNORED = 0x800
ANSWERS = {0, 39, 40, 44, 47, 51, 73, 77}
"""What microservices wait for: mission transfer and COMMAND_ACK; and HEARTBEAT, which says where to send to."""
EVENTS = {
    getattr(mavlink, f"MAVLINK_MSG_ID_{name}")
    for name in (*EVENTS_OF, "ODOMETRY", "COMMAND_LONG", "OBSTACLE_DISTANCE", "TUNNEL")
}
"""What becomes events; everything else is not even decoded."""
MODES = {
    FlightMode.OFFBOARD: Mode.OFFBOARD,
    FlightMode.HOLD: Mode.HOLD,
    FlightMode.LAND: Mode.LAND,
    FlightMode.RTL: Mode.RTL,
}


GROUND_READS = {
    mavlink.MAVLINK_MSG_ID_HEARTBEAT,
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
    mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION,
    mavlink.MAVLINK_MSG_ID_HOME_POSITION,
    mavlink.MAVLINK_MSG_ID_MISSION_CURRENT,
}
"""What the ground station makes its picture of a vehicle of, of what is streamed."""


def quieten(simulator: Simulator, sysid: int) -> None:
    """Switch off what a vehicle streams and nobody here reads: most of all messages.

    Distances around are streamed again when a companion asks for them.
    """
    codec, vehicle = Codec(sysid, COMPANION), simulator.vehicles[sysid]
    for link, read in ((Link.ONBOARD, (EVENTS - {OBSTACLE_DISTANCE}) | ANSWERS), (Link.GROUND, GROUND_READS)):
        for message_id in STREAMED_BY_ID.keys() - read:
            off = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 0, float(message_id), -1.0
            command = mavlink.MAVLink_command_long_message(sysid, AUTOPILOT, *off, 0.0, 0.0, 0.0, 0.0, 0.0)
            vehicle.receive(link, codec.pack(command))
    vehicle.take()  # its answers


class OnboardWire:
    """The onboard link of one vehicle, in memory."""

    peer = None
    budget_bytes_s = None

    def __init__(self, simulator: Simulator, sysid: int) -> None:
        self._simulator, self._sysid = simulator, sysid

    def send(self, datagram: bytes, address: tuple[str, int]) -> None:
        self._simulator.receive(self._sysid, Link.ONBOARD, datagram)


class SimulatedAutopilot:
    """See `companion.link.autopilot.Autopilot`."""

    def __init__(self, simulator: Simulator, sysid: int, ring_hz: float = 0.0) -> None:
        self._sysid = sysid
        self._rates_hz = RATES_HZ | ({OBSTACLE_DISTANCE: ring_hz} if ring_hz > 0.0 else {})
        self._peer = (sysid, AUTOPILOT)
        self._wire = OnboardWire(simulator, sysid)
        self._station = Station(codec=Codec(sysid, COMPANION))
        self._reader = Codec(sysid, COMPANION)
        self._events: asyncio.Queue[Event] = asyncio.Queue()
        self._tasks: list[asyncio.Task[None]] = []
        self._found = asyncio.Event()
        self.streaming = False
        """Setpoints are being sent."""

    def receive_frame(self, frame: bytes) -> None:
        """A frame that the vehicle has sent on its onboard link."""
        message_id = int.from_bytes(frame[7:10], "little")
        if not self._tasks:
            return  # not opened yet, or closed
        if message_id in ANSWERS:
            self._station.receive(self._wire, frame, ("onboard", self._sysid))
        for message in self._reader.parse(frame) if message_id in EVENTS else []:
            if message.get_srcComponent() == AUTOPILOT:
                self._read(message)
            elif message.get_type() == "COMMAND_LONG" and message.command == mavlink.MAV_CMD_MISSION_START:
                self._events.put_nowait(StartCommanded(Sender(message.get_srcSystem(), message.get_srcComponent())))
            elif message.get_type() == "TUNNEL":
                self._read_tunnel(message)

    async def open(self) -> None:
        group = asyncio.get_running_loop()
        self._tasks = [group.create_task(self._send_heartbeats()), group.create_task(self._ask_for_streams())]

    def close(self) -> None:
        for task in self._tasks:
            task.cancel()
        self._tasks = []
        self.streaming = False

    async def receive(self) -> Event:
        return await self._events.get()

    def send_setpoint(self, setpoint: Setpoint) -> None:
        self.streaming = True
        self._send(
            mavlink.MAVLink_set_position_target_local_ned_message(
                0,
                *self._peer,
                mavlink.MAV_FRAME_LOCAL_NED,
                YAW_RATE_IGNORED,
                *setpoint.position_m.tolist(),
                *setpoint.velocity_m_s.tolist(),
                *setpoint.acceleration_m_s2.tolist(),
                setpoint.yaw_rad,
                0.0,
            )
        )

    def end_setpoints(self) -> None:
        self.streaming = False

    async def command_mode(self, mode: FlightMode) -> None:
        await self._command(actions.set_mode(MODES[mode]))

    async def download_mission(self) -> tuple[MissionItem, ...]:
        try:
            return tuple((await self._station.run(MissionDownload(self._peer))).items)
        except GcsError as problem:
            raise CommandRefused(str(problem)) from None

    async def set_current_item(self, seq: int) -> None:
        self._send(mavlink.MAVLink_mission_set_current_message(*self._peer, seq))

    def acknowledge_start(self, sender: Sender, result: CommandResult, reason: Reason) -> None:
        fields = (mavlink.MAV_CMD_MISSION_START, int(result), 0, int(reason), sender.system, sender.component)
        self._send(mavlink.MAVLink_command_ack_message(*fields))

    def send_tunnel(self, kind: PayloadType, payload: bytes) -> None:
        padded = list(payload.ljust(128, b"\0"))
        self._send(mavlink.MAVLink_tunnel_message(0, 0, int(kind), len(payload), padded))

    async def _send_heartbeats(self) -> None:
        kind = mavlink.MAV_TYPE_ONBOARD_CONTROLLER
        heartbeat = mavlink.MAVLink_heartbeat_message(kind, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 4, 3)
        while True:
            self._send(heartbeat)
            await asyncio.sleep(HEARTBEAT_INTERVAL_S)

    async def _ask_for_streams(self) -> None:
        await self._found.wait()
        for message_id, rate_hz in self._rates_hz.items():
            await self._command(actions.set_message_interval(message_id, rate_hz))
        await self._command(Command("request the origin", mavlink.MAV_CMD_REQUEST_MESSAGE, (float(GPS_GLOBAL_ORIGIN),)))

    async def _command(self, command: Command) -> None:
        try:
            await self._station.run(CommandClient(command, self._peer))
        except GcsError as problem:
            raise CommandRefused(str(problem)) from None

    def _send(self, message: Any) -> None:
        self._wire.send(self._station.codec.pack(message), ("onboard", self._sysid))

    def _read_tunnel(self, message: Any) -> None:
        tunnel = msgspec.json.decode(_as_mavsdk_has_it(message), type=TunnelMessage)
        for event in tunnel.receipt(Sender(message.get_srcSystem(), message.get_srcComponent())):
            self._events.put_nowait(event)

    def _read(self, message: Any) -> None:
        name = message.get_type()
        if name == "HEARTBEAT" and not self._found.is_set():
            self._found.set()
            self._events.put_nowait(AutopilotFound())
        if name == "OBSTACLE_DISTANCE" and OBSTACLE_DISTANCE in self._rates_hz:
            self._events.put_nowait(RingReported(_as_mavsdk_has_it(message)))
        elif name in EVENTS_OF:
            for event in EVENTS_OF[name](_as_mavsdk_has_it(message)):
                self._events.put_nowait(event)
        elif name == "ODOMETRY":
            read = _as_mavsdk_has_it(message, OdometryMessage.__struct_fields__)  # without 42 numbers that nobody reads
            self._events.put_nowait(msgspec.json.decode(read, type=OdometryMessage).event())


def _as_mavsdk_has_it(message: Any, names: Iterable[str] = ()) -> bytes:
    """A message's fields as JSON, all or those that are named, NaN as null."""
    fields = {name: _without_nan(getattr(message, name)) for name in names or message.get_fieldnames()}
    return msgspec.json.encode(fields)


def _without_nan(value: Any) -> Any:
    if isinstance(value, list):
        return [None if part != part else part for part in value]
    return None if isinstance(value, float) and math.isnan(value) else value
