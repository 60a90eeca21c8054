"""Gradient polish of a whole plan: L-BFGS on the penalised cost of all vehicles together."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gcs.planner.fleet_cost import Problem, fleet_cost
from gcs.planner.lbfgs import Descent, minimise

Array = npt.NDArray[np.float64]


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
        descent = _descend(stricter(problem, stage.strictness), offsets, allowed, should_stop)
        offsets, evaluations = descent.position.reshape(offsets.shape), evaluations + descent.evaluations
    objective, violation = fleet_cost(problem, offsets, gradient)
    return Refined(offsets, objective, violation, evaluations + 1)


def stricter(problem: Problem, factor: float) -> Problem:
    """The same problem with violations weighing so many times more."""
    return problem._replace(terms=problem.terms._replace(penalty_weight=factor * problem.terms.penalty_weight))


def _descend(problem: Problem, offsets: Array, most: int, should_stop: Callable[[], bool]) -> Descent:
    weight, shape = problem.terms.penalty_weight, offsets.shape

    def cost(flat: Array) -> tuple[float, Array]:
        gradient = np.empty(shape)
        objective, violation = fleet_cost(problem, flat.reshape(shape), gradient)
        return objective + weight * violation, gradient.ravel()

    return minimise(cost, offsets.ravel(), most, should_stop)
