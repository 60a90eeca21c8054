"""L-BFGS (Nocedal 1980) for costs with kinks: two-loop recursion and a weak Wolfe line search by bisection.

Why not `scipy.optimize`: its L-BFGS-B treats bounds that are not there, which takes as long as a cost here, and starts
the threads of its linear algebra for vectors of a hundred numbers. The line search is that of Lewis and Overton (2013),
which copes with a minimum of distances or a cap that ends a slope.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from missions.kernels import compiled

Array = npt.NDArray[np.float64]
Cost = Callable[[Array], tuple[float, Array]]
"""A cost and its gradient, (d,), at a (d,) position; the gradient is the callee's to keep."""

CORRECTIONS = 20
"""Past steps from which the curvature is guessed."""
FIRST_STEP = 0.02
"""The largest component of the first step, before anything is known of the curvature."""
ENOUGH_DECREASE, ENOUGH_FLATTENING = 1e-4, 0.9
"""Constants of the Wolfe conditions."""
MOST_TRIALS = 25
"""Positions that one line search may try."""
LEAST_GAIN, MOST_STALLS = 1e-9, 4
"""The descent ends after so many steps in a row with less than this relative gain."""


@dataclass(frozen=True)
class Descent:
    """Where a descent ended, or a line search.

    Args:
        position: (d,).
        cost: there.
        gradient: (d,) there.
        evaluations: that it took.
    """

    position: Array
    cost: float
    gradient: Array
    evaluations: int


def minimise(cost: Cost, position: Array, most: int, should_stop: Callable[[], bool]) -> Descent:
    """Descend from a (d,) position until nothing is gained any more, or `most` evaluations are made.

    Example:
        >>> descent = minimise(lambda x: (float(x @ x), 2.0 * x), np.ones(3), 50, lambda: False)
        >>> bool(descent.cost < 1e-12)
        True
    """
    here = Descent(position, *cost(position), evaluations=1)
    steps, turns = np.zeros((2, CORRECTIONS, len(position)))
    known = stalled = 0
    while here.evaluations < most and stalled < MOST_STALLS and not should_stop():
        direction = np.empty_like(position)
        downhill(here.gradient, steps, turns, known, direction)
        found = line_search(cost, here, direction, most - here.evaluations)
        step, turn = found.position - here.position, found.gradient - here.gradient
        stalled = stalled + 1 if here.cost - found.cost <= LEAST_GAIN * abs(here.cost) else 0
        if inner(step, turn) > 1e-10 * inner(turn, turn):
            steps[known % CORRECTIONS], turns[known % CORRECTIONS] = step, turn
            known += 1
        elif found.cost == here.cost:
            known = 0  # what was known of the curvature misled: begin again
        here = found
    return here


def line_search(cost: Cost, here: Descent, direction: Array, most: int) -> Descent:
    """A position along a (d,) direction that is lower and flatter enough, or else the lowest that was tried.

    The evaluations of the result are those of `here` and of the search; with no lower position found, it is `here`.
    """
    slope, low, high, t = inner(here.gradient, direction), 0.0, np.inf, 1.0
    lowest, trials = here, 0
    while trials < min(most, MOST_TRIALS):
        position = here.position + t * direction
        value, gradient = cost(position)
        trials += 1
        if value > here.cost + ENOUGH_DECREASE * t * slope:
            high = t
        else:
            lowest, low = Descent(position, value, gradient, 0), t
            if inner(gradient, direction) >= ENOUGH_FLATTENING * slope:
                break
        t = 0.5 * (low + high) if np.isfinite(high) else 2.0 * t
    return replace(lowest, evaluations=here.evaluations + trials)


@compiled
def downhill(gradient: Array, steps: Array, turns: Array, known: int, direction: Array) -> None:
    """Fill (d,) `direction` with where L-BFGS goes: minus the gradient, turned by the curvature that is known.

    Args:
        gradient: (d,).
        steps: (c, d) ring of the last changes of position.
        turns: (c, d) ring of the last changes of the gradient.
        known: how many changes there have been.
        direction: the result; without any change known, a short step against the gradient.
    """
    kept = min(known, len(steps))
    if kept == 0:
        direction[:] = -gradient * (FIRST_STEP / max(np.abs(gradient).max(), 1e-300))
        return
    share = np.empty(kept)
    direction[:] = -gradient
    for back in range(kept):
        i = (known - 1 - back) % len(steps)
        share[back] = inner(steps[i], direction) / inner(steps[i], turns[i])
        direction -= share[back] * turns[i]
    i = (known - 1) % len(steps)
    direction *= inner(steps[i], turns[i]) / inner(turns[i], turns[i])
    for back in range(kept - 1, -1, -1):
        i = (known - 1 - back) % len(steps)
        turned = inner(turns[i], direction) / inner(steps[i], turns[i])
        direction += (share[back] - turned) * steps[i]


@compiled
def inner(a: Array, b: Array) -> float:
    """The inner product of two (d,) vectors, without the threads of a linear algebra library."""
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total
