"""The descent of `lbfgs`, compiled, for one vehicle that has the sky to itself: it takes less than a millisecond.

Vehicles hinder one another little on most missions: the best plan of the fleet is near the best curves of its vehicles
flown alone. These are small problems of a dozen variables each, whose costs take less time than a call from Python.
"""

import numpy as np
import numpy.typing as npt

from gcs.planner.fleet_cost import Problem, fleet_cost
from gcs.planner.lbfgs import (
    CORRECTIONS,
    ENOUGH_DECREASE,
    ENOUGH_FLATTENING,
    LEAST_GAIN,
    MOST_STALLS,
    MOST_TRIALS,
    downhill,
    inner,
)
from missions.kernels import compiled

Array = npt.NDArray[np.float64]


def alone(problem: Problem, vehicle: int) -> Problem:
    """The problem of one vehicle without the others."""
    row = slice(vehicle, vehicle + 1)
    return problem._replace(
        base_m=problem.base_m[row],
        axes_m=problem.axes_m[row],
        pins=problem.pins[row],
        zones_m=problem.zones_m[row],
    )


@compiled
def descend_alone(problem: Problem, offsets: Array, most: int) -> int:
    """Improve the offsets of a single vehicle, in place; the steps are those of `lbfgs.minimise`.

    Args:
        problem: of one vehicle.
        offsets: (1, d).
        most: evaluations.

    Returns:
        Evaluations that were made.
    """
    d = offsets.shape[1]
    steps, turns = np.zeros((CORRECTIONS, d)), np.zeros((CORRECTIONS, d))
    here, slope_here, direction = offsets.copy(), np.empty((1, d)), np.empty(d)
    there, slope_there = np.empty((1, d)), np.empty((1, d))
    cost, evaluations, known, stalled = _cost(problem, here, slope_here), 1, 0, 0
    while evaluations < most and stalled < MOST_STALLS:
        downhill(slope_here[0], steps, turns, known, direction)
        there[:], slope_there[:] = here, slope_here
        found, trials = _search_line(problem, here, cost, slope_here, direction, most - evaluations, there, slope_there)
        evaluations += trials
        i = known % CORRECTIONS
        steps[i], turns[i] = there[0] - here[0], slope_there[0] - slope_here[0]
        stalled = stalled + 1 if cost - found <= LEAST_GAIN * abs(cost) else 0
        if inner(steps[i], turns[i]) > 1e-10 * inner(turns[i], turns[i]):
            known += 1
        elif found == cost:
            known = 0
        cost = found
        here[:], slope_here[:] = there, slope_there
    offsets[:] = here
    return evaluations


@compiled
def _search_line(
    problem: Problem,
    here: Array,
    cost: float,
    slope_here: Array,
    direction: Array,
    most: int,
    there: Array,
    slope_there: Array,
) -> tuple[float, int]:
    """`lbfgs.line_search`: cost and trials; what is found is written to `there` and `slope_there`."""
    slope, low, high, t = inner(slope_here[0], direction), 0.0, np.inf, 1.0
    tried, slope_tried, lowest, trials = np.empty_like(here), np.empty_like(here), cost, 0
    while trials < min(most, MOST_TRIALS):
        tried[0] = here[0] + t * direction
        value = _cost(problem, tried, slope_tried)
        trials += 1
        if value > cost + ENOUGH_DECREASE * t * slope:
            high = t
        else:
            lowest, low = value, t
            there[:], slope_there[:] = tried, slope_tried
            if inner(slope_tried[0], direction) >= ENOUGH_FLATTENING * slope:
                break
        t = 0.5 * (low + high) if high < np.inf else 2.0 * t
    return lowest, trials


@compiled
def _cost(problem: Problem, offsets: Array, gradient: Array) -> float:
    objective, violation = fleet_cost(problem, offsets, gradient)
    return objective + problem.terms.penalty_weight * violation
