"""How long a search may go on."""

from collections.abc import Callable
from dataclasses import dataclass, replace

DEFAULT_EVALUATIONS = 1500
STUBBORN_EVALUATIONS = 6000
"""Without a limit, the search goes on so long for its first feasible plan ..."""
IMPROVING_EVALUATIONS = 500
"""... and improves that at least so long."""


@dataclass(frozen=True)
class Budget:
    """A number of evaluations of whole plans, a time, or both: whichever ends first.

    Args:
        evaluations: the most there may be, or None.
        deadline_s: on `clock`, or None.
        began_s: on `clock`.
        clock: monotonic seconds.
        should_stop: asked often; True ends the search with what it has.
        settles: whether the default number of evaluations is enough once there is a feasible plan.
    """

    evaluations: int | None
    deadline_s: float | None
    began_s: float
    clock: Callable[[], float]
    should_stop: Callable[[], bool]
    settles: bool = False

    def share_done(self, evaluations: float) -> float:
        """Share of the budget that is used up after so many evaluations, 0 to 1."""
        shares = [0.0]
        if self.evaluations is not None:
            shares.append(evaluations / self.evaluations)
        if self.deadline_s is not None:
            shares.append((self.clock() - self.began_s) / (self.deadline_s - self.began_s))
        return min(max(shares), 1.0)

    def settled(self, evaluations: float) -> "Budget":
        """The budget when a feasible plan is found after so many evaluations, or there seems to be none."""
        if not self.settles:
            return self
        enough = max(DEFAULT_EVALUATIONS, int(evaluations) + IMPROVING_EVALUATIONS)
        return replace(self, evaluations=enough, settles=False)

    def interrupted(self) -> bool:
        """Whether to stop at once: time is up, or somebody wants it."""
        return self.should_stop() or (self.deadline_s is not None and self.clock() >= self.deadline_s)

    def left(self, evaluations: float) -> int:
        """Evaluations that may still be made; many where only time counts."""
        return 10**9 if self.evaluations is None else max(int(self.evaluations - evaluations), 0)


def new_budget(
    evaluations: int | None,
    budget_s: float | None,
    clock: Callable[[], float],
    should_stop: Callable[[], bool] | None,
) -> Budget:
    """A budget that begins now; without any limit, `DEFAULT_EVALUATIONS`, or more to find a feasible plan at all."""
    began_s, unlimited = clock(), evaluations is None and budget_s is None
    deadline_s = None if budget_s is None else began_s + budget_s
    most = STUBBORN_EVALUATIONS if unlimited else evaluations
    return Budget(most, deadline_s, began_s, clock, should_stop or (lambda: False), settles=unlimited)
