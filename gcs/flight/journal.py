"""A flight's journal: what a ground station must know to find its way back into a flight after a crash.

One JSON object a line, appended while the flight goes on: how it began, each plan, what was stored on which vehicle,
and how far each has come. A torn last line is left out. The file is locked while its ground station lives.
"""

import contextlib
import fcntl
import math
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
import numpy as np

from gcs.flight.monitor import Phase
from gcs.flight.sequence import FleetFlight
from gcs.planner.plan import FleetPlan, VehiclePlan
from gcs.settings import PlanningMode
from gcs.unwritten import Unwritten, unheard
from missions.errors import WireFormatError
from missions.mission import Mission, Target
from missions.mission_items import MissionItem, Track

JOURNAL_FILE = "journal.jsonl"
MOST_BYTES = 256 << 20
Points = list[tuple[float, float, float]]


class Began(msgspec.Struct, frozen=True, kw_only=True, tag="began"):
    """A flight begins; whatever stands before it belongs to another one."""

    unix_us: int
    mission: Mission
    mode: PlanningMode
    speed: float


class PlannedVehicle(msgspec.Struct, frozen=True, kw_only=True):
    """One vehicle's part of a plan."""

    name: str
    sysid: int
    targets: tuple[Target, ...]
    curve_m: Points
    times_s: list[float]
    points_m: Points
    speeds_m_s: list[float]
    length_m: float


class Planned(msgspec.Struct, frozen=True, kw_only=True, tag="planned"):
    """A plan is flown from now on."""

    unix_us: int
    mission: Mission
    objective: float
    vehicles: tuple[PlannedVehicle, ...]
    staying: tuple[str, ...]


class Progressed(msgspec.Struct, frozen=True, kw_only=True, tag="progressed"):
    """Where one vehicle is in its flight."""

    unix_us: int
    sysid: int
    phase: Phase
    reached: bool
    reason: str
    ground_offset_m: float
    started_s: float
    offboard_losses: int
    passed: tuple[str, ...]


StoredItem = tuple[int, int, float | None, float | None, float | None, float | None, int, int, float]
"""Command, frame, four parameters, x, y and z of a mission item; JSON has null for NaN."""


class Stored(msgspec.Struct, frozen=True, kw_only=True, tag="stored"):
    """These items are on a vehicle."""

    unix_us: int
    sysid: int
    items: tuple[StoredItem, ...]


class Ended(msgspec.Struct, frozen=True, kw_only=True, tag="ended"):
    """The flight is over, and reported."""

    unix_us: int
    success: bool


Record = Began | Planned | Progressed | Stored | Ended


@dataclass
class Story:
    """What a journal tells of its last flight."""

    began: Began
    planned: Planned | None = None
    items: dict[int, tuple[MissionItem, ...]] = field(default_factory=dict[int, tuple[MissionItem, ...]])
    progress: dict[int, Progressed] = field(default_factory=dict[int, Progressed])
    ended: bool = False

    @property
    def mission(self) -> Mission:
        return self.began.mission if self.planned is None else self.planned.mission

    @property
    def aloft(self) -> list[int]:
        """System ids of the vehicles that were in flight when the journal was left off."""
        return [sysid for sysid, progress in self.progress.items() if progress.phase.in_flight]

    def take(self, record: Record) -> None:
        """Take in the next record."""
        match record:
            case Planned():
                self.planned = record
            case Stored():
                self.items[record.sysid] = tuple(_item(stored) for stored in record.items)
            case Progressed():
                self.progress[record.sysid] = record
            case Ended():
                self.ended = True
            case Began():
                pass

    def restore(self, flight: FleetFlight) -> None:
        """Put a flight where this one was left; nothing is sent."""
        flight.mission = self.mission
        if self.planned is None:
            return
        flight.take_plan(_plan(self.planned))
        for sysid, part in flight.vehicles.items():
            progress, monitor = self.progress.get(sysid), part.monitor
            if progress is None:
                continue
            monitor.phase, monitor.reached, monitor.reason = progress.phase, progress.reached, progress.reason
            monitor.ground_offset_m, monitor.started_s = progress.ground_offset_m, progress.started_s
            monitor.offboard_losses = progress.offboard_losses
            monitor.route.passed = set(progress.passed)
            if self.items.get(sysid):
                with contextlib.suppress(WireFormatError):  # of another tool: there are no stops of ours in it
                    part.take_items(self.items[sysid], flight.mission)


class JournalKeeper:
    """Writes down what is new in a flight.

    Args:
        path: appended to.
        say: takes a sentence if it can be written no longer.

    Raises:
        BlockingIOError: another ground station that lives writes this journal.
        OSError: it cannot be written.
    """

    def __init__(self, path: Path, say: Callable[[str], None] = unheard) -> None:
        self._unwritten = Unwritten("the journal", say)
        self._descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(self._descriptor)
            raise
        self._plan: FleetPlan | None = None
        self._items: dict[int, tuple[MissionItem, ...]] = {}
        self._progress: dict[int, Progressed] = {}

    def begin(self, flight: FleetFlight, unix_us: int) -> None:
        """A new flight begins."""
        self._write(Began(unix_us=unix_us, mission=flight.mission, mode=flight.mode, speed=flight.speed))

    def look(self, flight: FleetFlight, unix_us: int) -> None:
        """Write what has changed since the last call."""
        if flight.plan is not None and flight.plan is not self._plan:
            self._plan = flight.plan
            self._write(_planned(flight.plan, flight.mission, unix_us))
        for part in flight.vehicles.values():
            if part.items and part.items is not self._items.get(part.sysid):
                self._items[part.sysid] = part.items
                items = tuple(msgspec.structs.astuple(item) for item in part.items)
                self._write(Stored(unix_us=unix_us, sysid=part.sysid, items=items))
            monitor = part.monitor
            progress = Progressed(
                unix_us=0,
                sysid=part.sysid,
                phase=monitor.phase,
                reached=monitor.reached,
                reason=monitor.reason,
                ground_offset_m=monitor.ground_offset_m,
                started_s=monitor.started_s,
                offboard_losses=monitor.offboard_losses,
                passed=tuple(sorted(monitor.route.passed)),
            )
            if progress != self._progress.get(part.sysid):
                self._progress[part.sysid] = progress
                self._write(msgspec.structs.replace(progress, unix_us=unix_us))

    def end(self, success: bool, unix_us: int) -> None:
        """The flight is over."""
        self._write(Ended(unix_us=unix_us, success=success))

    def close(self) -> None:
        os.close(self._descriptor)

    def _write(self, record: Record) -> None:
        with self._unwritten:
            os.write(self._descriptor, msgspec.json.encode(record) + b"\n")


def is_written(path: Path) -> bool:
    """Whether a ground station that lives writes this journal."""
    try:
        JournalKeeper(path).close()
    except BlockingIOError:
        return True
    return False


def read_story(path: Path) -> Story | None:
    """The last flight in a journal; None where there is none, or nothing that can be understood."""
    try:
        with path.open("rb") as file:
            lines = file.read(MOST_BYTES).splitlines()
    except OSError:
        return None
    story: Story | None = None
    for line in lines:
        try:
            record = msgspec.json.decode(line, type=Record)
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
            continue  # torn by the crash
        if isinstance(record, Began):
            story = Story(record)
        elif story is not None:
            story.take(record)
    return story


def _item(stored: StoredItem) -> MissionItem:
    command, frame, *params, x, y, z = stored
    p1, p2, p3, p4 = (math.nan if value is None else value for value in params)
    return MissionItem(command=command, frame=frame, param1=p1, param2=p2, param3=p3, param4=p4, x=x, y=y, z=z)


def _planned(plan: FleetPlan, mission: Mission, unix_us: int) -> Planned:
    vehicles = tuple(
        PlannedVehicle(
            name=part.name,
            sysid=part.sysid,
            targets=part.targets,
            curve_m=part.curve_m.round(3).tolist(),
            times_s=part.times_s.round(3).tolist(),
            points_m=part.track.points_m.tolist(),
            speeds_m_s=part.track.speeds_m_s.tolist(),
            length_m=part.length_m,
        )
        for part in plan.vehicles
    )
    return Planned(unix_us=unix_us, mission=mission, objective=plan.objective, vehicles=vehicles, staying=plan.staying)


def _plan(planned: Planned) -> FleetPlan:
    vehicles = tuple(
        VehiclePlan(
            name=part.name,
            sysid=part.sysid,
            targets=part.targets,
            curve_m=np.array(part.curve_m).reshape(-1, 3),
            times_s=np.array(part.times_s),
            track=Track(np.array(part.points_m).reshape(-1, 3), np.array(part.speeds_m_s)),
            length_m=part.length_m,
        )
        for part in planned.vehicles
    )
    return FleetPlan(
        mission=planned.mission.name,
        algorithm="journal",
        seed=0,
        evaluations=0,
        wall_s=0.0,
        cpu_s=0.0,
        objective=planned.objective,
        feasible=True,
        violations=(),
        convergence=(),
        vehicles=vehicles,
        staying=planned.staying,
    )
