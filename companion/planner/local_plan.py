"""One replan: horizon, reference, seeds, search; shorter horizons when the long one fails. Compiled as a whole."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from companion.planner.evaluation import HARD, LocalProblem, evaluate
from companion.planner.limits import FlightLimits, Surroundings, ends_of, free_at, span
from companion.planner.mopso import SearchPlan, chosen, new_swarm, search
from companion.planner.reference import LEG_SPEED, STANDING_M_S, WIDTH, Reference, Way, apart, lay_reference
from companion.planner.spline_shape import SplineShape
from companion.planner.traffic import spline_point
from missions.kernels import compiled

Array = npt.NDArray[np.float64]

LADDER = (1.0, 0.6, 1.0 / 3.0)
"""Shares of the horizon that are tried one after the other ..."""
CREEPING = 1.0 / 6.0
"""... and the last one of a vehicle that stands: out of a narrow place."""
TIME_SCALES = (0.0, np.log(1.06), np.log(1.15), np.log(1.35))
"""Logarithms of the time scales of the first particles."""
TIME_SPREAD = 0.05
"""Of the other particles' time scales."""
MERGED_M = 1e-3
"""Points nearer to each other are one."""


class Horizon(NamedTuple):
    """How far ahead plans reach."""

    length_m: float
    duration_s: float


class LocalPlanner(NamedTuple):
    """What all replans of a vehicle have in common."""

    limits: FlightLimits
    horizon: Horizon
    shape: SplineShape
    search: SearchPlan


class LocalPlan(NamedTuple):
    """What came out of a replan."""

    control_m: Array
    """(n, 3) control points, ENU [m]."""
    knot_s: float
    value: Array
    """(5,) of the trajectory: three objectives, hard and soft violations."""
    goal_arc_m: float
    """Where on the way it comes to rest."""


@compiled
def plan_along(
    way: Way,
    from_m: float,
    start: Array,
    warm: Way,
    planner: LocalPlanner,
    around: Surroundings,
    rng: np.random.Generator,
) -> LocalPlan:
    """Plan from a state along a way, to rest on it at the end of the horizon.

    Args:
        way: the guide.
        from_m: arc [m] of the guide beside which the vehicle is.
        start: (3, 3) position, velocity, acceleration at the beginning of the plan, ENU.
        warm: the path of the committed trajectory and then the guide, its arc begins at the start; or no samples.
        planner: limits, horizon, settings.
        around: what is avoided.
        rng: the search's randomness.
    """
    plan = plan_within(LADDER[0], way, from_m, start, warm, planner, around, rng)
    for share in LADDER[1:]:
        if plan.value[HARD] > 0.0:
            plan = plan_within(share, way, from_m, start, warm, planner, around, rng)
    if plan.value[HARD] > 0.0 and span(start[1, 0], start[1, 1], start[1, 2]) < STANDING_M_S:
        plan = plan_within(CREEPING, way, from_m, start, warm, planner, around, rng)
    return plan


@compiled
def plan_within(
    share: float,
    way: Way,
    from_m: float,
    start: Array,
    warm: Way,
    planner: LocalPlanner,
    around: Surroundings,
    rng: np.random.Generator,
) -> LocalPlan:
    """Plan within a share of the horizon."""
    to_m, reference = reference_within(share, way, from_m, start, planner, around)
    problem = pose(start, reference, planner, around)
    x, n_seeds = lay_seeds(problem, warm, to_m - from_m, planner, around)
    spread = spread_of(x[0], problem)
    for i in range(n_seeds, len(x)):
        for j in range(len(spread)):
            x[i, j] = x[i % n_seeds, j] + spread[j] * rng.standard_normal()
    settings = planner.search
    swarm = new_swarm(x, settings.archive_size, settings.tabu_neighbours, settings.tabu_length)
    search(problem, swarm, spread, settings, rng)
    best, value = chosen(swarm, settings.weights)
    knot_s = evaluate(best, problem, np.empty(5))
    return LocalPlan(problem.control, knot_s, value, to_m)


@compiled
def reference_within(
    share: float, way: Way, from_m: float, start: Array, planner: LocalPlanner, around: Surroundings
) -> tuple[float, Reference]:
    """Where the plan ends on the way, and its reference: both are kept within a share of the horizon."""
    limits, n_samples = planner.limits, planner.shape.fit_path.shape[1]
    reach_m, shortest_m = share * planner.horizon.length_m, min(share, LADDER[2]) * planner.horizon.length_m
    to_m = resting_place(way, from_m, reach_m, limits, around)
    reference = lay_reference(way, from_m, to_m, start, n_samples, limits, around)
    longest_s = share * planner.horizon.duration_s
    if reference.duration_s > longest_s and to_m - from_m > shortest_m:
        reach_m = max((to_m - from_m) * longest_s / reference.duration_s, shortest_m)
        to_m = resting_place(way, from_m, reach_m, limits, around)
        reference = lay_reference(way, from_m, to_m, start, n_samples, limits, around)
    return to_m, reference


@compiled
def resting_place(way: Way, from_m: float, reach_m: float, limits: FlightLimits, around: Surroundings) -> float:
    """Arc [m] of the farthest sample within reach that is clear enough to rest there; the way's end always is."""
    last = len(way.arc_m) - 1
    if from_m + reach_m >= way.arc_m[last]:
        return way.arc_m[last]
    found_m = from_m + reach_m
    for i in range(last, -1, -1):
        arc_m = way.arc_m[i]
        if arc_m <= from_m:
            break
        if arc_m <= from_m + reach_m:
            place = way.samples[i]
            if free_at(place[0], place[1], place[2], around) >= limits.clearance_m + limits.reserve_m:
                found_m = arc_m
                break
    return found_m


@compiled
def pose(start: Array, reference: Reference, planner: LocalPlanner, around: Surroundings) -> LocalProblem:
    """The problem of finding a trajectory from a state (3, 3) (position, velocity, acceleration) along a reference."""
    shape, n = planner.shape, len(reference.samples)
    return LocalProblem(
        start,
        reference,
        fitted(shape.fit_path, reference.samples),
        ends_of(start[0], reference.samples[n - 1, :3], around, planner.limits),
        planner.limits,
        around,
        shape.rows,
        shape.layout,
        np.empty((len(shape.fit_path) + 6, 3)),
        np.empty((n, 9)),
        np.empty(n),
        np.empty(n),
        np.empty(n),
    )


@compiled
def fitted(fit_path: Array, samples: Array) -> Array:
    """(f, 3) free control points of the spline that fits samples (K + 1, 3 or more) best."""
    out = np.zeros((len(fit_path), 3))
    for i in range(len(fit_path)):
        for k in range(len(samples)):
            for axis in range(3):
                out[i, axis] += fit_path[i, k] * samples[k, axis]
    return out


@compiled
def lay_seeds(
    problem: LocalProblem, warm: Way, length_m: float, planner: LocalPlanner, around: Surroundings
) -> tuple[Array, int]:
    """(p, d) particles; the first few are laid: the reference at several time scales, the committed path, bows.

    Returns:
        the particles, and how many of them are laid.
    """
    n_free, reference = len(problem.layout), problem.reference
    x = np.zeros((planner.search.particles, 1 + 3 * n_free))
    count = 0
    for scale in TIME_SCALES:
        x[count, 0] = scale
        count += 1
    if len(warm.arc_m) > 1:
        last = len(warm.arc_m) - 1
        path = lay_reference(
            warm, 0.0, min(length_m, warm.arc_m[last]), problem.start, len(reference.samples), problem.limits, around
        )
        off = fitted(planner.shape.fit_path, path.samples) - problem.fitted_m
        x[count, 0] = np.log(path.duration_s / reference.duration_s)
        for axis in range(3):
            for j in range(n_free):
                for i in range(n_free):
                    x[count, 1 + axis * n_free + j] += planner.shape.into_modes[j, i] * off[i, axis]
        count += 1
    lay_bows(problem, x[count : count + 4])
    return x, count + 4


@compiled
def lay_bows(problem: LocalProblem, x: Array) -> None:
    """Write bows of the corridor's width to the left, to the right, up and down into (4, d) particles."""
    n_free, samples = len(problem.layout), problem.reference.samples
    last, widest_m = len(samples) - 1, samples[:, WIDTH].max()
    east, north = samples[last, 0] - problem.start[0, 0], samples[last, 1] - problem.start[0, 1]
    level_m = max(np.sqrt(east * east + north * north), 1e-6)
    for side in range(2):
        sign = 1.0 if side == 0 else -1.0
        x[side, 1] = -sign * widest_m * north / level_m
        x[side, 1 + n_free] = sign * widest_m * east / level_m
        x[2 + side, 1 + 2 * n_free] = sign * widest_m


@compiled
def spread_of(seed: Array, problem: LocalProblem) -> Array:
    """(d,) how far around the seeds to look: half the corridor, or farther where the reference is blocked."""
    value, spread = np.empty(5), np.empty(len(seed))
    evaluate(seed, problem, value)
    widest_m = problem.reference.samples[:, WIDTH].max()
    spread[:] = 0.5 * (max(widest_m, problem.limits.clearance_m) if value[HARD] > 0.0 else widest_m)
    spread[0] = TIME_SPREAD
    return spread


@compiled
def warm_way(control: Array, from_segment: float, way: Way, from_m: float, corridor_m: float) -> Way:
    """The committed path from a place on, and then the guide; no samples where that is no way at all.

    Args:
        control: (n, 3) control points of the committed trajectory, ENU [m].
        from_segment: where on it the plan begins, counted in segments.
        way: the guide.
        from_m: arc [m] of the guide beside which the plan begins.
        corridor_m: half width of the corridor.
    """
    n, m = len(control) - 3, len(way.arc_m)
    left = max(int(np.ceil(2.0 * (n - from_segment))), 1)
    samples, arcs = np.empty((left + 1 + m, 5)), np.empty(left + 1 + m)
    count = 0
    for i in range(left + 1):
        spline_point(control, from_segment + (n - from_segment) * i / left, samples[count])
        count = _appended(samples, arcs, count, way.samples[0, LEG_SPEED], corridor_m)
    nearest, least = m - 1, np.inf
    for i in range(m):
        if way.arc_m[i] >= from_m:
            off = apart2(way.samples[i], samples[count - 1])
            if off < least:
                nearest, least = i, off
    for i in range(nearest + 1, m):
        for axis in range(3):
            samples[count, axis] = way.samples[i, axis]
        count = _appended(samples, arcs, count, way.samples[i, LEG_SPEED], corridor_m)
    if count < 2:
        count = 0
    return Way(samples[:count], arcs[:count])


@compiled
def _appended(samples: Array, arcs: Array, count: int, leg_m_s: float, corridor_m: float) -> int:
    """Complete the row that was written last, unless it repeats the one before; how many rows there are."""
    samples[count, LEG_SPEED], samples[count, LEG_SPEED + 1] = leg_m_s, corridor_m
    if count == 0:
        arcs[0] = 0.0
        return 1
    arcs[count] = arcs[count - 1] + apart(samples, count, count - 1)
    return count + 1 if arcs[count] - arcs[count - 1] > MERGED_M else count


@compiled
def apart2(a: Array, b: Array) -> float:
    """Squared distance [m^2] of two (3,) points."""
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2
