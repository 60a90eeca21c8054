"""Who else is there: the last word of every other vehicle, and what may be believed of it.

Whatever comes from outside is checked, and counted where it is dropped. There is one record for each of 250 system
ids at most, and each holds a fixed number of messages.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import msgspec
import numpy as np
import numpy.typing as npt

from companion.fleet.fleet_settings import FleetSettings
from companion.fleet.lag import Lag
from companion.fleet.motion import straight_on
from companion.fleet.neighbour import Neighbour
from companion.fleet.reports import PlanReport, PositionReport, Report
from missions.mission import Mission
from missions.trajectory import Trajectory, at_rest
from missions.tunnel import TrajectoryKind, TrajectoryMessage

Array = npt.NDArray[np.float64]
Order = tuple[float, int]
"""When a plan was announced (UTC), and by whom: the smaller goes first."""

LARGEST_SYSTEM_ID = 250
NEARBY_M = 100.0
"""Farther outside of the flight range nobody is in the way."""
FASTEST = 5.0
"""Nobody flies faster than so many times the mission's cruise speed, and 10 m/s."""
LARGEST_RADIUS_M = 3.0
LONGEST_S = 600.0
"""No trajectory takes longer."""
HELD_S = 1.0
"""A plan that was announced and has not been flown so long after it should have begun will not be flown."""


@dataclass(frozen=True)
class Said:
    """A plan, on this vehicle's clock.

    Args:
        message: its times are UTC, but for the trajectory's.
        trajectory: on this vehicle's clock.
        sent_s: when its last copy was sent, on this vehicle's clock.
    """

    message: TrajectoryMessage
    trajectory: Trajectory
    sent_s: float

    @property
    def key(self) -> tuple[float, int]:
        """Later plans have larger ones, also after a companion has started anew."""
        return self.message.announced_s, self.message.revision


@dataclass
class Known:
    """All that one vehicle has said."""

    flown: Said | None = None
    pending: Said | None = None
    """Announced, and not flown yet."""
    wanted: Said | None = None
    position: PositionReport | None = None
    position_s: float = float("-inf")
    """When it was there, on this vehicle's clock."""
    lag: Lag = field(default_factory=Lag)


class Roster:
    """The other vehicles of a fleet.

    Args:
        sysid: of this vehicle.
        mission: limits and flight range.
        settings: of the exchange.
    """

    def __init__(self, sysid: int, mission: Mission, settings: FleetSettings) -> None:
        self._sysid = sysid
        self._limits = mission.limits
        self._settings = settings
        bounds = mission.world.bounds
        self._low_m, self._high_m = np.array(bounds.low_enu_m) - NEARBY_M, np.array(bounds.high_enu_m) + NEARBY_M
        self._fastest_m_s = max(FASTEST * mission.limits.cruise_speed_m_s, 10.0)
        self.known: dict[int, Known] = {}
        self.changes = 0
        """Counts everything that may change what others are believed to do."""
        self.dropped: Counter[str] = Counter()
        """What was not believed, by reason."""

    def hear(self, report: Report, now_s: float, ahead_s: float | None) -> None:
        """Take in a report.

        Args:
            report: from outside; anything may be in it.
            now_s: this vehicle's time.
            ahead_s: how far UTC is ahead of that; None when it is not known.
        """
        problem = self._problem(report, now_s, ahead_s)
        if problem:
            self.dropped[problem] += 1
            return
        known = self.known.setdefault(report.sysid, Known())
        if isinstance(report, PositionReport):
            self._place(known, report, now_s, ahead_s)
        elif ahead_s is not None:
            self._note(known, report.message, now_s, ahead_s)

    def neighbours(self, now_s: float, before: Order | None = None) -> list[Neighbour]:
        """What the others do, as far as is known.

        Args:
            now_s: this vehicle's time.
            before: plans that are not flown yet count, too, if they were announced before this.
        """
        return [n for sysid, known in self.known.items() for n in self._of(sysid, known, now_s, before)]

    def longest_lag_s(self, now_s: float) -> float | None:
        """The longest that anybody's word took lately; None when nobody was heard."""
        longest_s = max((known.lag.longest_s(now_s) for known in self.known.values()), default=float("-inf"))
        return longest_s if np.isfinite(longest_s) else None

    def wanted(self, now_s: float) -> Iterator[tuple[int, Said]]:
        """(system id, plan) of those who cannot go on because somebody is in their way."""
        for sysid, known in self.known.items():
            if known.wanted is not None and now_s - known.wanted.sent_s < self._settings.stale_s:
                yield sysid, known.wanted

    # ---------------------------------------------------------------- taking in

    def _problem(self, report: Report, now_s: float, ahead_s: float | None) -> str:
        """Why a report is not believed; empty when it is."""
        if report.sysid == self._sysid:
            return "our own system id"
        if not 1 <= report.sysid <= LARGEST_SYSTEM_ID:
            return "no system id of a vehicle"
        if isinstance(report, PositionReport):
            return self._problem_of_position(report)
        if ahead_s is None:
            return "no common clock"
        return self._problem_of_plan(report, now_s + ahead_s)

    def _problem_of_position(self, report: PositionReport) -> str:
        numbers = np.concatenate((report.position_m, report.velocity_m_s, [report.error_m]))
        if not np.all(np.isfinite(numbers)):
            return "no position"
        if not self._is_nearby(report.position_m[None, :]):
            return "far away"
        return "too fast" if np.linalg.norm(report.velocity_m_s) > self._fastest_m_s else ""

    def _problem_of_plan(self, report: PlanReport, utc_s: float) -> str:
        message, settings = report.message, self._settings
        trajectory = message.trajectory
        lag_s = utc_s - message.announced_s - message.age_s
        if not -settings.clock_bound_s <= lag_s <= settings.latest_s:
            return "another clock"
        starts_in_s = trajectory.start_s - message.announced_s
        if starts_in_s > LONGEST_S or trajectory.duration_s > LONGEST_S:
            return "another time"
        if not self._is_nearby(trajectory.control_points_m):
            return "far away"
        steps_m = np.linalg.norm(np.diff(trajectory.control_points_m, axis=0), axis=1)
        return "too fast" if steps_m.max() > self._fastest_m_s * trajectory.knot_interval_s else ""

    def _is_nearby(self, points_m: Array) -> bool:
        return bool(np.all(points_m >= self._low_m) and np.all(points_m <= self._high_m))

    def _place(self, known: Known, report: PositionReport, now_s: float, ahead_s: float | None) -> None:
        at_s = now_s
        if report.utc_s is not None and ahead_s is not None:
            lag_s = now_s + ahead_s - report.utc_s
            if -self._settings.clock_bound_s <= lag_s <= self._settings.latest_s:
                known.lag.add(lag_s, now_s)
                at_s = now_s - max(lag_s, 0.0)
        if at_s < known.position_s:
            self.dropped["overtaken"] += 1
            return
        known.position, known.position_s = report, at_s
        if known.flown is None or not self._flies(known.flown, known, now_s):
            self.changes += 1

    def _note(self, known: Known, message: TrajectoryMessage, now_s: float, ahead_s: float) -> None:
        lag_s = max(now_s + ahead_s - message.announced_s - message.age_s, 0.0)
        known.lag.add(lag_s, now_s)
        own = replace(message.trajectory, start_s=message.trajectory.start_s - ahead_s)
        radius_m = min(message.radius_m, LARGEST_RADIUS_M)
        said = Said(msgspec.structs.replace(message, radius_m=radius_m), own, now_s - lag_s)
        place = {TrajectoryKind.OPTIMISED: "pending", TrajectoryKind.WANTED: "wanted"}.get(message.kind, "flown")
        before: Said | None = getattr(known, place)
        if (before is not None and said.key < before.key) or (place == "pending" and _is_flown(said, known)):
            self.dropped["overtaken"] += 1
            return
        if before is not None and said.key == before.key:
            said = replace(before, sent_s=max(said.sent_s, before.sent_s))
        else:
            self.changes += 1
        setattr(known, place, said)
        if place == "flown" and known.pending is not None and _is_flown(known.pending, known):
            known.pending = None

    # ---------------------------------------------------------------- giving out

    def _of(self, sysid: int, known: Known, now_s: float, before: Order | None) -> Iterator[Neighbour]:
        flown, pending = known.flown, known.pending
        if flown is not None and self._flies(flown, known, now_s):
            yield self._neighbour(sysid, flown, now_s)
        elif known.position is not None:
            yield self._foretold(sysid, known.position, known.position_s, now_s)
        if pending is None or before is None or (pending.message.announced_s, sysid) >= before:
            return
        if now_s < pending.trajectory.start_s + HELD_S:
            yield self._neighbour(sysid, pending, now_s)

    def _flies(self, flown: Said, known: Known, now_s: float) -> bool:
        """A vehicle does what it said; a position may tell otherwise."""
        settings, position = self._settings, known.position
        if position is None or now_s - known.position_s > settings.stale_s:
            return True
        if now_s - flown.sent_s > settings.stale_s:
            return False  # it is there, and does not speak of this plan any more
        if known.position_s < flown.trajectory.start_s:
            return True
        off_m = float(np.linalg.norm(flown.trajectory.at(known.position_s).position_m - position.position_m))
        return off_m <= max(settings.off_plan_m, position.error_m)

    def _neighbour(self, sysid: int, said: Said, now_s: float) -> Neighbour:
        silent_s = now_s - said.sent_s - self._settings.stale_s
        radius_m = said.message.radius_m + self._growth_m(silent_s)
        return Neighbour(sysid, said.trajectory, radius_m, said.message.kind, said.sent_s)

    def _foretold(self, sysid: int, report: PositionReport, at_s: float, now_s: float) -> Neighbour:
        radius_m = self._limits.body_radius_m + min(report.error_m, LARGEST_RADIUS_M)
        if report.on_ground:
            return Neighbour(sysid, at_rest(report.position_m, at_s), radius_m, TrajectoryKind.COMMITTED, at_s)
        straight = straight_on(report.position_m, report.velocity_m_s, at_s, self._settings.foretold_s)
        radius_m += self._growth_m(now_s - at_s - 2.0 * self._settings.position_interval_s)
        return Neighbour(sysid, straight, radius_m, TrajectoryKind.COMMITTED, at_s)

    def _growth_m(self, silent_s: float) -> float:
        return min(max(self._settings.growth_m_s * silent_s, 0.0), self._settings.most_growth_m)


def _is_flown(pending: Said, known: Known) -> bool:
    return known.flown is not None and pending.key <= known.flown.key
