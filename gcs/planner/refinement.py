"""Gradient polish of a whole plan: L-BFGS on the penalised cost of all vehicles together."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

from gcs.planner.fleet_cost import Problem, fleet_cost

Array = npt.NDArray[np.float64]

CORRECTIONS = 20
"""Past steps from which L-BFGS builds its picture of the curvature."""
LEAST_GAIN = 1e-9
"""Relative gain per step below which a stage ends."""


@dataclass(frozen=True)
class Stage:
    """One run of L-BFGS.

    Args:
        strictness: factor on the weight of violations.
        evaluations: the most that it may take.
    """

    strictness: float
    evaluations: int


@dataclass(frozen=True)
class Refined:
    """The outcome of a polish.

    Args:
        offsets: (vehicles, 2 (n - 2)).
        objective: of eq. 13, as the search samples it.
        violation: sum of the squared violations, likewise.
        evaluations: that it took.
    """

    offsets: Array
    objective: float
    violation: float
    evaluations: int


def refine(
    problem: Problem, offsets: Array, stages: tuple[Stage, ...], most: int, should_stop: Callable[[], bool]
) -> Refined:
    """Improve a plan, ever more strictly.

    Light penalties let the optimiser cut through limits towards a good plan; each stricter stage starts from what the
    one before it found, and moves it little.

    Args:
        problem: what is planned.
        offsets: (vehicles, 2 (n - 2)) to start from.
        stages: in order.
        most: evaluations in all; one is always made.
        should_stop: asked after every step; the best so far is returned then.
    """
    evaluations, gradient = 0, np.empty_like(offsets)
    for stage in stages:
        allowed = min(stage.evaluations, most - 1 - evaluations)
        if allowed <= 0 or should_stop():
            break
        offsets, taken = _descend(stricter(problem, stage.strictness), offsets, allowed, should_stop)
        evaluations += taken
    objective, violation = fleet_cost(problem, offsets, gradient)
    return Refined(offsets, objective, violation, evaluations + 1)


def stricter(problem: Problem, factor: float) -> Problem:
    """The same problem with violations weighing so many times more."""
    return problem._replace(terms=problem.terms._replace(penalty_weight=factor * problem.terms.penalty_weight))


def _descend(problem: Problem, offsets: Array, most: int, should_stop: Callable[[], bool]) -> tuple[Array, int]:
    weight, shape = problem.terms.penalty_weight, offsets.shape

    def cost(flat: Array) -> tuple[float, Array]:
        gradient = np.empty(shape)
        objective, violation = fleet_cost(problem, flat.reshape(shape), gradient)
        return objective + weight * violation, gradient.ravel()

    def after_step(_: Array) -> None:
        if should_stop():
            raise StopIteration

    options = {"maxfun": most, "maxiter": most, "maxcor": CORRECTIONS, "ftol": LEAST_GAIN, "gtol": 0.0}
    result = minimize(cost, offsets.ravel(), jac=True, method="L-BFGS-B", callback=after_step, options=options)
    return np.asarray(result.x).reshape(shape), int(result.nfev)
