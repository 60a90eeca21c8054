"""When one candidate is better than another: constraints first, then Pareto or weighted dominance (eqs. 15 to 17)."""

import numpy as np
import numpy.typing as npt

from companion.planner.evaluation import HARD, OBJECTIVES, SOFT
from missions.kernels import compiled

Array = npt.NDArray[np.float64]


def objective_weights(length: float, clearance: float, height: float) -> Array:
    """(3,) weights phi of the objectives, normalised to a sum of 1."""
    weights = np.array([length, clearance, height])
    total = weights.sum()
    return weights / total if total > 0.0 else np.full(OBJECTIVES, 1.0 / OBJECTIVES)


@compiled
def pareto_dominates(a: Array, b: Array) -> bool:
    """Eq. 15: `a` is nowhere worse than `b` and somewhere better; the first three of (3 or more,) are compared."""
    better = False
    for i in range(OBJECTIVES):
        if a[i] > b[i]:
            return False
        better = better or a[i] < b[i]
    return better


@compiled
def weighted_dominates(a: Array, b: Array, weights: Array) -> bool:
    """Eqs. 16 and 17, with the dominance factors rho_i = 1 - phi_i: heavier objectives tolerate less.

    F_i = f_i(a) - f_i(b) + rho_i * sum over j != i of (f_j(a) - f_j(b)); all at most 0, one below. Values are
    (3 or more,), the (3,) weights are phi.
    """
    total = 0.0
    for i in range(OBJECTIVES):
        total += a[i] - b[i]
    better = False
    for i in range(OBJECTIVES):
        own = a[i] - b[i]
        margin = own + (1.0 - weights[i]) * (total - own)
        if margin > 0.0:
            return False
        better = better or margin < 0.0
    return better


@compiled
def dominates(a: Array, b: Array, weights: Array, weighted: bool) -> bool:
    """The dominance that personal bests are compared by; values (3 or more,), weights (3,)."""
    return weighted_dominates(a, b, weights) if weighted else pareto_dominates(a, b)


@compiled
def weighted_sum(value: Array, weights: Array) -> float:
    """The rank of an entry (3 or more,) among others: sum of phi_i f_i with (3,) weights, the smaller the better."""
    total = 0.0
    for i in range(OBJECTIVES):
        total += weights[i] * value[i]
    return total


@compiled
def is_feasible(value: Array) -> bool:
    """No constraint is broken by a value (5,), not even a soft one."""
    return value[HARD] == 0.0 and value[SOFT] == 0.0


@compiled
def is_preferred(a: Array, b: Array, weights: Array) -> bool:
    """A total order of (5,) values: fewer hard violations, then fewer soft ones, then the weighted sum."""
    if a[HARD] != b[HARD]:
        return a[HARD] < b[HARD]
    if a[SOFT] != b[SOFT]:
        return a[SOFT] < b[SOFT]
    return weighted_sum(a, weights) < weighted_sum(b, weights)
