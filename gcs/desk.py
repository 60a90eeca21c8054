"""The operator's desk: everything that can be seen and done in a session, for the page and for headless runs alike.

The page reads the desk's state and hands in intents; a headless run hands in one, FLY. The desk says of every intent
whether it can be done now, and if not, why.
"""

import asyncio
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from enum import Enum

from gcs.dialect import AUTOPILOT, Mode
from gcs.errors import GcsError
from gcs.fleet.vehicle_state import VehicleState
from gcs.flight import actions
from gcs.flight.events import EventLog, Severity, severity_of
from gcs.flight.monitor import Phase
from gcs.flight.sequence import FleetFlight
from gcs.flight.trails import Trails
from gcs.flight.vehicle_flight import VehicleFlight
from gcs.microservices.command_client import CommandClient
from gcs.planner.plan import Progress
from gcs.replay.player import Player
from gcs.security.audit import Origin, acting_as
from gcs.station import Station
from missions.errors import MissionError
from missions.mission import Mission


class Intent(Enum):
    """What an operator can ask for."""

    PLAN = "Plan"
    UPLOAD = "Upload"
    FLY = "Fly"
    HOLD = "Hold"
    RESUME = "Resume"
    RTL = "RTL"
    LAND = "Land"

    @property
    def concerns_vehicles(self) -> bool:
        """It is asked of single vehicles; the others concern the whole flight."""
        return self in {Intent.HOLD, Intent.RESUME, Intent.RTL, Intent.LAND}


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
    plan_progress: list[Progress] = field(default_factory=list)
    """Of the plan that is being made, or was made last."""
    running: Intent | None = None
    """The step of the whole flight that is under way."""
    player: Player | None = None
    """What is shown is a recording: nothing can be commanded, but time can be moved."""
    simulated: bool = False
    """The vehicles fly in the bundled simulator, so what the mission keeps from its planners is there, too."""

    def __post_init__(self) -> None:
        self._tasks: set[asyncio.Task[None]] = set()
        self._texts_heard_s: dict[int, float] = {}

    @property
    def mission(self) -> Mission | None:
        return self.flight.mission if self.flight else None

    @property
    def vehicles(self) -> dict[int, VehicleState]:
        return self.station.fleet.vehicles

    def on_plan_progress(self, progress: Progress) -> None:
        if self.plan_progress and progress.evaluations < self.plan_progress[-1].evaluations:
            self.plan_progress.clear()
        self.plan_progress.append(progress)

    def collect_texts(self) -> None:
        """Take what the autopilots have said since the last call into the event log; a recording's log has it."""
        if self.player is not None:
            return
        for sysid, state in self.vehicles.items():
            heard_s = self._texts_heard_s.get(sysid, -math.inf)
            name = self._name(sysid)
            for said in [text for text in state.texts if text.time_s > heard_s]:
                self.events.add("said", said.text, name, severity_of(said.severity))
                self._texts_heard_s[sysid] = said.time_s

    def why_not(self, intent: Intent, sysids: Iterable[int] = ()) -> str | None:
        """Why an intent cannot be done now, as a phrase; None if it can."""
        if self.player is not None:
            return "this is a recording"
        if not intent.concerns_vehicles:
            return self._why_not_fleet(intent)
        chosen = list(sysids)
        if not chosen:
            return "no vehicle is selected"
        reasons = [self._why_not_vehicle(intent, sysid) for sysid in chosen]
        return None if None in reasons else reasons[0]

    def request(self, intent: Intent, sysids: Iterable[int] = ()) -> None:
        """Begin what the operator asks for; how it goes is told in the event log.

        Call it on the event loop's thread.
        """
        why_not = self.why_not(intent, chosen := list(sysids))
        if why_not is not None:
            self.events.add("refused", f"{intent.value} is not possible: {why_not}", severity=Severity.WARNING)
            return
        task = asyncio.get_running_loop().create_task(self._perform(intent, chosen), name=intent.value)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

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

    async def _perform(self, intent: Intent, sysids: list[int]) -> None:
        try:
            if intent.concerns_vehicles:
                with acting_as(Origin.OPERATOR):
                    await asyncio.gather(*(self._order(intent, sysid) for sysid in sysids))
            else:
                await self._step(intent, self._fleet_step(intent))
        except (GcsError, MissionError) as problem:
            self.events.add("failed", f"{intent.value}: {problem}", severity=Severity.ERROR)

    async def _step(self, intent: Intent, step: Callable) -> None:
        self.running = intent
        try:
            await step()
        finally:
            self.running = None

    def _fleet_step(self, intent: Intent) -> Callable:
        assert self.flight is not None
        steps = {Intent.PLAN: self.flight.make_plan, Intent.UPLOAD: self._upload, Intent.FLY: self.flight.fly}
        return steps[intent]

    async def _upload(self) -> None:
        assert self.flight is not None
        await self.flight.connect()
        await self.flight.prepare()

    async def _order(self, intent: Intent, sysid: int) -> None:
        """One order to one vehicle; a vehicle to which it does not apply is left alone."""
        if self._why_not_vehicle(intent, sysid) is not None:
            return
        part = self._part(sysid)
        if self.flight is None or part is None:
            mode = {Intent.HOLD: Mode.HOLD, Intent.RTL: Mode.RTL, Intent.LAND: Mode.LAND}[intent]
            self.events.add("command", intent.value, f"vehicle {sysid}")
            await self.station.run(CommandClient(actions.set_mode(mode), (sysid, AUTOPILOT)))
            return
        orders = {
            Intent.HOLD: self.flight.orders.hold,
            Intent.RESUME: self.flight.orders.start,
            Intent.RTL: self.flight.orders.return_home,
            Intent.LAND: self.flight.orders.land,
        }
        await orders[intent](part)

    def _part(self, sysid: int) -> VehicleFlight | None:
        return self.flight.vehicles.get(sysid) if self.flight else None

    def _name(self, sysid: int) -> str:
        planned = self.mission.vehicles if self.mission is not None else ()
        return next((vehicle.name for vehicle in planned if vehicle.sysid == sysid), f"vehicle {sysid}")

    def _why_not_fleet(self, intent: Intent) -> str | None:
        if self.flight is None:
            return "no mission is loaded"
        if self.running is not None:
            return f"{self.running.value} is under way"
        phases = {part.monitor.phase for part in self.flight.vehicles.values()}
        if any(phase.in_flight for phase in phases):
            return "vehicles are in flight"
        if Phase.DONE in phases:
            return "this mission has been flown"
        if intent is Intent.UPLOAD and self.flight.plan is None:
            return "there is no plan yet"
        return None

    def _why_not_vehicle(self, intent: Intent, sysid: int) -> str | None:
        state, part = self.vehicles.get(sysid), self._part(sysid)
        if state is None or not state.online(self.station.now_s):
            return "not heard"
        if not state.armed:
            return "not in flight"
        if intent is Intent.RESUME and (part is None or part.monitor.phase is not Phase.INTERRUPTED):
            return "nothing was interrupted"
        already = {Intent.HOLD: Mode.HOLD, Intent.RTL: Mode.RTL, Intent.LAND: Mode.LAND}.get(intent)
        return f"already in {state.mode.name.lower()}" if already is state.mode else None
