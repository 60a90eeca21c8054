"""Cost of one vehicle's curve: the objective of eq. 13, the limits that concern it alone, and their gradient.

A curve is a clamped cubic B-spline, looked at in a fixed number of samples; its length is that of the polygon through
them. What depends on the points, on the first and on the second derivative of the curve, and on the sides of that
polygon is differentiated by hand and collected in an `Adjoint`. The coupling between vehicles (`fleet_cost`) adds
its part before `pull_back` carries everything to the control points.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.interpolate import BSpline

from gcs.planner.obstacle_gradient import clearance_gradient_at, height_gradient_at
from missions import bspline
from missions.kernels import compiled
from missions.obstacles import Obstacles

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

LEAST_SLOPE_M = 1e-6
"""Where a curve stands still it has no direction: its derivative is taken to be at least this long."""


class Sampling(NamedTuple):
    """Where curves are looked at: what each of m samples takes from the four control points that touch it."""

    first: IntArray
    """(m,) index of the first of the four."""
    position: Array
    """(m, 4) weights for the point."""
    slope: Array
    """(m, 4) weights for the first derivative by the curve's parameter."""
    bend: Array
    """(m, 4) weights for the second derivative."""


class Terms(NamedTuple):
    """Weights of eq. 13 and limits of one vehicle, as the search uses them."""

    length_weight: float
    clearance_weight: float
    height_weight: float
    clearance_cap_m: float
    height_cap_m: float
    look_m: float
    """Clearance beyond which nothing depends on it."""
    slow_cost: float
    """What it costs to fly all the way at avoidance speed."""
    slow_m: float
    """Clearance below which a vehicle flies at avoidance speed ..."""
    cruise_m: float
    """... and above which it certainly flies at cruise speed."""
    penalty_weight: float
    clearance_m: float
    contact_m: float
    """Limit of the clearance inside the launch zones."""
    height_m: float
    zone_radius_m: float
    turn_radius_m: float
    climb_sine: float
    length_m: float
    """Longest path."""
    unit_m: float
    """A violation of this size [m] counts as one."""
    low_m: Array
    """(3,) lowest corner of what may be flown in."""
    high_m: Array


class Adjoint(NamedTuple):
    """Derivatives of the cost by what a curve consists of."""

    point: Array
    """(m, 3)."""
    slope: Array
    bend: Array
    chord: Array
    """(m - 1,) by the lengths of the polygon's sides."""


def sampling(n_control: int, n_samples: int) -> Sampling:
    """Samples at equal steps of the parameter of a clamped cubic with `n_control` control points."""
    u = np.linspace(0.0, 1.0, n_samples)
    segments = n_control - bspline.DEGREE
    first = np.minimum((u * segments).astype(np.int64), segments - 1)
    spline = BSpline(bspline.clamped_knots(n_control), np.eye(n_control), bspline.DEGREE)
    touched = first[:, None] + np.arange(bspline.DEGREE + 1)
    position, slope, bend = (np.take_along_axis(spline(u, order), touched, axis=1) for order in range(3))
    return Sampling(first, position, slope, bend)


@compiled
def curve_cost(
    control_m: Array,
    samples: Sampling,
    terms: Terms,
    obstacles: Obstacles,
    points_m: Array,
    chords_m: Array,
    adjoint: Adjoint,
    with_gradient: bool,
) -> tuple[float, float]:
    """Objective (eq. 13, and what slow flight costs) and sum of the squared violations of one curve.

    Args:
        control_m: (n, 3) control points, ENU [m].
        samples: the m samples.
        terms: weights and limits.
        obstacles: what is known to stand in the world.
        points_m: (m, 3) is filled with the samples.
        chords_m: (m - 1,) is filled with the distances between them.
        adjoint: with a gradient, is overwritten with the derivatives of objective + penalty_weight * violations.
        with_gradient: whether one is wanted.
    """
    n_samples = len(points_m)
    length = place_samples(control_m, samples, points_m, chords_m)
    over = max(0.0, length / terms.length_m - 1.0)
    violation, earned = over * over, 0.0
    reward, shape = np.empty((n_samples, 4)), np.empty((2, 3))
    for m in range(n_samples):
        violation += _at_point(m, control_m, terms, obstacles, points_m, reward, adjoint, with_gradient)
        _weigh(control_m, samples.first[m], samples.slope[m], shape[0])
        _weigh(control_m, samples.first[m], samples.bend[m], shape[1])
        violation += _of_shape(m, shape, terms, adjoint, with_gradient)
        before, after = chords_m[max(m - 1, 0)] * (m > 0), chords_m[min(m, n_samples - 2)] * (m < n_samples - 1)
        earned += 0.5 * (before + after) * reward[m, 0]
        if with_gradient:
            for axis in range(3):
                adjoint.point[m, axis] -= 0.5 * (before + after) / length * reward[m, 1 + axis]
    if with_gradient:
        by_length = terms.length_weight + earned / length**2 + terms.penalty_weight * 2.0 * over / terms.length_m
        for m in range(n_samples - 1):
            adjoint.chord[m] = by_length - 0.5 * (reward[m, 0] + reward[m + 1, 0]) / length
    return terms.length_weight * length - earned / length, violation


@compiled
def place_samples(control_m: Array, samples: Sampling, points_m: Array, chords_m: Array) -> float:
    """Fill `points_m` and `chords_m` as `curve_cost` says, and return the length [m] of the polygon."""
    length = 0.0
    for m in range(len(points_m)):
        _weigh(control_m, samples.first[m], samples.position[m], points_m[m])
        if m > 0:
            chords_m[m - 1] = distance(points_m[m - 1], points_m[m])
            length += chords_m[m - 1]
    return length


@compiled
def pull_back(samples: Sampling, points_m: Array, chords_m: Array, adjoint: Adjoint, gradient: Array) -> None:
    """Fill (n, 3) `gradient` with the derivatives by the control points that an adjoint amounts to."""
    gradient[:] = 0.0
    for m in range(len(chords_m)):
        scale = adjoint.chord[m] / max(chords_m[m], LEAST_SLOPE_M)
        for axis in range(3):
            pull = scale * (points_m[m + 1, axis] - points_m[m, axis])
            adjoint.point[m + 1, axis] += pull
            adjoint.point[m, axis] -= pull
    for m in range(len(points_m)):
        for k in range(4):
            position, slope, bend = samples.position[m, k], samples.slope[m, k], samples.bend[m, k]
            for axis in range(3):
                gradient[samples.first[m] + k, axis] += (
                    position * adjoint.point[m, axis] + slope * adjoint.slope[m, axis] + bend * adjoint.bend[m, axis]
                )


@compiled
def _weigh(control_m: Array, first: int, weights: Array, out: Array) -> None:
    for axis in range(3):
        out[axis] = (
            weights[0] * control_m[first, axis]
            + weights[1] * control_m[first + 1, axis]
            + weights[2] * control_m[first + 2, axis]
            + weights[3] * control_m[first + 3, axis]
        )


@compiled
def distance(a: Array, b: Array) -> float:
    """Euclidean distance of two (3,) points."""
    east, north, up = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return np.sqrt(east * east + north * north + up * up)


@compiled
def _at_point(
    m: int,
    control_m: Array,
    terms: Terms,
    obstacles: Obstacles,
    points_m: Array,
    reward: Array,
    adjoint: Adjoint,
    with_gradient: bool,
) -> float:
    """Reward of eq. 13 at a sample, with its gradient, into `reward[m]`; squared violations of what points keep."""
    point = points_m[m]
    clearance = clearance_gradient_at(point[0], point[1], point[2], obstacles, terms.look_m)
    height = height_gradient_at(point[0], point[1], point[2], obstacles)
    in_zone = min(distance(point, control_m[0]), distance(point, control_m[-1])) < terms.zone_radius_m
    short = max(0.0, (terms.contact_m if in_zone else terms.clearance_m) - clearance[0]) / terms.unit_m
    low = max(0.0, (0.0 if in_zone else terms.height_m) - height[0]) / terms.unit_m
    slow, by_slow = _slowness(clearance[0], terms)
    by_clearance = terms.clearance_weight * (clearance[0] < terms.clearance_cap_m) - by_slow
    by_height = terms.height_weight * (height[0] < terms.height_cap_m)
    reward[m, 0] = (
        terms.clearance_weight * min(clearance[0], terms.clearance_cap_m)
        + terms.height_weight * min(height[0], terms.height_cap_m)
        - slow
    )
    violation = short * short + low * low
    push = -2.0 * terms.penalty_weight / terms.unit_m
    for axis in range(3):
        out = max(0.0, point[axis] - terms.high_m[axis]) - max(0.0, terms.low_m[axis] - point[axis])
        violation += (out / terms.unit_m) ** 2
        if with_gradient:
            reward[m, 1 + axis] = by_clearance * clearance[1 + axis] + by_height * height[1 + axis]
            adjoint.point[m, axis] = push * (short * clearance[1 + axis] + low * height[1 + axis] - out / terms.unit_m)
    return violation


@compiled
def _slowness(clearance_m: float, terms: Terms) -> tuple[float, float]:
    """What flying with this clearance costs in time, and its derivative: a smooth step from all to nothing."""
    if clearance_m >= terms.cruise_m:
        return 0.0, 0.0
    width = max(terms.cruise_m - terms.slow_m, 1e-9)
    t = min((terms.cruise_m - clearance_m) / width, 1.0)
    return terms.slow_cost * t * t * (3.0 - 2.0 * t), -terms.slow_cost * 6.0 * t * (1.0 - t) / width


@compiled
def _of_shape(m: int, shape: Array, terms: Terms, adjoint: Adjoint, with_gradient: bool) -> float:
    """Squared violations of turn radius and climb angle at a sample with first and second derivative `shape`."""
    d, b = shape[0], shape[1]
    speed = max(np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), LEAST_SLOPE_M)
    cross = (d[1] * b[2] - d[2] * b[1], d[2] * b[0] - d[0] * b[2], d[0] * b[1] - d[1] * b[0])
    bent = max(np.sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]), 1e-12)
    tight = max(0.0, terms.turn_radius_m * bent / speed**3 - 1.0)
    steep = max(0.0, abs(d[2]) / speed / terms.climb_sine - 1.0)
    if with_gradient:
        by_tight = 2.0 * terms.penalty_weight * tight * terms.turn_radius_m / (bent * speed**3)
        by_steep = 2.0 * terms.penalty_weight * steep / (terms.climb_sine * speed)
        along = -3.0 * by_tight * bent * bent / speed**2 - by_steep * abs(d[2]) / speed**2
        for axis in range(3):
            i, j = (axis + 1) % 3, (axis + 2) % 3
            adjoint.bend[m, axis] = by_tight * (cross[i] * d[j] - cross[j] * d[i])
            adjoint.slope[m, axis] = by_tight * (b[i] * cross[j] - b[j] * cross[i]) + along * d[axis]
        adjoint.slope[m, 2] += by_steep * np.sign(d[2])
    return tight * tight + steep * steep
