"""Contact on the way from pads to curves that begin in one launch point, as the search sees it, with derivatives.

All vehicles fly straight from their hovers to where they have joined their curves, at equal shares of the way at the
same time (`feasibility` judges the same, apart from this). A curve is joined where it is `distance_m` away from its
beginning; between two samples it is the cubic that has their places and slopes.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gcs.planner.curve_cost import Adjoint, Sampling
from missions.kernels import compiled

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

HALVINGS = 40
"""Of the step between two samples, when the place is looked for at which a curve is joined."""


class Joining(NamedTuple):
    """Where vehicles come from, and what they keep on their way to their curves."""

    hovers_m: Array
    """(vehicles, 3) above their pads; nobody's, (0, 3), where vehicles begin at their own places."""
    distance_m: float
    """How far from its beginning a curve is joined."""
    contact_m: float
    """Two vehicles that are nearer are in contact."""


@compiled
def join(
    control_m: Array, samples: Sampling, points_m: Array, distance_m: float, at_m: Array, weights: Array, along: Array
) -> int:
    """Fill `at_m` with the place where a curve is joined.

    Args:
        control_m: (n, 3) control points, ENU [m].
        samples: the m samples.
        points_m: (m, 3) the curve there.
        distance_m: from the curve's beginning.
        at_m: (3,) the place; the end of a curve that does not get that far.
        weights: (4,) is filled with what the samples before and behind it, and then the derivatives there, weigh in it.
        along: (3,) is filled with the curve's direction there.

    Returns:
        The sample before the place; -1 for a curve that ends before, for which nothing but the place is filled in.
    """
    last, behind, low, high = len(points_m) - 1, 0, 0.0, 1.0
    away_m = 0.0
    while behind < last and away_m <= distance_m:
        behind += 1
        away_m = 0.0
        for axis in range(3):
            away_m += (points_m[behind, axis] - points_m[0, axis]) ** 2
        away_m = np.sqrt(away_m)
    slopes = np.zeros((2, 3))
    for axis in range(3):
        at_m[axis] = points_m[last, axis]
        for k in range(4):
            for side in range(2):
                m = behind - 1 + side
                slopes[side, axis] += samples.slope[m, k] * control_m[samples.first[m] + k, axis]
    if away_m <= distance_m:
        return -1
    for _ in range(HALVINGS):
        t = 0.5 * (low + high)
        weights[0], weights[1] = (1.0 + 2.0 * t) * (1.0 - t) ** 2, t * t * (3.0 - 2.0 * t)
        weights[2], weights[3] = t * (1.0 - t) ** 2 / last, t * t * (t - 1.0) / last
        away_m = 0.0
        for axis in range(3):
            at_m[axis] = weights[0] * points_m[behind - 1, axis] + weights[1] * points_m[behind, axis]
            at_m[axis] += weights[2] * slopes[0, axis] + weights[3] * slopes[1, axis]
            away_m += (at_m[axis] - points_m[0, axis]) ** 2
        low, high = (low, t) if np.sqrt(away_m) > distance_m else (t, high)
    for axis in range(3):
        along[axis] = 6.0 * low * (1.0 - low) * (points_m[behind, axis] - points_m[behind - 1, axis])
        along[axis] += (1.0 - low) * (1.0 - 3.0 * low) * slopes[0, axis] / last
        along[axis] += low * (3.0 * low - 2.0) * slopes[1, axis] / last
    return behind - 1


@compiled
def in_contact(
    joining: Joining, a: int, a_m: Array, b: int, b_m: Array, pull: float, by_a: Array, by_b: Array
) -> float:
    """Squared violation by vehicles a and b, which join their curves at (3,) places; `pull` times derivatives added."""
    squared = along = 0.0
    for axis in range(3):
        begin = joining.hovers_m[a, axis] - joining.hovers_m[b, axis]
        way = a_m[axis] - b_m[axis] - begin
        squared, along = squared + way * way, along - begin * way
    t = min(max(along / max(squared, 1e-12), 0.0), 1.0)
    squared = 0.0
    for axis in range(3):
        begin = joining.hovers_m[a, axis] - joining.hovers_m[b, axis]
        squared += (begin + t * (a_m[axis] - b_m[axis] - begin)) ** 2
    apart_m = np.sqrt(squared)
    if apart_m >= joining.contact_m:
        return 0.0
    short = 1.0 - apart_m / joining.contact_m
    if pull > 0.0:
        scale = -2.0 * pull * short / joining.contact_m / max(apart_m, 1e-9) * t
        for axis in range(3):
            begin = joining.hovers_m[a, axis] - joining.hovers_m[b, axis]
            push = scale * (begin + t * (a_m[axis] - b_m[axis] - begin))
            by_a[axis] += push
            by_b[axis] -= push
    return short * short


@compiled
def from_join(
    points_m: Array, at_m: Array, before: int, weights: Array, along: Array, by_at: Array, adjoint: Adjoint
) -> None:
    """Add what a (3,) derivative by the place where a curve is joined means for the curve's samples.

    The place keeps its distance from the beginning: what would move it away is taken back along the curve.
    """
    outwards, pulled = 0.0, 0.0
    for axis in range(3):
        outwards += along[axis] * (at_m[axis] - points_m[0, axis])
        pulled += along[axis] * by_at[axis]
    for axis in range(3):
        by_place = by_at[axis] - (at_m[axis] - points_m[0, axis]) * pulled / max(outwards, 1e-9)
        adjoint.point[before, axis] += weights[0] * by_place
        adjoint.point[before + 1, axis] += weights[1] * by_place
        adjoint.slope[before, axis] += weights[2] * by_place
        adjoint.slope[before + 1, axis] += weights[3] * by_place
