"""Tabu search beside the swarm: a random subset of the neighbourhood, a tabu list, aspiration.

A neighbour differs in one number: the time scale, or the weight of one smooth mode on one axis. The list holds the
local optima that were left; what lies near them is not searched. A listed optimum that is better than all of an
iteration's subset is released after some iterations (the aspiration criterion).
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from companion.planner.dominance import is_preferred
from companion.planner.evaluation import LocalProblem, evaluate
from missions.kernels import compiled

Array = npt.NDArray[np.float64]

RADIUS = 0.5
"""Tabu is what lies nearer to a listed optimum than this, measured in present steps."""
TENURE = 3
"""Iterations before a listed optimum may be released."""
FREE_SLOT = -1


class TabuMemory(NamedTuple):
    """Where the search is, and what it left."""

    x: Array
    """(d,) where it is ..."""
    value: Array
    """(5,) ... and what that is worth."""
    listed_x: Array
    """(length, d) local optima ..."""
    listed_values: Array
    """(length, 5) ... what they are worth ..."""
    listed_at: npt.NDArray[np.int64]
    """(length,) ... and the iteration in which they were left; FREE_SLOT where there is none."""


@compiled
def new_memory(length: int, dimensions: int) -> TabuMemory:
    """A search that has not begun: anything is better than where it is."""
    return TabuMemory(
        np.zeros(dimensions),
        np.full(5, np.inf),
        np.zeros((length, dimensions)),
        np.full((length, 5), np.inf),
        np.full(length, FREE_SLOT, np.int64),
    )


@compiled
def tabu_step(
    memory: TabuMemory,
    iteration: int,
    problem: LocalProblem,
    step: Array,
    neighbours: Array,
    values: Array,
    weights: Array,
    rng: np.random.Generator,
) -> int:
    """Move to the best of a random subset of the admissible neighbours, and list what was left.

    Args:
        memory: where the search is; changed.
        iteration: counts up.
        problem: what is searched.
        step: (d,) how far a move goes in each number.
        neighbours: (s, d) is filled with the admissible ones of the subset ...
        values: (s, 5) ... and with what they are worth.
        weights: (3,) phi.
        rng: draws the subset.

    Returns:
        how many rows are filled.
    """
    count, best = 0, 0
    for _ in range(len(neighbours)):
        for j in range(len(step)):
            neighbours[count, j] = memory.x[j]
        moved = rng.integers(0, len(step))
        neighbours[count, moved] += step[moved] if rng.random() < 0.5 else -step[moved]
        if is_tabu(neighbours[count], memory, step):
            continue
        evaluate(neighbours[count], problem, values[count])
        if is_preferred(values[count], values[best], weights):
            best = count
        count += 1
    if count > 0:
        release(memory, iteration, values[best], weights)
        put_on_list(memory, iteration)
        go_to(memory, neighbours[best], values[best])
    return count


@compiled
def is_tabu(x: Array, memory: TabuMemory, step: Array) -> bool:
    """A candidate `x` (d,) lies near a listed optimum, in units of the (d,) steps."""
    for i in range(len(memory.listed_at)):
        if memory.listed_at[i] != FREE_SLOT:
            squared = 0.0
            for j in range(len(x)):
                off = (x[j] - memory.listed_x[i, j]) / step[j]
                squared += off * off
            if squared < RADIUS * RADIUS:
                return True
    return False


@compiled
def release(memory: TabuMemory, iteration: int, best_value: Array, weights: Array) -> None:
    """Aspiration: free the listed optima that are better than the best, so than all, of this iteration's subset."""
    for i in range(len(memory.listed_at)):
        served = memory.listed_at[i] != FREE_SLOT and iteration - memory.listed_at[i] >= TENURE
        if served and is_preferred(memory.listed_values[i], best_value, weights):
            memory.listed_at[i] = FREE_SLOT


@compiled
def put_on_list(memory: TabuMemory, iteration: int) -> None:
    """List where the search is; without a free slot the oldest entry goes."""
    slot = 0
    for i in range(len(memory.listed_at)):
        if memory.listed_at[i] < memory.listed_at[slot]:
            slot = i
    memory.listed_at[slot] = iteration
    for j in range(len(memory.x)):
        memory.listed_x[slot, j] = memory.x[j]
    for j in range(len(memory.value)):
        memory.listed_values[slot, j] = memory.value[j]


@compiled
def go_to(memory: TabuMemory, x: Array, value: Array) -> None:
    """Go on searching from a candidate (d,) of known value (5,)."""
    for j in range(len(x)):
        memory.x[j] = x[j]
    for j in range(len(value)):
        memory.value[j] = value[j]
