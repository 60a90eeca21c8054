"""Multi-objective particle swarm (eqs. 7, 8) with the paper's archive, leader and personal-best rules.

One generation moves all particles, lets the tabu search make one step, and offers everything feasible to the archive.
While nothing is feasible, the least violating candidate leads.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from companion.planner.archive import Archive, Offer, best_ranked, leader, new_archive, offer
from companion.planner.dominance import dominates, is_feasible, is_preferred, weighted_sum
from companion.planner.evaluation import HARD, LocalProblem, evaluate
from companion.planner.tabu import TabuMemory, go_to, new_memory, tabu_step
from companion.settings import SearchSettings
from missions.kernels import compiled

Array = npt.NDArray[np.float64]

INERTIA_FIRST, INERTIA_LAST = 0.7, 0.4
LEARNING = 1.5
"""c1 and c2 of eq. 7."""
SLOWEST_SCALE, FASTEST_SCALE = float(np.log(2.5)), float(np.log(0.9))
"""Bounds of the logarithm of the time scale."""
VELOCITY_SHARE = 0.5
"""Highest velocity, as a share of the spread."""
REACH = 3.0
"""Shifts are kept within so many spreads of the reference."""
STALLED_M = 2e-3
"""A generation that betters the weighted sum by less than this has not found anything."""
HOPEFUL = 0.95
"""Nor has one, while limits are broken, that leaves more than this share of the violations."""
FIRST_STEP, LAST_STEP = 0.5, 0.02
"""Steps of the tabu search, as shares of the spread."""

_ADDED_DOMINANT = int(Offer.ADDED_DOMINANT)


class SearchPlan(NamedTuple):
    """The settings of a search, as compiled code reads them."""

    iterations: int
    patience: int
    weighted_dominance: bool
    adaptive_leader: bool
    weights: Array
    """(3,) phi."""
    stall: int
    """Generations without a better candidate after which a search ends."""
    particles: int
    archive_size: int
    tabu_neighbours: int
    tabu_length: int


def search_plan(settings: SearchSettings, weights: Array) -> SearchPlan:
    """The settings of a search with (3,) weights phi."""
    return SearchPlan(
        settings.iterations,
        settings.patience_generations,
        settings.weighted_dominance,
        settings.adaptive_leader,
        weights,
        settings.stall_generations,
        settings.particles,
        settings.archive_size,
        settings.tabu_neighbours,
        settings.tabu_length,
    )


class Swarm(NamedTuple):
    """Everything that a search works on."""

    x: Array
    """(p, d) positions ..."""
    velocity: Array
    own_x: Array
    """(p, d) ... personal bests ..."""
    own_values: Array
    """(p, 5) ... and what they are worth."""
    best_x: Array
    """(d,) the most preferred candidate of all ..."""
    best_value: Array
    """(5,) ... and what it is worth."""
    archive: Archive
    memory: TabuMemory
    neighbours: Array
    """(s, d) the tabu search's subset ..."""
    neighbour_values: Array


@compiled
def new_swarm(x: Array, archive_size: int, tabu_neighbours: int, tabu_length: int) -> Swarm:
    """A swarm that begins at (p, d) positions and has not been evaluated yet."""
    particles, d = x.shape
    return Swarm(
        x,
        np.zeros_like(x),
        x.copy(),
        np.full((particles, 5), np.inf),
        np.zeros(d),
        np.full(5, np.inf),
        new_archive(archive_size, d),
        new_memory(max(tabu_length, 1), d),
        np.zeros((tabu_neighbours, d)),
        np.full((tabu_neighbours, 5), np.inf),
    )


@compiled
def search(problem: LocalProblem, swarm: Swarm, spread: Array, plan: SearchPlan, rng: np.random.Generator) -> None:
    """Evaluate the first positions, then let the swarm fly; what it found is in it.

    Args:
        problem: what is to be solved.
        swarm: where it begins; changed.
        spread: (d,) scale of the search in each number.
        plan: settings.
        rng: all of the search's randomness.
    """
    value, lead, step = np.empty(5), np.empty(len(spread)), np.empty(len(spread))
    dominant_streak = barren_streak = stalled = 0
    for iteration in range(plan.iterations + 1):
        progress = iteration / max(plan.iterations, 1)
        if iteration > 0:
            follow_leader(swarm, lead, dominant_streak, barren_streak, plan, rng)
        gained, best_before = False, swarm.best_value.copy()
        for i in range(len(swarm.x)):
            if iteration > 0:
                fly(swarm, i, lead, progress, spread, rng)
            evaluate(swarm.x[i], problem, value)
            gained |= record(swarm, swarm.x[i], value, plan)
            remember(swarm, i, value, plan, rng)
        if len(swarm.neighbours) > 0:
            for j in range(len(step)):
                step[j] = spread[j] * FIRST_STEP * (LAST_STEP / FIRST_STEP) ** progress
            if is_preferred(swarm.best_value, swarm.memory.value, plan.weights):  # the swarm is ahead: search there
                go_to(swarm.memory, swarm.best_x, swarm.best_value)
            count = tabu_step(
                swarm.memory, iteration, problem, step, swarm.neighbours, swarm.neighbour_values, plan.weights, rng
            )
            for i in range(count):
                gained |= record(swarm, swarm.neighbours[i], swarm.neighbour_values[i], plan)
        dominant_streak = dominant_streak + 1 if gained else 0
        barren_streak = 0 if gained else barren_streak + 1
        stalled = 0 if is_onto_something(swarm.best_value, best_before, plan.weights) else stalled + 1
        if stalled >= plan.stall:
            break


@compiled
def is_onto_something(best: Array, before: Array, weights: Array) -> bool:
    """A generation has bettered the best (5,) value enough for another one to be worth its time."""
    if is_feasible(best):
        gain_m = weighted_sum(before, weights) - weighted_sum(best, weights)
        return gain_m > STALLED_M or not is_feasible(before)
    return best[HARD] == 0.0 or best[HARD] < HOPEFUL * before[HARD]


@compiled
def follow_leader(
    swarm: Swarm, lead: Array, dominant_streak: int, barren_streak: int, plan: SearchPlan, rng: np.random.Generator
) -> None:
    """Write gBest into `lead` (d,)."""
    if not plan.adaptive_leader:
        dominant_streak = barren_streak = 0
    chosen = -1
    if swarm.archive.n[0] > 0:
        chosen = leader(swarm.archive, dominant_streak, barren_streak, plan.patience, plan.weights, rng)
    for j in range(len(lead)):
        lead[j] = swarm.archive.x[chosen, j] if chosen >= 0 else swarm.best_x[j]


@compiled
def fly(swarm: Swarm, i: int, lead: Array, progress: float, spread: Array, rng: np.random.Generator) -> None:
    """Move one particle (eqs. 7, 8) within the bounds of the search."""
    inertia = INERTIA_FIRST + progress * (INERTIA_LAST - INERTIA_FIRST)
    x, velocity, own = swarm.x, swarm.velocity, swarm.own_x
    for j in range(len(lead)):
        pull = LEARNING * (rng.random() * (own[i, j] - x[i, j]) + rng.random() * (lead[j] - x[i, j]))
        limit = VELOCITY_SHARE * spread[j]
        velocity[i, j] = min(max(inertia * velocity[i, j] + pull, -limit), limit)  # eq. 7
        low, high = (FASTEST_SCALE, SLOWEST_SCALE) if j == 0 else (-REACH * spread[j], REACH * spread[j])
        x[i, j] = min(max(x[i, j] + velocity[i, j], low), high)  # eq. 8


@compiled
def record(swarm: Swarm, x: Array, value: Array, plan: SearchPlan) -> bool:
    """Keep a candidate if it is the best so far or belongs in the archive; whether it came in as dominant."""
    if is_preferred(value, swarm.best_value, plan.weights):
        for j in range(len(x)):
            swarm.best_x[j] = x[j]
        for j in range(5):
            swarm.best_value[j] = value[j]
    if not is_feasible(value):
        return False
    return offer(swarm.archive, x, value, plan.weights, plan.weighted_dominance) == _ADDED_DOMINANT


@compiled
def remember(swarm: Swarm, i: int, value: Array, plan: SearchPlan, rng: np.random.Generator) -> None:
    """Make where a particle is its personal best, if the rule says so."""
    if takes_over(value, swarm.own_values[i], plan.weights, plan.weighted_dominance, rng):
        for j in range(swarm.x.shape[1]):
            swarm.own_x[i, j] = swarm.x[i, j]
        for j in range(5):
            swarm.own_values[i, j] = value[j]


@compiled
def takes_over(new: Array, old: Array, weights: Array, weighted: bool, rng: np.random.Generator) -> bool:
    """The personal-best rule: the dominating one stays or comes; a coin decides when neither dominates."""
    if not (is_feasible(new) and is_feasible(old)):
        return is_preferred(new, old, weights)
    if dominates(old, new, weights, weighted):
        return False
    return dominates(new, old, weights, weighted) or rng.random() < 0.5


@compiled
def chosen(swarm: Swarm, weights: Array) -> tuple[Array, Array]:
    """The candidate to be flown (d,) and its value (5,).

    It is the archive's entry with the least weighted sum of objectives; without any feasible one, the candidate that
    breaks least.
    """
    archive = swarm.archive
    if archive.n[0] == 0:
        return swarm.best_x, swarm.best_value.copy()
    best = best_ranked(archive, weights)
    return archive.x[best], archive.values[best, :5].copy()
