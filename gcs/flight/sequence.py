"""The flight of a fleet, step by step: connect, plan, prepare, arm, take off, start, watch.

`FleetFlight` is what both `gcs fly` and the buttons of the web page act on. Each step is a coroutine that either
holds at its end or raises with a sentence for the operator; whatever ends a flight early leaves no vehicle
armed on the ground and none in the air without a mode that was chosen for it.
"""

import asyncio
from collections.abc import Awaitable, Callable, Iterable
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

from gcs.dialect import Mode
from gcs.errors import CommandRefused, FlightAborted, GcsError, LinkLost, PreflightError
from gcs.fleet.vehicle_state import VehicleState
from gcs.flight import actions
from gcs.flight.cloud_loop import CloudLoop
from gcs.flight.events import EventLog, Severity
from gcs.flight.monitor import Phase, VehicleMonitor
from gcs.flight.preparation import Preparation
from gcs.flight.route import RouteWatch
from gcs.flight.vehicle_flight import VehicleFlight
from gcs.flight.vehicle_orders import VehicleOrders
from gcs.planner.flown_plan import FlownPlan
from gcs.planner.plan import FleetPlan, VehiclePlan
from gcs.security.audit import Origin, acting_as
from gcs.settings import PlanningMode
from gcs.station import Station
from missions.mission import Mission

T = TypeVar("T")

STAGGER_S = 1.0
"""Between two take-offs, in vehicle time."""
WATCH_INTERVAL_S = 0.05

Parts = Iterable[VehicleFlight]


class Planner(Protocol):
    """Makes the cloud's plans."""

    def __call__(self, mission: Mission, flown: FlownPlan = ..., /) -> Awaitable[FleetPlan]:
        """Plan for a mission, or for what is left of it while something is flown.

        Raises:
            MissionError: it cannot be planned for.
        """
        ...


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
    passive: bool = False
    """Nothing is commanded but what an operator orders: after a restart in flight."""
    plan: FleetPlan | None = None
    """What is flown."""
    candidates: dict[str, FleetPlan] = field(default_factory=dict[str, FleetPlan])
    """What each algorithm has made of this mission last."""
    vehicles: dict[int, VehicleFlight] = field(default_factory=dict[int, VehicleFlight])
    sought: set[int] = field(default_factory=set[int])
    """Vehicles that have not been found again after a restart in flight."""

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
    def finished(self) -> bool:
        """The flight is over for every vehicle."""
        flights = self.vehicles.values()
        return bool(flights) and all(flight.monitor.phase is Phase.DONE for flight in flights)

    @property
    def success(self) -> bool:
        """Every vehicle has come to all targets of its route."""
        return bool(self.vehicles) and all(flight.monitor.reached for flight in self.vehicles.values())

    @property
    def orders(self) -> VehicleOrders:
        """What single vehicles can be ordered to do."""
        return VehicleOrders(self.station, self.mission, self.mode, self.events, self.speed)

    async def fly(self) -> None:
        """The whole flight, or what is left of it: a plan and an upload that were asked for before are kept.

        Raises:
            GcsError: the flight could not begin, or was broken off before all vehicles had started.
        """
        await self.connect()
        if self.plan is None:
            await self.make_plan()
        await self.prepare(self._in_phase(Phase.WAITING))
        await self.launch()
        await self.start()
        await self.watch()

    async def connect(self) -> None:
        """Hear every vehicle, and its companion where one is needed."""
        await _for_all(self._preparation.connect, self.mission.vehicles)

    async def connect_one(self, part: VehicleFlight) -> None:
        """Hear one vehicle, and its companion where one is needed."""
        await self._preparation.connect(part.vehicle)

    async def make_plan(self) -> None:
        """Let the cloud planner plan for the whole fleet.

        Raises:
            PreflightError: there is no feasible plan; says what keeps it from being one.
        """
        plan = await self.try_plan()
        if not plan.feasible:
            raise PreflightError("no feasible plan: " + "; ".join(str(violation) for violation in plan.violations))
        self.take_plan(plan)

    async def try_plan(self) -> FleetPlan:
        """Let the planner plan, and keep what came of it among the candidates, feasible or not."""
        self.events.add("plan", f"planning {self.mission.name} for {len(self.mission.vehicles)} vehicles")
        plan = await self.planner(self.mission)
        self.candidates[plan.algorithm] = plan
        verdict = "plan found" if plan.feasible else f"no feasible plan by {plan.algorithm}"
        text = f"{verdict} in {plan.wall_s:.2f} s, objective {plan.objective:.1f}"
        self.events.add("planned", text, objective=plan.objective, evaluations=plan.evaluations)
        return plan

    def take_best_plan(self) -> None:
        """Fly the candidate with the least objective among those that are feasible.

        Raises:
            PreflightError: there is none.
        """
        feasible = [plan for plan in self.candidates.values() if plan.feasible]
        if not feasible:
            raise PreflightError("no algorithm has found a feasible plan")
        self.take_plan(min(feasible, key=lambda plan: plan.objective))

    def take_plan(self, plan: FleetPlan) -> None:
        """Fly this plan; nothing of it is stored on a vehicle yet."""
        self.plan = plan
        self.vehicles = {part.sysid: self._vehicle_flight(part) for part in plan.vehicles}

    async def prepare(self, parts: Parts | None = None) -> None:
        """Check vehicles (all, unless some are named), set what is needed, and store their fences and missions."""
        assert self.plan is not None
        curves_m, preparation = [part.curve_m for part in self.plan.vehicles], self._preparation
        await _for_all(lambda flight: preparation.prepare(flight, curves_m), self._these(parts))

    async def launch(self) -> None:
        """Arm what is not armed and take off, one shortly after the other; ends when all hover.

        Raises:
            FlightAborted: a vehicle did not get to hover; all are back on the ground, or landing.
        """
        try:
            for flight in self.vehicles.values():
                await self._climb(flight)
                await asyncio.sleep(STAGGER_S / self.speed)
            await _for_all(self.orders.hover, self.vehicles.values())
        except GcsError as problem:
            await self._abort_launch(str(problem))
            raise FlightAborted(f"take-off broken off: {problem}") from problem

    async def take_off(self, flight: VehicleFlight) -> None:
        """Let one vehicle take off, armed or not yet; ends when it hovers, or is landing again.

        Raises:
            FlightAborted: it did not get to hover.
        """
        try:
            await self._climb(flight)
            await self.orders.hover(flight)
        except GcsError as problem:
            await self.orders.break_off(flight, str(problem))
            raise FlightAborted(f"take-off broken off: {problem}") from problem

    async def start(self, parts: Parts | None = None) -> None:
        """Start the mission on vehicles (all, unless some are named) at once; what cannot be started is landed."""
        await _for_all(self._start, self._these(parts))

    async def watch(self) -> None:
        """Follow the flight until no vehicle is in flight any more; replan it meanwhile where both sides plan."""
        async with asyncio.TaskGroup() as orders:
            replanning = orders.create_task(self._replan(), name="replanning")
            while self.in_flight:
                for flight in self.in_flight:
                    self._watch_one(flight, orders)
                await asyncio.sleep(WATCH_INTERVAL_S / self.speed)
            replanning.cancel()

    async def hold_all(self, reason: str) -> None:
        """Leave everything that flies holding, as well as the links allow."""
        parts = self.in_flight
        orders = [self.orders.command(flight, actions.set_mode(Mode.HOLD)) for flight in parts]
        for flight, outcome in zip(parts, await asyncio.gather(*orders, return_exceptions=True), strict=True):
            state = "holding" if outcome is None else f"not confirmed: {outcome}"
            flight.monitor.give_up(f"{reason}; {state}")

    def state(self, sysid: int) -> VehicleState:
        return self.station.vehicle(sysid)

    @property
    def _preparation(self) -> Preparation:
        return Preparation(self.station, self.mission, self.mode, self.events, self.speed)

    def _these(self, parts: Parts | None) -> list[VehicleFlight]:
        return list(self.vehicles.values() if parts is None else parts)

    def _in_phase(self, phase: Phase) -> list[VehicleFlight]:
        return [flight for flight in self.vehicles.values() if flight.monitor.phase is phase]

    def _vehicle_flight(self, plan: VehiclePlan) -> VehicleFlight:
        mission = self.mission
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
            route=RouteWatch(plan.targets[:-1], mission.site.arrival_tolerance_m),
        )
        return VehicleFlight(mission.vehicle(plan.sysid), monitor, plan)

    async def _climb(self, flight: VehicleFlight) -> None:
        """Arm, unless that was done before and holds still: an autopilot disarms when no take-off follows soon."""
        if not self.state(flight.sysid).armed:
            await self.orders.arm(flight)
        await self.orders.take_off(flight)

    async def _start(self, flight: VehicleFlight) -> None:
        try:
            await self.orders.start(flight)
        except GcsError as problem:
            self.events.add("refused", str(problem), flight.name, Severity.ERROR)
            if flight.monitor.phase is not Phase.INTERRUPTED:
                flight.monitor.come_down(f"its mission could not be started: {problem}")
                await self._order(flight, Mode.LAND)

    def _watch_one(self, flight: VehicleFlight, orders: asyncio.TaskGroup) -> None:
        before = flight.monitor.phase
        now_s, order = self.station.now_s, None
        if flight.sysid in self.sought:
            flight.monitor.miss(now_s)
        else:
            order = flight.monitor.step(self.state(flight.sysid), now_s)
        if flight.monitor.phase is not before:
            severity = Severity.INFO if flight.monitor.reached or not flight.monitor.reason else Severity.WARNING
            text = f"{before.value} -> {flight.monitor.phase.value}: {flight.monitor.reason}".rstrip(": ")
            self.events.add("phase", text, flight.name, severity, phase=flight.monitor.phase.value)
        if order is not None and self.passive:
            text = f"advised: {order.name.lower()}; after a restart nothing is commanded without an order"
            self.events.add("advice", text, flight.name, Severity.WARNING)
        elif order is not None:
            orders.create_task(self._order(flight, order), name=f"{order.name} to {flight.name}")

    async def _replan(self) -> None:
        if not self.passive:
            await self.cloud.run()

    async def _order(self, flight: VehicleFlight, mode: Mode) -> None:
        try:
            with acting_as(Origin.MONITOR):
                await self.orders.command(flight, actions.set_mode(mode))
        except (CommandRefused, LinkLost) as problem:
            self.events.add("refused", str(problem), flight.name, Severity.ERROR)
            if mode is Mode.LAND:
                flight.monitor.order_failed(self.station.now_s)

    async def _abort_launch(self, reason: str) -> None:
        self.events.add("aborted", reason, severity=Severity.ERROR)
        for flight in self.vehicles.values():
            await self.orders.break_off(flight, reason)


async def _for_all(step: Callable[[T], Awaitable[None]], parts: Iterable[T]) -> None:
    """Do one step for all vehicles at once; the first failure cancels the others and is raised as it is."""
    try:
        async with asyncio.TaskGroup() as group:
            for part in parts:
                group.create_task(_awaited(step(part)))
    except* GcsError as failures:
        raise failures.exceptions[0] from None


async def _awaited(step: Awaitable[None]) -> None:
    await step
