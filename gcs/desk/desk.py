"""The one door of a session: the page reads the desk's state and hands in intents; a headless run hands in one, FLY.

The desk says of every intent whether it can be done now, and if not, why; what it has begun stands in its book of
orders until it was accepted, refused or has failed.
"""

import asyncio
import math
from collections.abc import Awaitable, Callable, Iterable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import numpy.typing as npt

from gcs.desk import rules
from gcs.desk.intents import NO_DETAILS, Details, Intent, NewMission
from gcs.desk.observations import Observations
from gcs.desk.orderly import carry_out
from gcs.desk.orders import Order, OrderBook, OrderState, outcome_of
from gcs.desk.seat import CommandSeat
from gcs.errors import GcsError
from gcs.fleet.flood_gate import FloodGate
from gcs.fleet.status_texts import URGENT, StatusText
from gcs.fleet.vehicle_state import VehicleState
from gcs.flight.events import EventLog, Severity, severity_of
from gcs.flight.sequence import FleetFlight
from gcs.flight.trails import Trails
from gcs.flight.vehicle_flight import VehicleFlight
from gcs.planner.plan import Progress
from gcs.replay.player import Player
from gcs.security.audit import Origin, acting_as
from gcs.settings import PlanningMode
from gcs.station import Station
from missions.errors import MissionError
from missions.faults import SimulatorFault
from missions.mission import Mission

MOST_QUOTED, QUOTED_WINDOW_S = 100, 10.0
"""What all vehicles together may say in a while, beside what is urgent: somebody may make up many of them."""
REPEATED_S = 10.0
"""A vehicle that says the same again within this time is not quoted again [s]."""

Opener = Callable[[NewMission | None, PlanningMode | None], Awaitable[None]]
"""Opens another mission, or the same one in another mode, and puts its flight onto the desk."""


class PlannerChoice(Protocol):
    """The planner, as far as the desk chooses it."""

    algorithm: str
    algorithms: tuple[str, ...]


class SimulatorControl(Protocol):
    """The bundled simulator's control port."""

    async def order(self, fault: SimulatorFault, sysid: int) -> None:
        """Let something go wrong with a vehicle; a GcsError says that the simulator would not, or did not answer."""
        ...


@dataclass
class Desk:
    """One session.

    Args:
        station: the links, and the state of all vehicles that were heard.
        events: the log.
        flight: the flight of a mission, or None when only watching.
        trails: where the vehicles have been; None until a frame is known.
    """

    station: Station
    events: EventLog
    flight: FleetFlight | None = None
    trails: Trails | None = None
    plan_progress: list[Progress] = field(default_factory=list[Progress])
    """Of the plan that is being made, or was made last."""
    running: Intent | None = None
    """The step of the whole flight that is under way."""
    player: Player | None = None
    """What is shown is a recording: nothing can be commanded, but time can be moved."""
    simulated: bool = False
    """The vehicles fly in the bundled simulator, so what the mission keeps from its planners is there, too."""
    opener: Opener | None = None
    planner: PlannerChoice | None = None
    simulator: SimulatorControl | None = None
    taken_over: asyncio.Event = field(default_factory=asyncio.Event)
    """Set once somebody has asked for something: from then on nothing begins by itself."""
    begins_s: float | None = None
    """When the flight begins by itself, on the station's clock; None if it waits for an operator."""

    def __post_init__(self) -> None:
        self.orders = OrderBook(self._log_order)
        self.seat = CommandSeat(lambda text: self.events.add("seat", text, severity=Severity.WARNING))
        self.observations = Observations()
        self._tasks: set[asyncio.Task[None]] = set()
        self._step_task: asyncio.Task[None] | None = None
        self._watcher: asyncio.Task[None] | None = None
        self._texts_heard_s: dict[int, float] = {}
        self._quoted_s: dict[tuple[int, str], float] = {}
        self._gates = {urgent: FloodGate(MOST_QUOTED, QUOTED_WINDOW_S) for urgent in (True, False)}

    @property
    def mission(self) -> Mission | None:
        return self.flight.mission if self.flight else None

    @property
    def vehicles(self) -> dict[int, VehicleState]:
        return self.station.fleet.vehicles

    def part(self, sysid: int) -> VehicleFlight | None:
        """A vehicle's part in the flight, if it has one."""
        return self.flight.vehicles.get(sysid) if self.flight else None

    def name(self, sysid: int) -> str:
        planned = self.mission.vehicles if self.mission is not None else ()
        return next((vehicle.name for vehicle in planned if vehicle.sysid == sysid), f"vehicle {sysid}")

    def position_m(self, sysid: int) -> npt.NDArray[np.float64] | None:
        """(3,) where a vehicle is, in the frame of the page; None if nobody knows."""
        if sysid not in self.vehicles or self.trails is None:
            return None
        part = self.part(sysid)
        return self.vehicles[sysid].position_m(self.trails.frame, part.monitor.ground_offset_m if part else 0.0)

    def on_plan_progress(self, progress: Progress) -> None:
        if self.plan_progress and progress.evaluations < self.plan_progress[-1].evaluations:
            self.plan_progress.clear()
        self.plan_progress.append(progress)

    def collect_texts(self) -> None:
        """Take what the autopilots have said since the last call into the event log; repetitions are left out.

        A recording's log has it already.
        """
        if self.player is not None:
            return
        for sysid, state in self.vehicles.items():
            heard_s = self._texts_heard_s.get(sysid, -math.inf)
            for said in [text for text in state.texts if text.time_s > heard_s]:
                self._texts_heard_s[sysid] = said.time_s
                if said.time_s - self._quoted_s.get((sysid, said.text), -math.inf) > REPEATED_S:
                    self._quote(sysid, said)
        old = [key for key, quoted_s in self._quoted_s.items() if self.station.now_s - quoted_s > REPEATED_S]
        for key in old:
            del self._quoted_s[key]

    def _quote(self, sysid: int, said: StatusText) -> None:
        self._quoted_s[sysid, said.text] = said.time_s
        if self._gates[said.severity <= URGENT].admits(self.station.now_s):
            self.events.add("said", said.text, self.name(sysid), severity_of(said.severity))

    def observe(self, now_s: float) -> None:
        """Bring up to date what is watched over time; call it often."""
        self.collect_texts()
        self.observations.observe(self, now_s)

    def why_not(self, intent: Intent, sysids: Iterable[int] = ()) -> str | None:
        """Why an intent cannot be done now, as a phrase; None if it can."""
        if self.player is not None:
            return "this is a recording"
        if not intent.concerns_vehicles:
            return rules.why_not_flight(self, intent)
        chosen = list(sysids)
        if not chosen:
            return "no vehicle is selected"
        first: str | None = None
        for sysid in chosen:
            why_not = rules.why_not_vehicle(self, intent, sysid)
            if why_not is None:
                return None
            first = first or why_not
        return first

    def request(
        self, intent: Intent, sysids: Iterable[int] = (), details: Details = NO_DETAILS, by: str | None = None
    ) -> str | None:
        """Begin what the operator asks for; how it goes is told in the book of orders and the event log.

        Call it on the event loop's thread.

        Args:
            intent: what.
            sysids: of whom, where it concerns vehicles.
            details: what the intent needs beside.
            by: key of who asks, as the seat knows it; None is the program itself.

        Returns:
            why it cannot be done, as a phrase; None if it was begun.
        """
        chosen = list(sysids)
        why_not = self.seat.why_not(by) or self.why_not(intent, chosen)
        if why_not is not None:
            self.events.add(
                "refused", f"{intent.value} is not possible: {why_not}", severity=Severity.WARNING, by=self._origin(by)
            )
            return why_not
        self.taken_over.set()
        if intent is Intent.CANCEL:
            self.cancel(by)
        elif intent is Intent.WAIT:
            pass
        elif intent.concerns_vehicles:
            for sysid in chosen:
                if rules.why_not_vehicle(self, intent, sysid) is None:
                    order = self._enter(intent, sysid, by)
                    self._begin(self._perform(order, lambda sysid=sysid: carry_out(self, intent, sysid, details)))
        else:
            order = self._enter(intent, None, by)
            self._step_task = self._begin(self._perform(order, lambda: self._fleet_step(intent, details)))
        return None

    def cancel(self, by: str | None = None) -> None:
        """End the step of the whole flight that is under way."""
        if self._step_task is not None and self.running is not None:
            self.events.add("cancelled", f"{self.running.value} is cancelled", by=self._origin(by))
            self._step_task.cancel()

    async def close(self) -> None:
        """End what is still under way."""
        for task in list(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def fly(self) -> None:
        """The whole flight, as the FLY intent does it, but with its errors raised.

        Raises:
            GcsError: see `FleetFlight.fly`.
            MissionError: the mission cannot be planned for.
        """
        assert self.flight is not None
        await self._step(Intent.FLY, self.flight.fly)

    async def follow(self) -> None:
        """Follow a flight that is in the air already, as FLY does once all have started."""
        assert self.flight is not None
        await self._step(Intent.FLY, self.flight.watch)

    def _enter(self, intent: Intent, sysid: int | None, by: str | None) -> Order:
        who = self.name(sysid) if sysid is not None else "the flight"
        return self.orders.enter(Order(intent, sysid, who, by, self.station.now_s))

    def _begin(self, work: Awaitable[None]) -> asyncio.Task[None]:
        task = asyncio.get_running_loop().create_task(_awaited(work))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    async def _perform(self, order: Order, work: Callable[[], Awaitable[None]]) -> None:
        origin = Origin.SEQUENCE if order.sysid is None else Origin.OPERATOR
        try:
            with acting_as(origin):
                await work()
        except (GcsError, MissionError) as problem:
            self.orders.close(order, outcome_of(problem), str(problem))
            vehicle = order.who if order.sysid is not None else None
            self.events.add("failed", f"{order.intent.value}: {problem}", vehicle, Severity.ERROR)
        except asyncio.CancelledError:
            self.orders.close(order, OrderState.CANCELLED)
            raise
        else:
            self.orders.close(order, OrderState.ACCEPTED)
        finally:
            self._watch_flight()

    async def _fleet_step(self, intent: Intent, details: Details) -> None:
        if intent in {Intent.LOAD, Intent.MODE}:
            assert self.opener is not None
            opener = self.opener
            await self._step(intent, lambda: opener(details.new, details.mode))
            return
        assert self.flight is not None
        flight = self.flight
        if intent is Intent.ALGORITHM and self.planner is not None and details.algorithm is not None:
            self.planner.algorithm = details.algorithm
            return
        if intent is Intent.REPLAN:
            flight.cloud.edit(flight.mission)  # nothing has changed but that a new plan is wanted
            return
        steps = {Intent.PLAN: flight.make_plan, Intent.COMPARE: self._compare, Intent.FLY: flight.fly}
        await self._step(intent, steps[intent])

    async def _compare(self) -> None:
        """Let every algorithm make its plan; the best one is taken, and the choice stays as it was."""
        assert self.flight is not None
        assert self.planner is not None
        chosen = self.planner.algorithm
        try:
            for algorithm in self.planner.algorithms:
                self.planner.algorithm = algorithm
                self.plan_progress.clear()
                await self.flight.try_plan()
        finally:
            self.planner.algorithm = chosen
        self.flight.take_best_plan()

    async def _step(self, intent: Intent, step: Callable[[], Awaitable[None]]) -> None:
        self.running = intent
        try:
            await step()
        finally:
            self.running = None

    def _watch_flight(self) -> None:
        """Follow what flies without FLY, which watches by itself."""
        idle = self._watcher is None or self._watcher.done()
        if self.flight is not None and self.flight.in_flight and self.running is not Intent.FLY and idle:
            self._watcher = self._begin(self.flight.watch())

    def _log_order(self, order: Order) -> None:
        text = f"{order.intent.value}: {order.state.value}" + (f", {order.reason}" if order.reason else "")
        vehicle = order.who if order.sysid is not None else None
        self.events.add("order", text, vehicle, by=self._origin(order.by), state=order.state.value)

    def _origin(self, by: str | None) -> str:
        return "the program" if by is None else self.seat.present.get(by, by)


async def _awaited(work: Awaitable[None]) -> None:
    await work
