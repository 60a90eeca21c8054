"""Cost of one vehicle's curve: the objective of eq. 13, the limits that concern it alone, and their gradient.

A curve is a clamped cubic B-spline, looked at in a fixed number of samples; its length is that of the polygon through
them. What depends on the points, on the first and on the second derivative of the curve, and on the sides of that
polygon is differentiated by hand and collected in an `Adjoint`. The coupling between vehicles (`fleet_cost`) adds
its part before `pull_back` carries everything to the control points.
"""

import functools
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.interpolate import BSpline

from gcs.planner.obstacle_gradient import clearances, heights
from missions import bspline
from missions.kernels import compiled
from missions.obstacles import Obstacles

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
Corner = tuple[float, float, float]

LEAST_SLOPE_M = 1e-6
"""Where a curve stands still it has no direction: its derivative is taken to be at least this long."""
LEAST_CHORD_M = 1e-9
"""Samples lie at least so far apart, so that a vehicle whose target is where it starts has means, too."""


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
    low_m: Corner
    """Lowest corner of what may be flown in."""
    high_m: Corner


class Adjoint(NamedTuple):
    """Derivatives of the cost by what a curve consists of."""

    point: Array
    """(m, 3)."""
    slope: Array
    bend: Array
    chord: Array
    """(m - 1,) by the lengths of the polygon's sides."""


@compiled
def new_adjoint(n_samples: int) -> Adjoint:
    """Room for the derivatives of a curve with so many samples; with none, for no derivatives."""
    by_point, by_slope, by_bend = np.empty((n_samples, 3)), np.empty((n_samples, 3)), np.empty((n_samples, 3))
    return Adjoint(by_point, by_slope, by_bend, np.empty(max(n_samples - 1, 0)))


@functools.lru_cache(maxsize=64)
def sampling(n_control: int, n_samples: int) -> Sampling:
    """Samples at equal steps of the parameter of a clamped cubic with `n_control` control points; read-only."""
    u = np.linspace(0.0, 1.0, n_samples)
    segments = n_control - bspline.DEGREE
    first = np.minimum((u * segments).astype(np.int64), segments - 1)
    spline = BSpline(bspline.clamped_knots(n_control), np.eye(n_control), bspline.DEGREE)
    touched = first[:, None] + np.arange(bspline.DEGREE + 1)
    position, slope, bend = (np.take_along_axis(spline(u, order), touched, axis=1) for order in range(3))
    for array in (first, position, slope, bend):
        array.flags.writeable = False
    return Sampling(first, position, slope, bend)


@compiled
def curve_cost(
    control_m: Array,
    samples: Sampling,
    terms: Terms,
    obstacles: Obstacles,
    zones_m: Array,
    points_m: Array,
    chords_m: Array,
    adjoint: Adjoint,
) -> tuple[float, float]:
    """Objective (eq. 13, and what slow flight costs) and sum of the squared violations of one curve.

    Args:
        control_m: (n, 3) control points, ENU [m].
        samples: the m samples.
        terms: weights and limits.
        obstacles: what is known to stand in the world.
        zones_m: (z, 3) centres of the launch and landing zones.
        points_m: (m, 3) is filled with the samples.
        chords_m: (m - 1,) is filled with the distances between them.
        adjoint: is overwritten with the derivatives of objective + penalty_weight * violations; none are computed
            when its arrays are empty.
    """
    n_samples, with_gradient = len(points_m), len(adjoint.chord) > 0
    length = place_samples(control_m, samples, points_m, chords_m)
    clearance, height, reward = np.empty((n_samples, 4)), np.empty((n_samples, 4)), np.empty((n_samples, 4))
    clearances(points_m, obstacles, terms.look_m, clearance)
    heights(points_m, obstacles, height)
    over = max(0.0, length / terms.length_m - 1.0)
    violation = over * over
    violation += _judge_points(points_m, terms, zones_m, clearance, height, reward, adjoint.point, with_gradient)
    violation += _judge_shape(control_m, samples, terms, adjoint.slope, adjoint.bend, with_gradient)
    earned = 0.0
    for m in range(n_samples - 1):
        earned += 0.5 * chords_m[m] * (reward[m, 0] + reward[m + 1, 0])
    if with_gradient:
        by_length = terms.length_weight + earned / length**2 + terms.penalty_weight * 2.0 * over / terms.length_m
        for m in range(n_samples - 1):
            share = 0.5 * chords_m[m] / length
            adjoint.chord[m] = by_length - 0.5 * (reward[m, 0] + reward[m + 1, 0]) / length
            for axis in range(3):
                adjoint.point[m, axis] -= share * reward[m, 1 + axis]
                adjoint.point[m + 1, axis] -= share * reward[m + 1, 1 + axis]
    return terms.length_weight * length - earned / length, violation


@compiled
def place_samples(control_m: Array, samples: Sampling, points_m: Array, chords_m: Array) -> float:
    """Fill `points_m` and `chords_m` as `curve_cost` says, and return the length [m] of the polygon."""
    first, position = samples.first, samples.position
    length = 0.0
    for m in range(len(points_m)):
        c = first[m]
        for axis in range(3):
            points_m[m, axis] = (
                position[m, 0] * control_m[c, axis]
                + position[m, 1] * control_m[c + 1, axis]
                + position[m, 2] * control_m[c + 2, axis]
                + position[m, 3] * control_m[c + 3, axis]
            )
        if m > 0:
            east, north = points_m[m, 0] - points_m[m - 1, 0], points_m[m, 1] - points_m[m - 1, 1]
            up = points_m[m, 2] - points_m[m - 1, 2]
            chords_m[m - 1] = max(np.sqrt(east * east + north * north + up * up), LEAST_CHORD_M)
            length += chords_m[m - 1]
    return length


@compiled
def pull_back(samples: Sampling, points_m: Array, chords_m: Array, adjoint: Adjoint, gradient: Array) -> None:
    """Fill (n, 3) `gradient` with the derivatives by the control points that an adjoint amounts to."""
    by_point, by_slope, by_bend, by_chord = adjoint.point, adjoint.slope, adjoint.bend, adjoint.chord
    for m in range(len(chords_m)):
        scale = by_chord[m] / chords_m[m]
        for axis in range(3):
            pull = scale * (points_m[m + 1, axis] - points_m[m, axis])
            by_point[m + 1, axis] += pull
            by_point[m, axis] -= pull
    first, position, slope, bend = samples.first, samples.position, samples.slope, samples.bend
    gradient[:] = 0.0
    for m in range(len(points_m)):
        for k in range(4):
            for axis in range(3):
                gradient[first[m] + k, axis] += (
                    position[m, k] * by_point[m, axis] + slope[m, k] * by_slope[m, axis] + bend[m, k] * by_bend[m, axis]
                )


@compiled
def _judge_points(
    points_m: Array,
    terms: Terms,
    zones_m: Array,
    clearance: Array,
    height: Array,
    reward: Array,
    by_point: Array,
    with_gradient: bool,
) -> float:
    """Squared violations of clearance, height and bounds, with (m, 3) derivatives; fills (m, 4) rewards of eq. 13."""
    last, violation, unit_m = len(points_m) - 1, 0.0, terms.unit_m
    push = 2.0 * terms.penalty_weight / unit_m
    zone_squared = terms.zone_radius_m * terms.zone_radius_m
    for m in range(last + 1):
        in_zone = False
        for z in range(len(zones_m)):
            away = 0.0
            for axis in range(3):
                away += (points_m[m, axis] - zones_m[z, axis]) ** 2
            in_zone |= away < zone_squared
        short = max(0.0, (terms.contact_m if in_zone else terms.clearance_m) - clearance[m, 0]) / unit_m
        low = max(0.0, (0.0 if in_zone else terms.height_m) - height[m, 0]) / unit_m
        violation += short * short + low * low
        slow, by_slow = _slowness(clearance[m, 0], terms.slow_cost, terms.slow_m, terms.cruise_m)
        reward[m, 0] = terms.clearance_weight * min(clearance[m, 0], terms.clearance_cap_m) - slow
        reward[m, 0] += terms.height_weight * min(height[m, 0], terms.height_cap_m)
        by_clearance = terms.clearance_weight * (clearance[m, 0] < terms.clearance_cap_m) - by_slow
        by_height = terms.height_weight * (height[m, 0] < terms.height_cap_m)
        for axis in range(3):
            above, below = points_m[m, axis] - terms.high_m[axis], terms.low_m[axis] - points_m[m, axis]
            out = (max(0.0, above) - max(0.0, below)) / unit_m
            violation += out * out
            if with_gradient:
                reward[m, 1 + axis] = by_clearance * clearance[m, 1 + axis] + by_height * height[m, 1 + axis]
                by_point[m, axis] = push * (out - short * clearance[m, 1 + axis] - low * height[m, 1 + axis])
    return violation


@compiled
def _slowness(clearance_m: float, slow_cost: float, slow_m: float, cruise_m: float) -> tuple[float, float]:
    """What flying with this clearance costs in time, and its derivative: a smooth step from all to nothing."""
    if clearance_m >= cruise_m:
        return 0.0, 0.0
    width = max(cruise_m - slow_m, 1e-9)
    t = min((cruise_m - clearance_m) / width, 1.0)
    return slow_cost * t * t * (3.0 - 2.0 * t), -slow_cost * 6.0 * t * (1.0 - t) / width


@compiled
def _judge_shape(
    control_m: Array, samples: Sampling, terms: Terms, by_slope: Array, by_bend: Array, with_gradient: bool
) -> float:
    """Squared violations of turn radius and climb angle, with (m, 3) derivatives."""
    first, slope, bend, violation = samples.first, samples.slope, samples.bend, 0.0
    radius_m, climb_sine = terms.turn_radius_m, terms.climb_sine
    d, b, cross = np.empty(3), np.empty(3), np.empty(3)
    for m in range(len(first)):
        c = first[m]
        for axis in range(3):
            d[axis] = b[axis] = 0.0
            for k in range(4):
                d[axis] += slope[m, k] * control_m[c + k, axis]
                b[axis] += bend[m, k] * control_m[c + k, axis]
        for axis in range(3):
            i, j = (axis + 1) % 3, (axis + 2) % 3
            cross[axis] = d[i] * b[j] - d[j] * b[i]
        speed = max(np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), LEAST_SLOPE_M)
        bent = np.sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2])
        tight = max(0.0, radius_m * bent / speed**3 - 1.0)
        steep = max(0.0, abs(d[2]) / speed / climb_sine - 1.0)
        violation += tight * tight + steep * steep
        if with_gradient:
            by_tight = 2.0 * terms.penalty_weight * tight * radius_m / (max(bent, 1e-12) * speed**3)
            by_steep = 2.0 * terms.penalty_weight * steep / (climb_sine * speed)
            along = -3.0 * by_tight * bent * bent / speed**2 - by_steep * abs(d[2]) / speed**2
            for axis in range(3):
                i, j = (axis + 1) % 3, (axis + 2) % 3
                by_bend[m, axis] = by_tight * (cross[i] * d[j] - cross[j] * d[i])
                by_slope[m, axis] = by_tight * (b[i] * cross[j] - b[j] * cross[i]) + along * d[axis]
            by_slope[m, 2] += by_steep * np.sign(d[2])
    return violation
