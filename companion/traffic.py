"""A flight among others: plans are announced before they are flown, and conflicts are seen in time. Sans-IO."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from companion.fleet.conflict import first_conflict_s
from companion.fleet.exchange import Exchange
from companion.fleet.neighbour import Neighbour
from companion.fleet.right_of_way import RightOfWay, places_aside
from companion.planner.planner import Plan, Planner
from missions.mission import Limits
from missions.trajectory import Trajectory
from missions.tunnel import TrajectoryKind

Array = npt.NDArray[np.float64]

TRAIL_STEP_M, TRAIL_PLACES = 0.5, 60
"""Where the vehicle has come along, for backing up."""
ASIDE_FARTHER_M = 0.15
"""Who makes way goes so much farther off than it has to."""
WANT_INTERVAL_S = 1.0
RESERVE_M = 0.06
"""Plans keep so much more distance than is required of them: centimetres on the wire, and in time."""
LOOK_INTERVAL_S = 0.25
"""Conflicts are looked for whenever something has changed, and so often, since the radius of who is silent grows."""


@dataclass(frozen=True)
class Offer:
    """A plan that is announced and waits.

    Args:
        plan: with a trajectory.
        since_s: when it was announced.
        due_s: when it may be flown.
    """

    plan: Plan
    since_s: float
    due_s: float


@dataclass(frozen=True)
class Decision:
    """What becomes of an offer.

    Args:
        plan: which was offered.
        clear: it is flown.
        waited_s: for so long it was announced.
    """

    plan: Plan
    clear: bool
    waited_s: float


class Traffic:
    """One flight's dealings with the other vehicles.

    Args:
        exchange: what they say, and what is said to them.
        planner: its checks.
        limits: the mission's.
    """

    def __init__(self, exchange: Exchange, planner: Planner, limits: Limits) -> None:
        self._exchange = exchange
        self._planner = planner
        self._limits = limits
        self._offer: Offer | None = None
        self._looked_at: tuple[int, int] = (-1, -1)
        self._looked_along: Trajectory | None = None
        self._conflict_s = float("inf")
        self.right = RightOfWay(exchange.sysid)
        self._places_m = self._trail_m = np.empty((0, 3))
        self._aside_for: int | None = None
        self._wanted_s = float("-inf")

    @property
    def is_waiting(self) -> bool:
        """A plan is announced and not flown yet."""
        return self._offer is not None

    def wait_s(self, now_s: float) -> float:
        """How long a plan has to be announced; 0 when nobody listens."""
        return self._exchange.wait_s(now_s)

    def neighbours(self, now_s: float) -> tuple[Neighbour, ...]:
        """Whom a new plan has to respect, from a little farther off than is checked before it is flown."""
        others = self._exchange.neighbours(now_s, pending=True)
        return tuple(replace(other, radius_m=other.radius_m + RESERVE_M) for other in others)

    def offer(self, plan: Plan, trajectory: Trajectory, plan_id: int, wait_s: float, now_s: float) -> None:
        """Announce a plan; it is decided about when the wait is over."""
        self._offer = Offer(plan, now_s, now_s + wait_s)
        self._exchange.offer(trajectory, plan_id, self.right.rank, now_s)

    def decision(self, now_s: float) -> Decision | None:
        """About a plan whose wait is over; None while there is none."""
        offer = self._offer
        if offer is None or now_s < offer.due_s:
            return None
        assert offer.plan.trajectory is not None
        others = self._exchange.neighbours(now_s, pending=True)
        clear = self._planner.is_clear(offer.plan.trajectory, now_s, others)
        self._offer = None
        if clear:
            self._exchange.commit_offer()
        else:
            self._exchange.withdraw()
        return Decision(offer.plan, clear, now_s - offer.since_s)

    def withdraw(self) -> None:
        """What was announced will not be flown."""
        self._offer = None
        self._exchange.withdraw()

    def fly(self, kind: TrajectoryKind, trajectory: Trajectory, plan_id: int, now_s: float) -> None:
        """Say what is flown from now on, without a wait."""
        self._offer = None
        self._exchange.fly(kind, trajectory, plan_id, self.right.rank, now_s)

    # ------------------------------------------------------------- making way

    def look(self, flown: Trajectory, now_s: float, *, idle: bool) -> None:
        """Notice who wants this vehicle out of its way; remember where it came along."""
        here_m = flown.at(now_s).position_m
        if len(self._trail_m) == 0 or np.linalg.norm(here_m - self._trail_m[-1]) > TRAIL_STEP_M:
            self._trail_m = np.vstack((self._trail_m, here_m))[-TRAIL_PLACES:]
        self.right.look(self._exchange.roster.wanted(now_s), flown, self._apart_m, now_s, idle=idle)
        claim = self.right.claim
        if claim is None:
            self._aside_for = None
        elif claim.sysid != self._aside_for:
            self._aside_for = claim.sysid
            places_m = places_aside(claim, here_m, self._trail_m, self._apart_m + ASIDE_FARTHER_M)
            self._places_m = places_m[self._planner.may_rest(places_m)]

    @property
    def makes_way(self) -> bool:
        return self.right.claim is not None

    def is_aside(self, flown: Trajectory) -> bool:
        """It will rest where it is in nobody's way."""
        claim = self.right.claim
        return claim is not None and bool(claim.distance_m(flown.end_m[None])[0] >= self._apart_m)

    @property
    def place_aside_m(self) -> Array | None:
        """(3,) where to go to make way; None when there is no place left to try."""
        return self._places_m[0] if len(self._places_m) else None

    def note_no_path(self, place_m: Array, now_s: float) -> None:
        """There was no path from a (3,) place; while making way the next place is tried."""
        self.right.note_no_path(place_m, now_s)
        if self.makes_way and len(self._places_m) > 1:
            self._places_m = self._places_m[1:]

    def is_stuck(self, now_s: float) -> bool:
        """There has been no path for a while."""
        return self.right.is_stuck(now_s)

    def shall_want(self, now_s: float) -> bool:
        """It is time to tell which path is wanted."""
        return self.right.is_stuck(now_s) and now_s - self._wanted_s > WANT_INTERVAL_S

    def want(self, trajectory: Trajectory | None, plan_id: int, now_s: float) -> None:
        """Tell which path is wanted; None if there is none even if all others make way."""
        self._wanted_s = now_s
        if trajectory is not None:
            self._exchange.want(trajectory, plan_id, self.right.rank, now_s)

    def before(self, now_s: float) -> tuple[Neighbour, ...]:
        """Those who do not make way for this vehicle."""
        return tuple(other for other in self.neighbours(now_s) if other.sysid < self.right.rank)

    @property
    def _apart_m(self) -> float:
        return self._limits.separation_m + RESERVE_M

    # -------------------------------------------------------------- collisions

    def conflict_s(self, trajectory: Trajectory, now_s: float) -> float:
        """When (vehicle time) the flown trajectory comes too near to somebody's; infinity if it does not."""
        looked_at = self._exchange.roster.changes, int(now_s / LOOK_INTERVAL_S)
        if looked_at != self._looked_at or trajectory is not self._looked_along:
            self._looked_at, self._looked_along = looked_at, trajectory
            others = self._exchange.neighbours(now_s)
            self._conflict_s, _ = first_conflict_s(trajectory, others, self._limits, now_s)
        return self._conflict_s
