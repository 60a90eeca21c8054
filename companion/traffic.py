"""A flight among others: plans are announced before they are flown, and conflicts are seen in time. Sans-IO."""

from dataclasses import dataclass, replace

from companion.fleet.conflict import first_conflict_s
from companion.fleet.exchange import Exchange
from companion.fleet.neighbour import Neighbour
from companion.planner.planner import Plan, Planner
from missions.mission import Limits
from missions.trajectory import Trajectory
from missions.tunnel import TrajectoryKind

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
        self._exchange.offer(trajectory, plan_id, 0, now_s)

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
        self._exchange.fly(kind, trajectory, plan_id, 0, now_s)

    def conflict_s(self, trajectory: Trajectory, now_s: float) -> float:
        """When (vehicle time) the flown trajectory comes too near to somebody's; infinity if it does not."""
        looked_at = self._exchange.roster.changes, int(now_s / LOOK_INTERVAL_S)
        if looked_at != self._looked_at or trajectory is not self._looked_along:
            self._looked_at, self._looked_along = looked_at, trajectory
            others = self._exchange.neighbours(now_s)
            self._conflict_s, _ = first_conflict_s(trajectory, others, self._limits, now_s)
        return self._conflict_s
