"""A desk whose vehicles follow a script: real station, fleet and flight, fed with MAVLink frames made here.

The vehicles answer commands as an autopilot does, fly along their plan when they are told to, and say what a real
vehicle and its companion would say.
"""

import asyncio
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gcs.desk import Desk
from gcs.dialect import AUTOPILOT, COMPANION, Mode, mavlink
from gcs.flight.events import EventLog
from gcs.flight.monitor import Phase
from gcs.flight.sequence import FleetFlight
from gcs.flight.trails import Trails
from gcs.link.codec import Codec
from gcs.planner.plan import FleetPlan, VehiclePlan
from gcs.settings import PlanningMode
from gcs.station import Station
from missions import tunnel
from missions.frames import LocalFrame
from missions.mission import Mission, load_mission
from missions.trajectory import Trajectory
from missions.tunnel import CompanionState, CompanionStatus, TrajectoryKind, TrajectoryMessage
from tests.browser.scripted_plan import scripted_plan, scripted_progress
from tests.unit.gcs.messages import frame_of

ADDRESS = ("127.0.0.1", 1)
AHEAD_S = 2.4
KNOT_S = 0.3
PLANNING_STEPS = 20


@dataclass
class ScriptedVehicle:
    """One vehicle with its companion; `time_s` is the time along its plan's curve."""

    sysid: int
    frame: LocalFrame
    position_m: np.ndarray
    mode: Mode = Mode.HOLD
    armed: bool = False
    battery_percent: int = 96
    companion: CompanionState | None = CompanionState.READY
    velocity_m_s: np.ndarray = field(default_factory=lambda: np.zeros(3))
    plan: VehiclePlan | None = None
    time_s: float = 0.0
    clock_s: float = 10.0
    commands: list[tuple[int, float, float]] = field(default_factory=list)
    """Of every command received: its number, param2 and param3."""
    sent_to_m: list[np.ndarray] = field(default_factory=list)
    """Places of Go to received, ENU."""

    def fly_on(self, seconds: float) -> None:
        """Let time pass; along the plan only while the companion steers."""
        self.clock_s += seconds
        before_m = self.position_m
        if self.plan is not None and self.mode is Mode.OFFBOARD:
            self.time_s += seconds
            self.position_m = self.place_at(self.time_s)
        self.velocity_m_s = (self.position_m - before_m) / seconds

    def place_at(self, time_s: float) -> np.ndarray:
        assert self.plan is not None
        return np.array([np.interp(time_s, self.plan.times_s, self.plan.curve_m[:, axis]) for axis in range(3)])

    def said(self) -> list[bytes]:
        """One round of what it sends."""
        autopilot = [self._heartbeat(), self._position(), self._attitude(), self._landed(), self._status()]
        frames = [frame_of(self.sysid, AUTOPILOT, message) for message in autopilot]
        if self.companion is not None:
            heard = [mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3), self._companion_status()]
            heard += [self._trajectory()] if self.companion is CompanionState.FLYING else []
            frames += [frame_of(self.sysid, COMPANION, message) for message in heard]
        return frames

    def text(self, text: str, severity: int = 6) -> bytes:
        return frame_of(self.sysid, AUTOPILOT, mavlink.MAVLink_statustext_message(severity, text.encode()))

    def receive(self, message: Any) -> list[bytes]:
        """What it answers to one message of the ground station."""
        if message.get_type() not in {"COMMAND_LONG", "COMMAND_INT"} or message.target_system != self.sysid:
            return []
        self.commands.append((message.command, message.param2, message.param3))
        if message.command == mavlink.MAV_CMD_DO_SET_MODE:
            main, sub = int(message.param2), int(message.param3)
            self.mode = Mode(sub << 24 | main << 16)
            self.companion = CompanionState.RELEASED if self.companion is not None else None
        if message.command == mavlink.MAV_CMD_DO_REPOSITION:
            self.mode = Mode.HOLD
            self.sent_to_m.append(self.frame.enu(message.x * 1e-7, message.y * 1e-7, message.z))
        if message.command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
            self.armed = message.param1 > 0.5
        ack = mavlink.MAVLink_command_ack_message(message.command, mavlink.MAV_RESULT_ACCEPTED)
        return [frame_of(self.sysid, message.target_component, ack)]

    def _heartbeat(self) -> Any:
        armed = mavlink.MAV_MODE_FLAG_SAFETY_ARMED if self.armed else 0
        return mavlink.MAVLink_heartbeat_message(2, 12, armed | 1, int(self.mode), 3, 3)

    def _position(self) -> Any:
        place = self.frame.geodetic(self.position_m)
        east, north, up = np.clip(self.velocity_m_s * 100, -3e4, 3e4).round().astype(int).tolist()
        return mavlink.MAVLink_global_position_int_message(
            round(self.clock_s * 1e3),
            round(place.latitude_deg * 1e7),
            round(place.longitude_deg * 1e7),
            round(place.altitude_amsl_m * 1e3),
            0,
            north,
            east,
            -up,
            0,
        )

    def _attitude(self) -> Any:
        """Nose along the way, leaning forward with speed."""
        speed_m_s = float(np.linalg.norm(self.velocity_m_s[:2]))
        yaw = float(np.arctan2(*self.velocity_m_s[:2])) if speed_m_s > 0.1 else np.pi / 2
        return mavlink.MAVLink_attitude_message(round(self.clock_s * 1e3), 0.0, -0.08 * min(speed_m_s, 4), yaw, 0, 0, 0)

    def _landed(self) -> Any:
        return mavlink.MAVLink_extended_sys_state_message(0, 2 if self.armed else 1)

    def _status(self) -> Any:
        fields = (0, 0, 0x10000000, 180, 16000, -1, self.battery_percent, 0, 0, 0, 0, 0, 0)
        return mavlink.MAVLink_sys_status_message(*fields)

    def _companion_status(self) -> Any:
        assert self.companion is not None
        status = CompanionStatus(state=self.companion, replans=12, replan_p50_ms=1.4, replan_p99_ms=3.9)
        return _tunnel(tunnel.PayloadType.COMPANION_STATUS, tunnel.encode_status(status))

    def _trajectory(self) -> Any:
        times_s = self.time_s + np.arange(-KNOT_S, AHEAD_S, KNOT_S)
        ahead = Trajectory(np.array([self.place_at(time_s) for time_s in times_s]), 1.7e9 + self.clock_s, KNOT_S)
        revision = round(self.clock_s * 2)
        message = TrajectoryMessage(
            kind=TrajectoryKind.COMMITTED, plan_id=1, revision=revision, radius_m=0.2, trajectory=ahead
        )
        return _tunnel(tunnel.PayloadType.TRAJECTORY, tunnel.encode_trajectory(message))


class Air:
    """The connection between the station and all scripted vehicles."""

    peer: tuple[str, int] | None = None
    budget_bytes_s: float | None = None

    def __init__(self) -> None:
        self.vehicles: list[ScriptedVehicle] = []
        self.station = Station(connections=[self])
        self._codec = Codec()

    def send(self, datagram: bytes, address: tuple[str, int]) -> None:
        """From the ground station."""
        for message in self._codec.parse(datagram):
            for vehicle in self.vehicles:
                for answer in vehicle.receive(message):
                    asyncio.get_running_loop().call_soon(self.say, answer)

    def say(self, frame: bytes) -> None:
        """To the ground station."""
        self.station.receive(self, frame, ADDRESS)


class ScriptedDesk:
    """A desk and the vehicles that it looks at.

    Args:
        mission: it, its name, or None for watching `watched` vehicles without a mission.
        watched: see there.

    Attributes:
        pace: of what is flown while it is watched: slow motion, since a browser that draws in software is slow to
            begin; 0 if what is tested depends on where the vehicles are.
    """

    def __init__(self, mission: Mission | str | None, watched: int = 0) -> None:
        self.planning_s, self.pace = 0.0, 0.1
        self.air = Air()
        self.events = EventLog(time.monotonic)
        self.desk = Desk(self.air.station, self.events, simulated=True)
        frame, pads_m = load_mission("field").frame, [(4.0 * i, 2.0 * i, 0.0) for i in range(watched)]
        if mission is not None:
            self.mission = load_mission(mission) if isinstance(mission, str) else mission
            self.desk.flight = self._flight(self.mission)
            frame, pads_m = self.mission.frame, [vehicle.pad_m for vehicle in self.mission.vehicles]
        self.desk.trails = Trails(frame)
        self.vehicles = self.air.vehicles
        for index, pad_m in enumerate(pads_m):
            self.vehicles.append(ScriptedVehicle(index + 1, frame, np.array(pad_m, dtype=float)))

    def _flight(self, mission: Mission) -> FleetFlight:
        return FleetFlight(
            station=self.air.station,
            mission=mission,
            mode=PlanningMode.END_CLOUD,
            planner=self._plan,
            events=self.events,
            unattended=False,
        )

    async def _plan(self, mission: Mission, *_: object) -> FleetPlan:
        for progress in scripted_progress(PLANNING_STEPS):
            self.desk.on_plan_progress(progress)
            await asyncio.sleep(self.planning_s / PLANNING_STEPS)
        return scripted_plan(mission)

    async def begin(self, *, at_s: Sequence[float] | None = None) -> None:
        """Be heard; with `at_s`, be so far along the plan already, and flying."""
        self.say()
        if at_s is None:
            return
        assert self.desk.flight is not None
        await self.desk.flight.make_plan()
        for vehicle, flown_s in zip(self.vehicles, at_s, strict=True):
            self._take_to_the_air(vehicle, flown_s)

    def _take_to_the_air(self, vehicle: ScriptedVehicle, flown_s: float) -> None:
        assert self.desk.flight is not None
        part = self.desk.flight.vehicles[vehicle.sysid]
        vehicle.plan, vehicle.armed, vehicle.mode = part.plan, True, Mode.OFFBOARD
        vehicle.companion = CompanionState.FLYING
        step_s = max(flown_s / 400, 0.05)
        while vehicle.time_s < flown_s:
            vehicle.fly_on(step_s)
            for frame in vehicle.said():
                self.air.say(frame)
            self.sample()
        vehicle.fly_on(1e-3)
        part.monitor.start(self.desk.vehicles[vehicle.sysid], self.air.station.now_s)

    def say(self) -> None:
        """One round of everybody's telemetry."""
        for vehicle in self.vehicles:
            for frame in vehicle.said():
                self.air.say(frame)

    def sample(self) -> None:
        assert self.desk.trails is not None
        self.desk.trails.sample(self.air.station.fleet, {})

    async def run(self, interval_s: float = 0.1) -> None:
        """Fly on until cancelled."""
        while True:
            if self.pace > 0.0:
                for vehicle in self.vehicles:
                    vehicle.fly_on(interval_s * self.pace)
            self.say()
            self.sample()
            for part in self.desk.flight.vehicles.values() if self.desk.flight else ():
                if part.monitor.phase is not Phase.WAITING:
                    part.monitor.step(self.desk.vehicles[part.sysid], self.air.station.now_s)
            await asyncio.sleep(interval_s)


def _tunnel(payload_type: int, payload: bytes) -> Any:
    padded = list(payload) + [0] * (128 - len(payload))
    return mavlink.MAVLink_tunnel_message(0, 0, payload_type, len(payload), padded)
