"""The exchange of plans: what this vehicle tells the others and when, and what it knows of them. Sans-IO.

A plan is told to the others before it is flown (optimised), and flown (committed) when a wait is over that is longer
than anybody's word takes, unless it collides with what was heard meanwhile. Of two plans that wait at the same time the
one that was announced first goes first, by UTC and then by system id: both vehicles know which one that is, since
each hears of the earlier plan before it may commit the later one.
"""

from dataclasses import dataclass, replace

import msgspec
import numpy as np

from companion.fleet.fleet_settings import FleetSettings
from companion.fleet.motion import with_lead_in
from companion.fleet.neighbour import Neighbour
from companion.fleet.reports import PlanReport, PositionReport, Report
from companion.fleet.roster import Order, Roster
from missions.mission import Mission
from missions.trajectory import Trajectory
from missions.tunnel import MOST_POINTS, TrajectoryKind, TrajectoryMessage

EVERYTHING: Order = (float("inf"), 0)


@dataclass
class Told:
    """Something that this vehicle tells again and again."""

    message: TrajectoryMessage
    """Its trajectory is in vehicle time, its announcement in UTC."""
    since_s: float
    due_s: float = float("-inf")
    copies: int = 0


class Exchange:
    """One vehicle's part of the fleet link.

    Args:
        sysid: of this vehicle.
        mission: limits and flight range.
        settings: times and distances.
    """

    def __init__(self, sysid: int, mission: Mission, settings: FleetSettings | None = None) -> None:
        self.sysid = sysid
        self.settings = settings or FleetSettings()
        self.roster = Roster(sysid, mission, self.settings)
        self.utc_ahead_s: float | None = None
        """How far UTC is ahead of vehicle time; without it no plan is told, nor understood."""
        self._radius_m = mission.limits.body_radius_m
        self._revision = 0
        self._flown: Told | None = None
        self._offered: Told | None = None
        self._wanted: Told | None = None
        self._position_due_s = float("-inf")

    # ---------------------------------------------------------------- listening

    def hear(self, report: Report, now_s: float) -> None:
        """Take in what another vehicle says; never raises because of what is in it."""
        self.roster.hear(report, now_s, self.utc_ahead_s)

    def neighbours(self, now_s: float, *, pending: bool = False) -> tuple[Neighbour, ...]:
        """The others, as they must be respected; the nearest of them if there are very many.

        Args:
            now_s: vehicle time.
            pending: with the plans that they have announced and do not fly yet, but for those that came after this
                vehicle's own offer.
        """
        before = self._order if pending else None
        found = self.roster.neighbours(now_s, before)
        if len(found) > self.settings.most_neighbours and self._flown is not None:
            here_m = self._flown.message.trajectory.at(now_s).position_m
            found.sort(key=lambda n: float(np.linalg.norm(n.trajectory.at(now_s).position_m - here_m)))
        return tuple(found[: self.settings.most_neighbours])

    def wait_s(self, now_s: float) -> float:
        """How long a plan is announced before it is flown; 0 when nobody is there to hear of it."""
        lag_s = self.roster.longest_lag_s(now_s)
        if lag_s is None or self.utc_ahead_s is None:
            return 0.0
        settings = self.settings
        return min(max(lag_s + settings.wait_margin_s, settings.least_wait_s), settings.longest_wait_s)

    # ----------------------------------------------------------------- speaking

    def offer(self, trajectory: Trajectory, plan_id: int, rank: int, now_s: float) -> None:
        """Announce a plan that shall be flown if nobody's is in its way."""
        self._offered = self._telling(TrajectoryKind.OPTIMISED, self._led_in(trajectory, now_s), plan_id, rank, now_s)

    def commit_offer(self) -> TrajectoryMessage:
        """What was offered is flown; the message with its trajectory, in vehicle time."""
        assert self._offered is not None
        message = msgspec.structs.replace(self._offered.message, kind=TrajectoryKind.COMMITTED)
        self._flown, self._offered, self._wanted = Told(message, self._offered.since_s), None, None
        return message

    def withdraw(self) -> None:
        """What was offered will not be flown."""
        self._offered = None

    def fly(self, kind: TrajectoryKind, trajectory: Trajectory, plan_id: int, rank: int, now_s: float) -> None:
        """Announce a plan that is flown from now on, without a wait."""
        self._offered = None
        self._flown = self._telling(kind, self._led_in(trajectory, now_s), plan_id, rank, now_s)

    def want(self, trajectory: Trajectory, plan_id: int, rank: int, now_s: float) -> None:
        """Announce where this vehicle would go if others were not in its way."""
        self._wanted = self._telling(TrajectoryKind.WANTED, trajectory, plan_id, rank, now_s)

    def end(self) -> None:
        """Nothing is flown any more that others could rely on."""
        self._flown = self._offered = self._wanted = None

    def is_position_due(self, now_s: float) -> bool:
        """The vehicle's position is to be said with the next tick."""
        return now_s >= self._position_due_s

    def tick(self, place: PositionReport | None, now_s: float) -> list[Report]:
        """What is to be said now, in UTC."""
        reports: list[Report] = []
        if self.utc_ahead_s is not None:
            for told in (self._flown, self._offered, self._wanted):
                if told is not None and now_s >= told.due_s:
                    reports.append(PlanReport(self.sysid, self._in_utc(told.message, now_s + self.utc_ahead_s)))
                    told.copies += 1
                    told.due_s = now_s + self._interval_s(told, now_s)
        if place is not None and self.is_position_due(now_s):
            self._position_due_s = now_s + self.settings.position_interval_s
            utc_s = None if self.utc_ahead_s is None else place.utc_s
            reports.append(replace(place, utc_s=utc_s))
        return reports

    # ------------------------------------------------------------------ details

    def _interval_s(self, told: Told, now_s: float) -> float:
        """Until something is told again."""
        settings = self.settings
        if told.copies < settings.copies_at_once:
            return 0.0
        urgent = told is self._offered or now_s - told.since_s < settings.urgent_s
        return settings.urgent_repeat_s if urgent else settings.repeat_s

    @property
    def _order(self) -> Order:
        return EVERYTHING if self._offered is None else (self._offered.message.announced_s, self.sysid)

    def _telling(self, kind: TrajectoryKind, trajectory: Trajectory, plan_id: int, rank: int, now_s: float) -> Told:
        self._revision += 1
        message = TrajectoryMessage(
            kind=kind,
            plan_id=plan_id,
            revision=self._revision,
            radius_m=self._radius_m,
            trajectory=trajectory,
            announced_s=round(now_s + (self.utc_ahead_s or 0.0), 3),
            rank=rank,
        )
        return Told(message, now_s)

    def _led_in(self, trajectory: Trajectory, now_s: float) -> Trajectory:
        """With what is flown until it begins."""
        if self._flown is None:
            return trajectory
        return with_lead_in(trajectory, self._flown.message.trajectory, now_s, MOST_POINTS)

    def _in_utc(self, message: TrajectoryMessage, utc_s: float) -> TrajectoryMessage:
        trajectory = message.trajectory
        in_utc = replace(trajectory, start_s=trajectory.start_s + (self.utc_ahead_s or 0.0))
        return msgspec.structs.replace(message, trajectory=in_utc, age_s=max(utc_s - message.announced_s, 0.0))
