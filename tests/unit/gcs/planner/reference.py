"""The compiled costs once more, in plain numpy, as a reader would write them down."""

import numpy as np
from scipy.interpolate import BSpline
from scipy.optimize import brentq

from gcs.planner.coupling import Coupling
from gcs.planner.curve_cost import Terms
from gcs.planner.fleet_cost import Problem, all_control_points
from gcs.planner.joining import Joining
from missions import bspline, obstacles
from missions.obstacles import Obstacles

Array = np.ndarray


def fleet_cost(problem: Problem, offsets: Array) -> tuple[float, float]:
    """Objective and violation of a whole plan."""
    controls_m = all_control_points(problem, offsets)
    n_samples = len(problem.samples.first)
    costs = [
        curve_cost(control_m, n_samples, problem.terms, problem.obstacles, zones_m)
        for control_m, zones_m in zip(controls_m, problem.zones_m, strict=True)
    ]
    places_m = [places(control_m, len(problem.samples.first), len(problem.coupling.first)) for control_m in controls_m]
    objective, violation = np.sum(costs, axis=0)
    return objective, violation + between(problem.coupling, places_m) + joining(problem.joining, controls_m)


def curve_cost(control_m: Array, n_samples: int, terms: Terms, solid: Obstacles, zones_m: Array) -> tuple[float, float]:
    """Objective and violation of one curve."""
    spline = BSpline(bspline.clamped_knots(len(control_m)), control_m, 3)
    u = np.linspace(0.0, 1.0, n_samples)
    points, slope, bend = spline(u), spline(u, 1), spline(u, 2)
    sides = np.linalg.norm(np.diff(points, axis=0), axis=1)
    clearance = obstacles.clearance(points, solid)
    height = points[:, 2] - obstacles.terrain_height(points, solid)

    t = np.clip((terms.cruise_m - clearance) / max(terms.cruise_m - terms.slow_m, 1e-9), 0.0, 1.0)
    reward = (
        terms.clearance_weight * np.minimum(clearance, terms.clearance_cap_m)
        + terms.height_weight * np.minimum(height, terms.height_cap_m)
        - terms.slow_cost * t**2 * (3.0 - 2.0 * t)
    )
    earned = np.sum(sides * 0.5 * (reward[1:] + reward[:-1])) / sides.sum()

    to_zones = np.linalg.norm(points[:, None] - zones_m, axis=2)
    in_zone = to_zones.min(axis=1) < terms.zone_radius_m
    required_m, high_m = np.where(in_zone, terms.contact_m, terms.clearance_m), np.where(in_zone, 0.0, terms.height_m)
    speed = np.linalg.norm(slope, axis=1)
    curvature = np.linalg.norm(np.cross(slope, bend), axis=1) / speed**3
    breaches = (
        (required_m - clearance) / terms.unit_m,
        (high_m - height) / terms.unit_m,
        (points - terms.high_m) / terms.unit_m,
        (terms.low_m - points) / terms.unit_m,
        terms.turn_radius_m * curvature - 1.0,
        np.abs(slope[:, 2]) / speed / terms.climb_sine - 1.0,
        sides.sum() / terms.length_m - 1.0,
    )
    violation = sum(float(np.sum(np.maximum(breach, 0.0) ** 2)) for breach in breaches)
    return terms.length_weight * sides.sum() - earned, violation


def places(control_m: Array, n_samples: int, n_fractions: int) -> Array:
    """(k, 3) places at equal fractions of the polygon through a curve's samples."""
    points = bspline.sampled_basis(len(control_m), n_samples) @ control_m
    flown = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    at = np.linspace(0.0, flown[-1], n_fractions)
    return np.stack([np.interp(at, flown, points[:, axis]) for axis in range(3)], axis=-1)


def joining(joining: Joining, controls_m: Array) -> float:
    """Violations by vehicles that come too near to one another between their pads and their curves."""
    share, found = np.linspace(0.0, 1.0, 20001)[:, None], 0.0
    ways_m = [
        hover_m + share * (joined_at(control_m, joining.distance_m) - hover_m)
        for hover_m, control_m in zip(joining.hovers_m, controls_m, strict=False)
    ]
    for a in range(len(ways_m)):
        for b in range(a):
            apart_m = np.linalg.norm(ways_m[a] - ways_m[b], axis=1).min()
            found += max(0.0, 1.0 - apart_m / joining.contact_m) ** 2
    return found


def joined_at(control_m: Array, distance_m: float) -> Array:
    """(3,) the first place of a curve so far from its beginning, or its end."""
    spline = BSpline(bspline.clamped_knots(len(control_m)), control_m, 3)
    u = np.linspace(0.0, 1.0, 1001)
    beyond = np.linalg.norm(spline(u) - control_m[0], axis=1) > distance_m
    if not beyond.any():
        return control_m[-1]
    first = int(np.argmax(beyond))
    return spline(brentq(lambda at: np.linalg.norm(spline(at) - control_m[0]) - distance_m, u[first - 1], u[first]))


def between(coupling: Coupling, places_m: list[Array]) -> float:
    """Violations between all vehicles."""
    n, violation, means = len(places_m), 0.0, np.zeros((len(places_m), len(places_m)))
    for a in range(n):
        for b in range(a):
            apart = np.linalg.norm(places_m[a] - places_m[b], axis=1)
            means[a, b] = means[b, a] = np.trapezoid(apart) / (len(apart) - 1)
            violation += separation(coupling, places_m[a], places_m[b])
    mean = means.sum(axis=1) / max(n - 1, 1)
    out = np.maximum(mean - coupling.mean_high_m, 0.0) + np.maximum(coupling.mean_low_m - mean, 0.0)
    return violation + float(np.sum((out / coupling.mean_unit_m) ** 2)) * (n > 1)


def separation(coupling: Coupling, a: Array, b: Array) -> float:
    """Violations of the separation of two vehicles at (k, 3) places."""
    return sum(
        _breach(a, k, b, j, coupling) ** 2
        for k in range(len(a) - 1)
        for j in range(coupling.first[k], min(coupling.last[k], len(a) - 2) + 1)
    )


def _breach(a: Array, k: int, b: Array, j: int, coupling: Coupling) -> float:
    """How much separation is missing on the step from places k and j, as a share of what is required."""
    t = np.linspace(0.0, 1.0, 4001)[:, None]
    apart = np.linalg.norm((1.0 - t) * (a[k] - b[j]) + t * (a[k + 1] - b[j + 1]), axis=1).min()
    limit = coupling.separation_m
    flown = np.linalg.norm(a[k + 1] - a[0]), np.linalg.norm(b[j + 1] - b[0])
    if coupling.zone_radius_m > 0.0 and max(flown) <= coupling.zone_radius_m:
        joined = min(np.linalg.norm(a[k] - a[0]), np.linalg.norm(b[j] - b[0])) > coupling.join_m
        limit = coupling.contact_m if joined else 0.0
    return max(0.0, 1.0 - apart / limit) if limit > 0.0 else 0.0
