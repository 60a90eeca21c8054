"""Cost of a whole fleet's curves: every vehicle's own (`curve_cost`) and what they owe to one another (`coupling`)."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gcs.planner.coupling import (
    Coupling,
    add_mean_gradient,
    at_fractions,
    from_fractions,
    mean_distance,
    out_of_bounds,
    too_close,
)
from gcs.planner.curve_cost import Adjoint, Sampling, Terms, curve_cost, new_adjoint, place_samples, pull_back
from gcs.planner.joining import Joining, from_join, in_contact, join
from missions.kernels import compiled
from missions.obstacles import Obstacles

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


class Problem(NamedTuple):
    """Everything that the cost of a plan depends on; variables are offsets as in `representation`."""

    base_m: Array
    """(vehicles, n, 3) control points without any offset, start and target included."""
    axes_m: Array
    """(vehicles, n - 2, 2, 3) what an inner control point moves by when its lateral, vertical offset is one."""
    pins: IntArray
    """(vehicles, k) control points that follow from their neighbours, so that the curve passes targets; 0 for none."""
    pin_weights: Array
    """(n, 3) what a pinned control point and its neighbours weigh where the curve passes."""
    zones_m: Array
    """(vehicles, k + 2, 3) start and targets of each, the last one repeated: centres of launch and landing zones."""
    samples: Sampling
    terms: Terms
    coupling: Coupling
    joining: Joining
    obstacles: Obstacles


class Context(NamedTuple):
    """Where all vehicles are along their present curves: what a single one is compared with."""

    places_m: Array
    """(vehicles, k, 3) at equal fractions."""
    steps_m: Array
    """(vehicles,) how far each flies from one place to the next."""
    means_m: Array
    """(vehicles, vehicles) mean distances, zero on the diagonal."""
    joins_m: Array
    """(vehicles, 3) where they have joined their curves from their pads."""


def no_others(n_vehicles: int = 1, n_fractions: int = 1) -> Context:
    """A context that nobody has been entered into; with one vehicle nobody ever is."""
    return Context(
        np.zeros((n_vehicles, n_fractions, 3)),
        np.zeros(n_vehicles),
        np.zeros((n_vehicles, n_vehicles)),
        np.zeros((n_vehicles, 3)),
    )


def all_control_points(problem: Problem, offsets: Array) -> Array:
    """(vehicles, n, 3) control points, ENU [m], of a plan with (vehicles, 2 (n - 2)) offsets."""
    controls = np.empty_like(problem.base_m)
    for vehicle, row in enumerate(offsets):
        control_points(problem, vehicle, row, controls[vehicle])
    return controls


@compiled
def control_points(problem: Problem, vehicle: int, offsets: Array, out_m: Array) -> None:
    """Fill (n, 3) control points of one vehicle's curve with (2 (n - 2),) offsets."""
    base_m, axes_m, weights = problem.base_m[vehicle], problem.axes_m[vehicle], problem.pin_weights
    last = len(out_m) - 1
    for axis in range(3):
        out_m[0, axis], out_m[last, axis] = base_m[0, axis], base_m[last, axis]
        for i in range(last - 1):
            moved = offsets[2 * i] * axes_m[i, 0, axis] + offsets[2 * i + 1] * axes_m[i, 1, axis]
            out_m[i + 1, axis] = base_m[i + 1, axis] + moved
        for j in range(problem.pins.shape[1]):
            c = problem.pins[vehicle, j]
            if c > 0:
                beside = weights[c, 0] * out_m[c - 1, axis] + weights[c, 2] * out_m[c + 1, axis]
                out_m[c, axis] = (problem.zones_m[vehicle, 1 + j, axis] - beside) / weights[c, 1]


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
    control, zones_m = np.empty_like(problem.base_m[vehicle]), problem.zones_m[vehicle]
    points, chords = np.empty((n_samples, 3)), np.empty(n_samples - 1)
    places, side, share = np.empty((n_fractions, 3)), np.empty(n_fractions, np.int64), np.empty(n_fractions)
    at_m, join_weights, join_slopes, joining = np.empty(3), np.empty(4), np.empty(3), problem.joining
    unwanted = new_adjoint(0)
    for i in range(len(offsets)):
        control_points(problem, vehicle, offsets[i], control)
        objective[i], violation[i] = curve_cost(
            control, problem.samples, problem.terms, problem.obstacles, zones_m, points, chords, unwanted
        )
        if len(context.places_m) > 1:
            step = at_fractions(points, chords, places, side, share)
            violation[i] += _towards_others(problem.coupling, vehicle, places, step, context)
            if len(joining.hovers_m) > 0:
                join(control, problem.samples, points, joining.distance_m, at_m, join_weights, join_slopes)
                for other in range(len(context.joins_m)):
                    if other != vehicle:
                        violation[i] += in_contact(
                            joining, vehicle, at_m, other, context.joins_m[other], 0.0, at_m, at_m
                        )


def set_context(problem: Problem, vehicle: int, offsets: Array, context: Context) -> None:
    """Enter one vehicle's curve, given by (2 (n - 2),) offsets, into the context."""
    n_samples, n_fractions = len(problem.samples.first), context.places_m.shape[1]
    control = np.empty_like(problem.base_m[vehicle])
    points, chords = np.empty((n_samples, 3)), np.empty(n_samples - 1)
    control_points(problem, vehicle, offsets, control)
    place_samples(control, problem.samples, points, chords)
    places, side, share = context.places_m[vehicle], np.empty(n_fractions, np.int64), np.empty(n_fractions)
    context.steps_m[vehicle] = at_fractions(points, chords, places, side, share)
    joined_m, join_weights, join_slopes = context.joins_m[vehicle], np.empty(4), np.empty(3)
    join(control, problem.samples, points, problem.joining.distance_m, joined_m, join_weights, join_slopes)
    for other in range(len(context.places_m)):
        if other != vehicle:
            mean = mean_distance(places, context.places_m[other])
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
    steps = np.empty(n_vehicles)
    joins, by_join = np.empty((n_vehicles, 3)), np.zeros((n_vehicles, 3))
    before, join_weights, join_slopes = (
        np.empty(n_vehicles, np.int64),
        np.empty((n_vehicles, 4)),
        np.empty((n_vehicles, 3)),
    )
    joined_from_pads = len(problem.joining.hovers_m) > 0 and n_vehicles > 1
    objective = violation = 0.0
    for i in range(n_vehicles):
        control_points(problem, i, offsets[i], control)
        adjoint = Adjoint(by_point[i], by_slope[i], by_bend[i], by_chord[i])
        cost, broken = curve_cost(
            control,
            problem.samples,
            problem.terms,
            problem.obstacles,
            problem.zones_m[i],
            points[i],
            chords[i],
            adjoint,
        )
        objective, violation = objective + cost, violation + broken
        steps[i] = at_fractions(points[i], chords[i], places[i], side[i], share[i])
        if joined_from_pads:
            before[i] = join(
                control,
                problem.samples,
                points[i],
                problem.joining.distance_m,
                joins[i],
                join_weights[i],
                join_slopes[i],
            )
    if n_vehicles > 1:
        violation += _between_all(problem.coupling, problem.terms.penalty_weight, places, steps, by_place)
    if joined_from_pads:
        violation += _joining_all(problem.joining, problem.terms.penalty_weight, joins, by_join)
    for i in range(n_vehicles):
        from_fractions(points[i], chords[i], side[i], share[i], by_place[i], by_point[i], by_chord[i])
        adjoint = Adjoint(by_point[i], by_slope[i], by_bend[i], by_chord[i])
        if joined_from_pads and before[i] >= 0:
            from_join(points[i], joins[i], before[i], join_weights[i], join_slopes[i], by_join[i], adjoint)
        pull_back(problem.samples, points[i], chords[i], adjoint, control)
        _to_offsets(control, problem.axes_m[i], problem.pins[i], problem.pin_weights, gradient[i])
    return objective, violation


@compiled
def plan_costs(problem: Problem, controls_m: Array, objective: Array, violation: Array) -> None:
    """Costs of many whole plans, as `fleet_cost` has them, without gradients.

    Args:
        problem: what is planned; its guides are of no account.
        controls_m: (plans, vehicles, n, 3) control points, ENU [m], start and target included.
        objective: (plans,) is filled with eq. 13, summed over all vehicles.
        violation: (plans,) is filled with the sums of all squared violations.
    """
    n_plans, n_vehicles = controls_m.shape[:2]
    n_samples, n_fractions = len(problem.samples.first), len(problem.coupling.first)
    points, chords = np.empty((n_samples, 3)), np.empty(n_samples - 1)
    places, unused = np.empty((n_vehicles, n_fractions, 3)), np.zeros((n_vehicles, n_fractions, 3))
    side, share, steps = np.empty(n_fractions, np.int64), np.empty(n_fractions), np.empty(n_vehicles)
    joins, by_join = np.empty((n_vehicles, 3)), np.zeros((n_vehicles, 3))
    join_weights, join_slopes = np.empty(4), np.empty(3)
    joined_from_pads = len(problem.joining.hovers_m) > 0 and n_vehicles > 1
    unwanted = new_adjoint(0)
    for plan in range(n_plans):
        objective[plan] = violation[plan] = 0.0
        for i in range(n_vehicles):
            cost, broken = curve_cost(
                controls_m[plan, i],
                problem.samples,
                problem.terms,
                problem.obstacles,
                problem.zones_m[i],
                points,
                chords,
                unwanted,
            )
            objective[plan], violation[plan] = objective[plan] + cost, violation[plan] + broken
            steps[i] = at_fractions(points, chords, places[i], side, share)
            if joined_from_pads:
                join(
                    controls_m[plan, i],
                    problem.samples,
                    points,
                    problem.joining.distance_m,
                    joins[i],
                    join_weights,
                    join_slopes,
                )
        if n_vehicles > 1:
            violation[plan] += _between_all(problem.coupling, 0.0, places, steps, unused)
        if joined_from_pads:
            violation[plan] += _joining_all(problem.joining, 0.0, joins, by_join)


@compiled
def _to_offsets(by_control: Array, axes_m: Array, pins: IntArray, weights: Array, gradient: Array) -> None:
    """Derivatives by offsets from (n, 3) derivatives by control points, which are overwritten."""
    for c in pins:
        if c > 0:
            for axis in range(3):
                by_control[c - 1, axis] -= weights[c, 0] / weights[c, 1] * by_control[c, axis]
                by_control[c + 1, axis] -= weights[c, 2] / weights[c, 1] * by_control[c, axis]
                by_control[c, axis] = 0.0
    for i in range(len(axes_m)):
        for j in range(2):
            gradient[2 * i + j] = 0.0
            for axis in range(3):
                gradient[2 * i + j] += axes_m[i, j, axis] * by_control[i + 1, axis]


@compiled
def _between_all(coupling: Coupling, weight: float, places_m: Array, steps_m: Array, by_place: Array) -> float:
    """Squared violations between all pairs at (vehicles, k, 3) places, adding `weight` times their derivatives."""
    n, violation = len(places_m), 0.0
    mean = np.zeros(n)
    for a in range(n):
        for b in range(a):
            violation += too_close(
                places_m[a],
                places_m[b],
                steps_m[a] + steps_m[b],
                steps_m[b],
                coupling,
                weight,
                by_place[a],
                by_place[b],
            )
            apart = mean_distance(places_m[a], places_m[b]) / (n - 1)
            mean[a] += apart
            mean[b] += apart
    for a in range(n):
        out = out_of_bounds(mean[a], coupling)
        violation += out * out
        mean[a] = 2.0 * weight * out / coupling.mean_unit_m / (n - 1)
    for a in range(n):
        for b in range(a):
            if mean[a] + mean[b] != 0.0:
                add_mean_gradient(places_m[a], places_m[b], mean[a] + mean[b], by_place[a], by_place[b])
    return violation


@compiled
def _joining_all(joining: Joining, weight: float, joins_m: Array, by_join: Array) -> float:
    """Squared violations between all pairs on their ways to (vehicles, 3) places, with `weight` times derivatives."""
    violation = 0.0
    for a in range(len(joins_m)):
        for b in range(a):
            violation += in_contact(joining, a, joins_m[a], b, joins_m[b], weight, by_join[a], by_join[b])
    return violation


@compiled
def _towards_others(coupling: Coupling, vehicle: int, places_m: Array, step_m: float, context: Context) -> float:
    """Squared violations of the limits between vehicles that change when one of them flies (k, 3) other places."""
    n, violation, total = len(context.places_m), 0.0, 0.0
    for other in range(n):
        if other == vehicle:
            continue
        their_step_m = context.steps_m[other]
        violation += too_close(
            places_m, context.places_m[other], step_m + their_step_m, their_step_m, coupling, 0.0, places_m, places_m
        )
        apart = mean_distance(places_m, context.places_m[other])
        total += apart
        theirs = context.means_m[other].sum() - context.means_m[other, vehicle] + apart
        violation += out_of_bounds(theirs / (n - 1), coupling) ** 2
    return violation + out_of_bounds(total / (n - 1), coupling) ** 2
