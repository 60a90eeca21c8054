"""Cost of a whole fleet's curves: every vehicle's own (`curve_cost`), and what vehicles owe to one another.

All vehicles arrive together: at any time all have flown the same fraction of their paths. Curves are compared at
equally spaced fractions, and between them along straight lines; with time slack, also at different fractions.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gcs.planner.curve_cost import Adjoint, Sampling, Terms, curve_cost, distance, place_samples, pull_back
from missions.kernels import compiled
from missions.obstacles import Obstacles

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


class Coupling(NamedTuple):
    """Limits between vehicles, as the search uses them, at k equally spaced fractions of the paths."""

    separation_m: float
    zone_radius_m: float
    """While both vehicles are in a launch zone of this radius, only contact counts ..."""
    contact_m: float
    """... which is a separation of less than this ..."""
    join_m: float
    """... and not before they have come this far from where they start."""
    mean_low_m: float
    """Bounds of a vehicle's mean distance to the others."""
    mean_high_m: float
    mean_unit_m: float
    """A violation of these bounds by so much counts as one."""
    first: IntArray
    """(k,) with time slack: the earliest fraction at which another vehicle may be, when this one is at k ..."""
    last: IntArray
    """... and the latest, inclusive."""


class Problem(NamedTuple):
    """Everything that the cost of a plan depends on; variables are offsets as in `representation`."""

    base_m: Array
    """(vehicles, n, 3) control points without any offset, start and target included."""
    axes_m: Array
    """(vehicles, n - 2, 2, 3) what an inner control point moves by when its lateral, vertical offset is one."""
    samples: Sampling
    terms: Terms
    coupling: Coupling
    obstacles: Obstacles


class Context(NamedTuple):
    """Where all vehicles are along their present curves: what a single one is compared with."""

    places_m: Array
    """(vehicles, k, 3) at equal fractions."""
    means_m: Array
    """(vehicles, vehicles) mean distances, zero on the diagonal."""


def no_others(n_vehicles: int = 1, n_fractions: int = 1) -> Context:
    """A context that nobody has been entered into; with one vehicle nobody ever is."""
    return Context(np.zeros((n_vehicles, n_fractions, 3)), np.zeros((n_vehicles, n_vehicles)))


def all_control_points(problem: Problem, offsets: Array) -> Array:
    """(vehicles, n, 3) control points, ENU [m], of a plan with (vehicles, 2 (n - 2)) offsets."""
    controls = np.empty_like(problem.base_m)
    for vehicle, row in enumerate(offsets):
        control_points(problem, vehicle, row, controls[vehicle])
    return controls


@compiled
def control_points(problem: Problem, vehicle: int, offsets: Array, out_m: Array) -> None:
    """Fill (n, 3) control points of one vehicle's curve with (2 (n - 2),) offsets."""
    n = len(out_m)
    for axis in range(3):
        out_m[0, axis] = problem.base_m[vehicle, 0, axis]
        out_m[n - 1, axis] = problem.base_m[vehicle, n - 1, axis]
    for i in range(1, n - 1):
        for axis in range(3):
            out_m[i, axis] = (
                problem.base_m[vehicle, i, axis]
                + offsets[2 * i - 2] * problem.axes_m[vehicle, i - 1, 0, axis]
                + offsets[2 * i - 1] * problem.axes_m[vehicle, i - 1, 1, axis]
            )


@compiled
def at_fractions(points_m: Array, chords_m: Array, out_m: Array, side: IntArray, share: Array) -> None:
    """Fill (k, 3) `out_m` with points of a polygon at equal fractions of its length.

    Args:
        points_m: (m, 3) corners.
        chords_m: (m - 1,) lengths of its sides.
        out_m: (k, 3) the points.
        side: (k,) is filled with the side on which each point lies.
        share: (k,) is filled with how far along that side, 0 to 1.
    """
    n_fractions, n_sides = len(out_m), len(chords_m)
    length = chords_m.sum()
    m, begin = 0, 0.0
    for k in range(n_fractions):
        at = length * k / (n_fractions - 1)
        while m < n_sides - 1 and begin + chords_m[m] < at:
            begin += chords_m[m]
            m += 1
        along = min(max((at - begin) / max(chords_m[m], 1e-9), 0.0), 1.0)
        side[k], share[k] = m, along
        for axis in range(3):
            out_m[k, axis] = points_m[m, axis] + along * (points_m[m + 1, axis] - points_m[m, axis])


@compiled
def mean_distance(a_m: Array, b_m: Array) -> float:
    """Mean over the flight of the distance between two vehicles at (k, 3) places."""
    last = len(a_m) - 1
    total = 0.5 * (distance(a_m[0], b_m[0]) + distance(a_m[last], b_m[last]))
    for k in range(1, last):
        total += distance(a_m[k], b_m[k])
    return total / last


@compiled
def too_close(a_m: Array, b_m: Array, coupling: Coupling, pull: float, by_a: Array, by_b: Array) -> float:
    """Sum of the squared violations of the separation of two vehicles at (k, 3) places.

    Args:
        a_m: places of one vehicle.
        b_m: places of the other.
        coupling: the limits.
        pull: penalty weight of the derivatives, 0 when they are not wanted.
        by_a: (k, 3) to which the derivatives by a's places are added.
        by_b: (k, 3) likewise.
    """
    n_steps, violation = len(a_m) - 1, 0.0
    reach = coupling.separation_m + distance(a_m[0], a_m[1]) + distance(b_m[0], b_m[1])
    step = np.empty(3)
    for k in range(n_steps):
        for j in range(coupling.first[k], min(coupling.last[k] + 1, n_steps)):
            e, n, u = a_m[k, 0] - b_m[j, 0], a_m[k, 1] - b_m[j, 1], a_m[k, 2] - b_m[j, 2]
            if e * e + n * n + u * u > reach * reach:
                continue
            limit = _limit_m(a_m, k, b_m, j, coupling)
            for axis in range(3):
                step[axis] = a_m[k + 1, axis] - a_m[k, axis] - b_m[j + 1, axis] + b_m[j, axis]
            along = -(e * step[0] + n * step[1] + u * step[2])
            squared = step[0] * step[0] + step[1] * step[1] + step[2] * step[2]
            t = min(max(along / max(squared, 1e-12), 0.0), 1.0)
            e, n, u = e + t * step[0], n + t * step[1], u + t * step[2]
            apart = np.sqrt(e * e + n * n + u * u)
            if apart >= limit:
                continue
            short = 1.0 - apart / limit
            violation += short * short
            if pull > 0.0:
                scale = -2.0 * pull * short / limit / max(apart, 1e-9)
                _add(by_a, k, t, scale * e, scale * n, scale * u)
                _add(by_b, j, t, -scale * e, -scale * n, -scale * u)
    return violation


@compiled
def swarm_cost(
    problem: Problem, vehicle: int, offsets: Array, context: Context, objective: Array, violation: Array
) -> None:
    """Costs of many curves of one vehicle while all others keep theirs.

    Args:
        problem: what is planned.
        vehicle: whose curves.
        offsets: (particles, 2 (n - 2)) their offsets.
        context: where the others are.
        objective: (particles,) is filled with eq. 13 of this vehicle.
        violation: (particles,) is filled with the sum of all squared violations that this vehicle has a part in.
    """
    n_samples, n_fractions = len(problem.samples.first), context.places_m.shape[1]
    control = np.empty_like(problem.base_m[0])
    points, chords = np.empty((n_samples, 3)), np.empty(n_samples - 1)
    places, side, share = np.empty((n_fractions, 3)), np.empty(n_fractions, np.int64), np.empty(n_fractions)
    unused = Adjoint(points, points, points, chords)
    for i in range(len(offsets)):
        control_points(problem, vehicle, offsets[i], control)
        objective[i], violation[i] = curve_cost(
            control, problem.samples, problem.terms, problem.obstacles, points, chords, unused, False
        )
        if len(context.places_m) > 1:
            at_fractions(points, chords, places, side, share)
            violation[i] += _towards_others(problem.coupling, vehicle, places, context)


@compiled
def set_context(problem: Problem, vehicle: int, offsets: Array, context: Context) -> None:
    """Enter one vehicle's curve into the context."""
    n_samples, n_fractions = len(problem.samples.first), context.places_m.shape[1]
    control = np.empty_like(problem.base_m[0])
    points, chords = np.empty((n_samples, 3)), np.empty(n_samples - 1)
    side, share = np.empty(n_fractions, np.int64), np.empty(n_fractions)
    control_points(problem, vehicle, offsets, control)
    place_samples(control, problem.samples, points, chords)
    at_fractions(points, chords, context.places_m[vehicle], side, share)
    for other in range(len(context.places_m)):
        if other != vehicle:
            mean = mean_distance(context.places_m[vehicle], context.places_m[other])
            context.means_m[vehicle, other] = context.means_m[other, vehicle] = mean


@compiled
def fleet_cost(problem: Problem, offsets: Array, gradient: Array) -> tuple[float, float]:
    """Objective and sum of squared violations of a whole plan, with the gradient of their penalised sum.

    Args:
        problem: what is planned.
        offsets: (vehicles, 2 (n - 2)).
        gradient: (vehicles, 2 (n - 2)) is filled with d(objective + penalty_weight * violations) / d offsets.
    """
    n_vehicles, n_samples, n_fractions = len(offsets), len(problem.samples.first), len(problem.coupling.first)
    control = np.empty_like(problem.base_m[0])
    points, chords = np.empty((n_vehicles, n_samples, 3)), np.empty((n_vehicles, n_samples - 1))
    by_point, by_slope, by_bend = np.empty_like(points), np.empty_like(points), np.empty_like(points)
    by_chord = np.empty_like(chords)
    places, by_place = np.empty((n_vehicles, n_fractions, 3)), np.zeros((n_vehicles, n_fractions, 3))
    side, share = np.empty((n_vehicles, n_fractions), np.int64), np.empty((n_vehicles, n_fractions))
    objective = violation = 0.0
    for i in range(n_vehicles):
        control_points(problem, i, offsets[i], control)
        adjoint = Adjoint(by_point[i], by_slope[i], by_bend[i], by_chord[i])
        cost, broken = curve_cost(
            control, problem.samples, problem.terms, problem.obstacles, points[i], chords[i], adjoint, True
        )
        objective, violation = objective + cost, violation + broken
        at_fractions(points[i], chords[i], places[i], side[i], share[i])
    violation += _between_all(problem, places, by_place)
    for i in range(n_vehicles):
        adjoint = Adjoint(by_point[i], by_slope[i], by_bend[i], by_chord[i])
        _pull_back_places(points[i], chords[i], side[i], share[i], by_place[i], adjoint)
        pull_back(problem.samples, points[i], chords[i], adjoint, control)
        for k in range(len(control) - 2):
            for j in range(2):
                axis = problem.axes_m[i, k, j]
                push = control[k + 1]
                gradient[i, 2 * k + j] = axis[0] * push[0] + axis[1] * push[1] + axis[2] * push[2]
    return objective, violation


@compiled
def _between_all(problem: Problem, places_m: Array, by_place: Array) -> float:
    """Squared violations between all pairs, and their derivatives by the (vehicles, k, 3) places."""
    coupling, weight, n = problem.coupling, problem.terms.penalty_weight, len(places_m)
    if n < 2:
        return 0.0
    violation, mean = 0.0, np.zeros(n)
    for a in range(n):
        for b in range(a):
            violation += too_close(places_m[a], places_m[b], coupling, weight, by_place[a], by_place[b])
            apart = mean_distance(places_m[a], places_m[b]) / (n - 1)
            mean[a] += apart
            mean[b] += apart
    for a in range(n):
        out, scale = _out_of_bounds(mean[a], coupling)
        violation += out * out
        mean[a] = 2.0 * weight * out * scale / (n - 1)
    for a in range(n):
        for b in range(a):
            if mean[a] + mean[b] != 0.0:
                _pull_mean(places_m[a], places_m[b], mean[a] + mean[b], by_place[a], by_place[b])
    return violation


@compiled
def _towards_others(coupling: Coupling, vehicle: int, places_m: Array, context: Context) -> float:
    """Squared violations of the limits between vehicles that change when one of them flies (k, 3) other places."""
    n, violation, total = len(context.places_m), 0.0, 0.0
    for other in range(n):
        if other == vehicle:
            continue
        violation += too_close(places_m, context.places_m[other], coupling, 0.0, places_m, places_m)
        apart = mean_distance(places_m, context.places_m[other])
        total += apart
        theirs = context.means_m[other].sum() - context.means_m[other, vehicle] + apart
        out, _ = _out_of_bounds(theirs / (n - 1), coupling)
        violation += out * out
    out, _ = _out_of_bounds(total / (n - 1), coupling)
    return violation + out * out


@compiled
def _out_of_bounds(mean_m: float, coupling: Coupling) -> tuple[float, float]:
    """Violation of the bounds of a mean separation in units of `mean_unit_m`, and its derivative by that mean."""
    out = max(0.0, mean_m - coupling.mean_high_m) - max(0.0, coupling.mean_low_m - mean_m)
    return out / coupling.mean_unit_m, 1.0 / coupling.mean_unit_m


@compiled
def _limit_m(a_m: Array, k: int, b_m: Array, j: int, coupling: Coupling) -> float:
    """Least separation of two vehicles on the way from fractions k and j: less while both are in launch zones."""
    if coupling.zone_radius_m == 0.0:
        return coupling.separation_m
    a_flown, b_flown = distance(a_m[k + 1], a_m[0]), distance(b_m[j + 1], b_m[0])
    if max(a_flown, b_flown) > coupling.zone_radius_m:
        return coupling.separation_m
    return coupling.contact_m if min(distance(a_m[k], a_m[0]), distance(b_m[j], b_m[0])) > coupling.join_m else 0.0


@compiled
def _add(total: Array, k: int, t: float, east: float, north: float, up: float) -> None:
    """Share a derivative by a place between fractions k and k + 1 among the two."""
    total[k, 0] += (1.0 - t) * east
    total[k, 1] += (1.0 - t) * north
    total[k, 2] += (1.0 - t) * up
    total[k + 1, 0] += t * east
    total[k + 1, 1] += t * north
    total[k + 1, 2] += t * up


@compiled
def _pull_mean(a_m: Array, b_m: Array, scale: float, by_a: Array, by_b: Array) -> None:
    """Add scale * d mean_distance / d places."""
    last = len(a_m) - 1
    for k in range(last + 1):
        weight = scale / last * (0.5 if k in (0, last) else 1.0) / max(distance(a_m[k], b_m[k]), 1e-9)
        for axis in range(3):
            pull = weight * (a_m[k, axis] - b_m[k, axis])
            by_a[k, axis] += pull
            by_b[k, axis] -= pull


@compiled
def _pull_back_places(
    points_m: Array, chords_m: Array, side: IntArray, share: Array, by_place: Array, adjoint: Adjoint
) -> None:
    """Carry derivatives by the places at equal fractions over to the polygon's corners and sides.

    A place lies on its side at share = (fraction * length - length of the sides before) / side.
    """
    n_fractions, n_sides = len(side), len(chords_m)
    before, everywhere = np.zeros(n_sides + 1), 0.0
    for k in range(n_fractions):
        m, a = side[k], share[k]
        by_share = 0.0
        for axis in range(3):
            adjoint.point[m, axis] += (1.0 - a) * by_place[k, axis]
            adjoint.point[m + 1, axis] += a * by_place[k, axis]
            by_share += by_place[k, axis] * (points_m[m + 1, axis] - points_m[m, axis])
        by_share /= max(chords_m[m], 1e-9)
        if 0 < k < n_fractions - 1:
            everywhere += by_share * k / (n_fractions - 1)
            before[m] -= by_share
            adjoint.chord[m] -= a * by_share
    total = everywhere
    for m in range(n_sides - 1, -1, -1):
        adjoint.chord[m] += total
        total += before[m]
