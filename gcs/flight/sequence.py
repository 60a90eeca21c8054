"""The flight of a fleet, step by step: connect, check, plan, upload, arm, take off, start, watch.

`FleetFlight` is what both `gcs fly` and the buttons of the web page act on. Each step is a coroutine that either
holds at its end or raises with a sentence for the operator; whatever ends a flight early leaves no vehicle
armed on the ground and none in the air without a mode that was chosen for it.
"""

import asyncio
from collections.abc import Awaitable, Callable, Iterable
from dataclasses import dataclass, field

from gcs.dialect import AUTOPILOT, COMPANION, Mode, mavlink
from gcs.errors import CommandRefused, FlightAborted, GcsError, LinkLost, PreflightError
from gcs.fleet.vehicle_state import VehicleState
from gcs.flight import actions, preflight, safety_parameters, upload
from gcs.flight.cloud_loop import CloudLoop
from gcs.flight.events import EventLog, Severity
from gcs.flight.fence import fence_items
from gcs.flight.monitor import Phase, VehicleMonitor, describe
from gcs.microservices.command_client import Command, CommandClient
from gcs.microservices.mission_transfer_client import FENCE
from gcs.planner.plan import FleetPlan, VehiclePlan
from gcs.settings import PlanningMode
from gcs.station import Station
from missions.mission import Mission, OnArrival, Site, Vehicle
from missions.mission_items import Command as ItemCommand
from missions.mission_items import MissionItem, encode_track, plan_id
from missions.tunnel import CompanionState

CONNECT_TIMEOUT_S = 240.0
"""Wall clock; on a fresh machine the companions first compile their planner."""

READY_TIMEOUT_S = 60.0
COMPANION_READY_TIMEOUT_S = 30.0
TAKEOFF_TIMEOUT_S = 60.0
"""In vehicle time, as what follows."""
STAGGER_S = 1.0
WATCH_INTERVAL_S = 0.05

STREAM_RATES_HZ = {
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 10.0,
    mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: 10.0,
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 5.0,
    mavlink.MAVLINK_MSG_ID_MISSION_CURRENT: 5.0,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: 2.0,
}

Planner = Callable[[Mission], Awaitable[FleetPlan]]


@dataclass
class VehicleFlight:
    """One vehicle's part in the flight."""

    vehicle: Vehicle
    monitor: VehicleMonitor
    plan: VehiclePlan | None = None
    items: tuple[MissionItem, ...] = ()

    @property
    def name(self) -> str:
        return self.vehicle.name

    @property
    def sysid(self) -> int:
        return self.vehicle.sysid


@dataclass
class FleetFlight:
    """The flight of one mission.

    Args:
        station: the links and the fleet's state.
        mission: with its final origin.
        mode: who plans.
        planner: makes the cloud's plan.
        events: where everything of note is written.
        speed: simulated seconds per wall-clock second.
        unattended: nobody watches: interrupted vehicles are landed.
    """

    station: Station
    mission: Mission
    mode: PlanningMode
    planner: Planner
    events: EventLog
    speed: float = 1.0
    unattended: bool = True
    plan: FleetPlan | None = None
    vehicles: dict[int, VehicleFlight] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.cloud = CloudLoop(self)

    @property
    def in_flight(self) -> list[VehicleFlight]:
        return [flight for flight in self.vehicles.values() if flight.monitor.phase.in_flight]

    @property
    def prepared(self) -> bool:
        """Every vehicle is checked and holds its mission."""
        flights = self.vehicles.values()
        return bool(flights) and all(flight.monitor.phase is Phase.PREPARED for flight in flights)

    @property
    def success(self) -> bool:
        return bool(self.vehicles) and all(flight.monitor.reached for flight in self.vehicles.values())

    async def fly(self) -> None:
        """The whole flight, or what is left of it: a plan and an upload that were asked for before are kept.

        Raises:
            GcsError: the flight could not begin, or was broken off before all vehicles had started.
        """
        await self.connect()
        if self.plan is None:
            await self.make_plan()
        if not self.prepared:
            await self.prepare()
        await self.launch()
        await self.start()
        await self.watch()

    async def connect(self) -> None:
        """Hear every vehicle, and its companion where one is needed."""
        await self._for_all(self._connect, self.mission.vehicles)

    async def make_plan(self) -> None:
        """Let the cloud planner plan for the whole fleet.

        Raises:
            PreflightError: there is no feasible plan; says what keeps it from being one.
        """
        self.events.add("plan", f"planning {self.mission.name} for {len(self.mission.vehicles)} vehicles")
        plan = await self.planner(self.mission)
        if not plan.feasible:
            raise PreflightError("no feasible plan: " + "; ".join(str(violation) for violation in plan.violations))
        self.plan = plan
        self.vehicles = {part.sysid: self._vehicle_flight(part) for part in plan.vehicles}
        text = f"plan found in {plan.wall_s:.2f} s, objective {plan.objective:.1f}"
        self.events.add("planned", text, objective=plan.objective, evaluations=plan.evaluations)

    async def prepare(self) -> None:
        """Check every vehicle, set what is needed, and store its fence and mission."""
        await self._for_all(self._prepare, self.vehicles.values())

    async def launch(self) -> None:
        """Arm and take off, one shortly after the other; ends when all hover.

        Raises:
            FlightAborted: a vehicle did not get to hover; all are back on the ground, or landing.
        """
        try:
            for flight in self.vehicles.values():
                await self._take_off(flight)
                await asyncio.sleep(STAGGER_S / self.speed)
            await self._for_all(self._hover, self.vehicles.values())
        except GcsError as problem:
            await self._abort_launch(str(problem))
            raise FlightAborted(f"take-off broken off: {problem}") from problem

    async def start(self) -> None:
        """Start the mission on all vehicles at once."""
        await self._for_all(self._start, self.vehicles.values())

    async def watch(self) -> None:
        """Follow the flight until it has ended for every vehicle, and replan it meanwhile where both sides plan."""
        async with asyncio.TaskGroup() as orders:
            replanning = orders.create_task(self.cloud.run(), name="replanning")
            while any(flight.monitor.phase is not Phase.DONE for flight in self.vehicles.values()):
                for flight in self.vehicles.values():
                    self._watch_one(flight, orders)
                await asyncio.sleep(WATCH_INTERVAL_S / self.speed)
            replanning.cancel()

    async def hold(self, flight: VehicleFlight) -> None:
        """Stop where it is, on the operator's order."""
        flight.monitor.paused_by_operator = True
        await self._command(flight, actions.set_mode(Mode.HOLD))

    async def resume(self, flight: VehicleFlight) -> None:
        """Go on with the mission."""
        await self._start(flight)

    async def land(self, flight: VehicleFlight, reason: str = "landed by the operator") -> None:
        """Come down on the spot."""
        flight.monitor.come_down(reason)
        await self._command(flight, actions.set_mode(Mode.LAND))

    async def return_home(self, flight: VehicleFlight, reason: str = "sent home by the operator") -> None:
        """Return to the pad and land there."""
        flight.monitor.come_down(reason)
        await self._command(flight, actions.set_mode(Mode.RTL))

    async def hold_all(self, reason: str) -> None:
        """Leave everything that flies holding, as well as the links allow."""
        orders = [self._command(flight, actions.set_mode(Mode.HOLD)) for flight in self.in_flight]
        for flight, outcome in zip(self.in_flight, await asyncio.gather(*orders, return_exceptions=True), strict=True):
            state = "holding" if outcome is None else f"not confirmed: {outcome}"
            flight.monitor.give_up(f"{reason}; {state}")

    # ------------------------------------------------------------------ one vehicle

    def state(self, sysid: int) -> VehicleState:
        return self.station.vehicle(sysid)

    def _vehicle_flight(self, plan: VehiclePlan) -> VehicleFlight:
        vehicle, mission = self.mission.vehicle(plan.sysid), self.mission
        monitor = VehicleMonitor(
            target=plan.target,
            on_arrival=mission.on_arrival,
            tolerance_m=mission.site.arrival_tolerance_m,
            endurance_s=mission.limits.endurance_s,
            flown_by_companion=self.mode.needs_companions,
            unattended=self.unattended,
            frame=mission.frame,
            ground_offset_m=0.0,
            speed=self.speed,
        )
        return VehicleFlight(vehicle, monitor, plan)

    async def _connect(self, vehicle: Vehicle) -> None:
        fleet, sysid = self.station.fleet.vehicles, vehicle.sysid
        await self.station.wait_until(
            lambda: sysid in fleet and fleet[sysid].place is not None, CONNECT_TIMEOUT_S, f"vehicle {sysid} not heard"
        )
        self.events.add("connected", "autopilot heard", vehicle.name)
        if self.mode.needs_companions:
            what = f"no companion of vehicle {sysid} heard; start one, or fly with --mode cloud"
            await self.station.wait_until(
                lambda: fleet[sysid].companion_online(self.station.now_s), CONNECT_TIMEOUT_S, what
            )
            self.events.add("companion", "companion heard", vehicle.name)
        await self._request_streams(vehicle)

    async def _request_streams(self, vehicle: Vehicle) -> None:
        for message_id, rate_hz in STREAM_RATES_HZ.items():
            try:
                await self._command_to(vehicle.sysid, AUTOPILOT, actions.set_message_interval(message_id, rate_hz))
            except CommandRefused:  # a PX4 sends MISSION_CURRENT at its own rate alone
                name = mavlink.mavlink_map[message_id].msgname
                self.events.add("stream", f"the autopilot keeps its own rate of {name}", vehicle.name)

    async def _prepare(self, flight: VehicleFlight) -> None:
        await self._ready_to_arm(flight)
        for change in await safety_parameters.ensure(self.station, flight.sysid, self.mission, self.speed):
            self.events.add("parameter", change, flight.name)
        state = self.state(flight.sysid)
        offset_m = preflight.ground_offset_m(state, flight.vehicle, self.mission)
        flight.monitor.ground_offset_m = offset_m
        assert self.plan is not None
        assert flight.plan is not None
        flight.items = self.mission_items(flight.plan, offset_m)
        fence = fence_items(self.mission, [part.curve_m for part in self.plan.vehicles])
        await upload.store(self.station, flight.sysid, fence, FENCE)
        await upload.store(self.station, flight.sysid, flight.items)
        text = f"{len(flight.items)} mission items and {len(fence)} fence items stored and read back"
        self.events.add("uploaded", text, flight.name, plan_id=plan_id(flight.items), ground_offset_m=offset_m)
        if self.mode.needs_companions:
            await self._companion_ready(flight)
        flight.monitor.phase = Phase.PREPARED

    def mission_items(self, plan: VehiclePlan, ground_offset_m: float) -> tuple[MissionItem, ...]:
        """What is uploaded of a vehicle's plan."""
        track, ending = plan.track, None
        if self.mode is PlanningMode.ONBOARD:
            track = plan.targets_alone
        if self.mode is PlanningMode.CLOUD:
            endings = {OnArrival.LAND: ItemCommand.NAV_LAND, OnArrival.RTL: ItemCommand.NAV_RETURN_TO_LAUNCH}
            ending = endings.get(self.mission.on_arrival)
        return encode_track(
            track,
            self.mission.frame,
            acceptance_radius_m=0.3 if self.mission.site is Site.INDOOR else 2.0,
            ground_offset_m=ground_offset_m,
            ending=ending,
        )

    async def _ready_to_arm(self, flight: VehicleFlight) -> None:
        def problems() -> list[str]:
            state = self.state(flight.sysid)
            return list(preflight.problems(state, flight.vehicle, self.mission, self.station.now_s))

        if not await self.station.holds_within(lambda: not problems(), READY_TIMEOUT_S):
            raise PreflightError(f"{flight.name} (vehicle {flight.sysid}): {'; '.join(problems())}")

    async def _companion_ready(self, flight: VehicleFlight) -> None:
        expected = plan_id(flight.items)

        def ready() -> bool:
            status = self.state(flight.sysid).companion.status
            return status is not None and status.state is CompanionState.READY and status.plan_id == expected

        if not await self.station.holds_within(ready, COMPANION_READY_TIMEOUT_S):
            raise PreflightError(f"{flight.name}: {self._companion_complaint(flight, expected)}")
        status = self.state(flight.sysid).companion.status
        assert status is not None
        if status.mission_digest != self.mission.digest:
            raise PreflightError(f"{flight.name}: its companion has read another mission file, or another origin")

    def _companion_complaint(self, flight: VehicleFlight, expected: int) -> str:
        status = self.state(flight.sysid).companion.status
        if status is None:
            return "its companion sends no status"
        if status.plan_id != expected:
            return f"its companion has plan {status.plan_id:08x}, uploaded was {expected:08x}"
        return f"its companion is {describe(status.state, status.reason)}"

    async def _take_off(self, flight: VehicleFlight) -> None:
        await self._command(flight, actions.arm())
        flight.monitor.phase = Phase.TAKING_OFF
        altitude_m = self._hover_height_m(flight) + self.mission.origin.altitude_amsl_m + flight.monitor.ground_offset_m
        await self._command(flight, actions.take_off(altitude_m))

    async def _hover(self, flight: VehicleFlight) -> None:
        state, height_m = self.state(flight.sysid), self._hover_height_m(flight)
        tolerance_m = 0.3 if self.mission.site is Site.INDOOR else 1.5

        def hovering() -> bool:
            position_m = state.position_m(self.mission.frame, flight.monitor.ground_offset_m)
            return (
                position_m is not None
                and abs(position_m[2] - height_m) < tolerance_m
                and abs(state.velocity_enu_m_s[2]) < 0.3
                and state.mode is Mode.HOLD
            )

        timeout_s = TAKEOFF_TIMEOUT_S / self.speed
        await self.station.wait_until(hovering, timeout_s, f"{flight.name} does not hover at {height_m:g} m")
        flight.monitor.phase = Phase.HOVERING
        self.events.add("hovering", f"hovering at {height_m:g} m", flight.name)

    def _hover_height_m(self, flight: VehicleFlight) -> float:
        return flight.vehicle.pad_m[2] + self.mission.takeoff_height_m

    async def _start(self, flight: VehicleFlight) -> None:
        component = COMPANION if self.mode.needs_companions else AUTOPILOT
        try:
            await self._command_to(flight.sysid, component, actions.start_mission())
        except GcsError as problem:
            self.events.add("refused", str(problem), flight.name, Severity.ERROR)
            if flight.monitor.phase is not Phase.INTERRUPTED:
                await self.land(flight, f"its mission could not be started: {problem}")
            return
        flight.monitor.start(self.state(flight.sysid), self.station.now_s)
        self.events.add("started", "mission started", flight.name)

    def _watch_one(self, flight: VehicleFlight, orders: asyncio.TaskGroup) -> None:
        before = flight.monitor.phase
        order = flight.monitor.step(self.state(flight.sysid), self.station.now_s)
        if flight.monitor.phase is not before:
            severity = Severity.INFO if flight.monitor.reached or not flight.monitor.reason else Severity.WARNING
            text = f"{before.value} -> {flight.monitor.phase.value}: {flight.monitor.reason}".rstrip(": ")
            self.events.add("phase", text, flight.name, severity, phase=flight.monitor.phase.value)
        if order is not None:
            orders.create_task(self._order(flight, order), name=f"{order.name} to {flight.name}")

    async def _order(self, flight: VehicleFlight, mode: Mode) -> None:
        try:
            await self._command(flight, actions.set_mode(mode))
        except (CommandRefused, LinkLost) as problem:
            self.events.add("refused", str(problem), flight.name, Severity.ERROR)

    async def _abort_launch(self, reason: str) -> None:
        self.events.add("aborted", reason, severity=Severity.ERROR)
        for flight in self.vehicles.values():
            state = self.state(flight.sysid)
            order = actions.set_mode(Mode.LAND) if state.airborne else actions.disarm()
            if state.armed or flight.monitor.phase.in_flight:
                try:
                    await self._command(flight, order)
                except GcsError as problem:
                    self.events.add("refused", str(problem), flight.name, Severity.ERROR)
            flight.monitor.give_up(f"take-off broken off: {reason}")

    async def _command(self, flight: VehicleFlight, command: Command) -> None:
        self.events.add("command", command.name, flight.name)
        await self._command_to(flight.sysid, AUTOPILOT, command)

    async def _command_to(self, sysid: int, component: int, command: Command) -> None:
        await self.station.run(CommandClient(command, (sysid, component)))

    @staticmethod
    async def _for_all(step: Callable[..., Awaitable[None]], parts: Iterable[object]) -> None:
        """Do one step for all vehicles at once; the first failure cancels the others and is raised as it is."""
        try:
            async with asyncio.TaskGroup() as group:
                for part in parts:
                    group.create_task(_awaited(step(part)))
        except* GcsError as failures:
            raise failures.exceptions[0] from None


async def _awaited(step: Awaitable[None]) -> None:
    await step
