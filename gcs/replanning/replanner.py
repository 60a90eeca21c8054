"""When the cloud plans anew in flight, and whether what it finds is worth a change. Sans-IO."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
import numpy.typing as npt

from gcs.mapping.observed_map import ObservedMap
from gcs.planner.plan import FleetPlan
from gcs.replanning.remaining import Aloft
from missions.mission import Mission

Array = npt.NDArray[np.float64]


class Cause(Enum):
    """Why the cloud plans anew."""

    BLOCKED = "the plan is blocked by what was seen"
    EDITED = "the operator has changed the mission"
    REVIEW = "the map has changed since the plan was made"


@dataclass(frozen=True)
class Basis:
    """What a plan knows.

    Args:
        changes: of the map of what was seen, counted.
        edits: by the operator, counted.
    """

    changes: int
    edits: int


@dataclass(frozen=True)
class ReplanSettings:
    """Patience and hysteresis; times are vehicle times.

    Args:
        interval_s: between two plans that were accepted.
        retry_s: after a plan that was not feasible.
        review_s: a plan that is not blocked is looked at again so often, when the map has changed.
        better_s: by this much sooner must all have arrived for a change to be worth it ...
        better_share: ... and by this share of what remains.
    """

    interval_s: float = 0.5
    retry_s: float = 1.0
    review_s: float = 5.0
    better_s: float = 1.0
    better_share: float = 0.1


@dataclass
class Replanner:
    """Decides for one flight.

    Args:
        mission: what is flown; replaced by operator edits.
        observed: what the fleet has seen.
        settings: patience and hysteresis.
    """

    mission: Mission
    observed: ObservedMap
    settings: ReplanSettings = ReplanSettings()
    _edits: int = 0
    _not_before_s: float = -np.inf
    _review_s: float = -np.inf

    def __post_init__(self) -> None:
        self._planned = self._before = Basis(changes=0, edits=0)  # of the plan that is flown, and of the one before it
        self._clear_in: tuple[Basis, int] | None = None

    def edit(self, mission: Mission) -> None:
        """The operator has changed what is flown: the next look has a cause."""
        self.mission, self._not_before_s = mission, -np.inf
        self._edits += 1

    @property
    def basis(self) -> Basis:
        """What a plan that is begun now will know."""
        return Basis(self.observed.changes, self._edits)

    def look(self, aloft: Sequence[Aloft], now_s: float) -> Cause | None:
        """Why a new plan is wanted now, or None."""
        if not aloft or now_s < self._not_before_s:
            return None
        if self._edits != self._planned.edits:
            return Cause.EDITED
        if self.observed.changes == self._planned.changes:
            return None
        if self._is_any_blocked(aloft):
            return Cause.BLOCKED
        return Cause.REVIEW if now_s >= self._review_s else None

    def _is_any_blocked(self, aloft: Sequence[Aloft]) -> bool:
        """What is left of somebody's curve is blocked; it is looked at once for each state of plan and map."""
        state = self._planned, self.observed.changes
        if self._clear_in == state:
            return False  # what is left has only become less
        blocked = any(self.is_blocked(vehicle.curve_m) for vehicle in aloft)
        self._clear_in = None if blocked else state
        return blocked

    def is_blocked(self, curve_m: Array) -> bool:
        """A curve of (m, 3) ENU samples comes too near to what was seen.

        Voxels reach beyond the surface that was hit by up to their own size: so much less clearance is asked for.
        """
        if not len(curve_m):
            return False
        required_m = max(self.mission.limits.clearance_m - self.observed.voxel_m, self.mission.limits.body_radius_m)
        return float(self.observed.clearance(curve_m).min()) < required_m

    def judge(self, cause: Cause, plan: FleetPlan, aloft: Sequence[Aloft], basis: Basis, now_s: float) -> str:
        """Why a new plan is not flown, as a phrase; empty if it is.

        Args:
            cause: why it was asked for.
            plan: for all vehicles in flight.
            aloft: as it was when it was asked for.
            basis: `basis` then.
            now_s: vehicle time.
        """
        if basis.edits != self._edits:
            return "the operator has changed the mission meanwhile"
        if not plan.feasible:
            self.put_off(now_s)
            return "; ".join(str(violation) for violation in plan.violations)
        self._not_before_s, self._review_s = now_s + self.settings.interval_s, now_s + self.settings.review_s
        self._before, self._planned = self._planned, basis  # what is flown from now on, old or new, is good for this
        if cause is Cause.REVIEW and not self._materially_better(plan, aloft):
            return "it is not materially better"
        return ""

    def put_off(self, now_s: float) -> None:
        """There was no plan at all: try again later."""
        self._not_before_s = now_s + self.settings.retry_s

    def forget_plan(self) -> None:
        """Not every vehicle has got the new plan: what is flown may know neither the map nor the operator's edits."""
        self._planned = Basis(changes=-1, edits=self._before.edits)

    def _materially_better(self, plan: FleetPlan, aloft: Sequence[Aloft]) -> bool:
        now_takes_s = max(vehicle.remaining_s for vehicle in aloft)
        then_takes_s = max(float(part.times_s[-1]) for part in plan.vehicles)
        saved_s = now_takes_s - then_takes_s
        return saved_s > max(self.settings.better_s, self.settings.better_share * now_takes_s)
