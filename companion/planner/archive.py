"""The external archive ("external file") of the multi-objective swarm, and the leader that it gives (gBest).

It keeps what no entry Pareto-dominates. Entries that another one dominates by weight, but not in Pareto's sense, are
marked: they carry the diversity, may fill half of the archive, and are the first to go when it is full.
"""

from enum import IntEnum
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from companion.planner.dominance import pareto_dominates, weighted_dominates, weighted_sum
from missions.kernels import compiled

Array = npt.NDArray[np.float64]


class Offer(IntEnum):
    """What became of a candidate."""

    REJECTED = 0
    ADDED = 1
    ADDED_DOMINANT = 2
    """It Pareto-dominated an entry, which is gone."""


_REJECTED, _ADDED, _ADDED_DOMINANT = int(Offer.REJECTED), int(Offer.ADDED), int(Offer.ADDED_DOMINANT)

MARK = 5
"""Column of an entry's values, after the five of a candidate: 1 where it is dominated by weight."""


class Archive(NamedTuple):
    """Arrays of a fixed capacity; the first `n[0]` rows are in use."""

    x: Array
    """(capacity, d) candidates."""
    values: Array
    """(capacity, 6) what they are worth, and MARK."""
    n: npt.NDArray[np.int64]


@compiled
def new_archive(capacity: int, dimensions: int) -> Archive:
    """An empty archive for candidates of `dimensions` numbers."""
    return Archive(np.zeros((capacity, dimensions)), np.zeros((capacity, MARK + 1)), np.zeros(1, np.int64))


@compiled
def offer(archive: Archive, x: Array, value: Array, weights: Array, weighted: bool) -> int:
    """Offer a feasible candidate (d,) of value (5,) to the archive; an `Offer`.

    Args:
        archive: changed in place.
        x: (d,) the candidate.
        value: (5,) its objectives, then its violations.
        weights: (3,) of the objectives.
        weighted: entries are marked by weighted dominance (eqs. 16 and 17), too.
    """
    values, count = archive.values, archive.n[0]
    mark, n_marked = 0.0, 0.0
    for i in range(count):
        same = values[i, 0] == value[0] and values[i, 1] == value[1] and values[i, 2] == value[2]
        if same or pareto_dominates(values[i], value):
            return _REJECTED
        if weighted and weighted_dominates(values[i], value, weights):
            mark = 1.0
        n_marked += values[i, MARK]
    outcome = _ADDED_DOMINANT if drop_dominated(archive, value) else _ADDED
    if outcome == _ADDED and mark > 0.0 and 2 * n_marked >= len(values):
        return _REJECTED
    if archive.n[0] == len(values) and not make_room(archive, value, mark, weights):
        return _REJECTED
    for i in range(archive.n[0]):
        if weighted and weighted_dominates(value, values[i], weights):
            values[i, MARK] = 1.0
    row = archive.n[0]
    archive.n[0] += 1
    for j in range(len(x)):
        archive.x[row, j] = x[j]
    for j in range(MARK):
        values[row, j] = value[j]
    values[row, MARK] = mark
    return outcome


@compiled
def best_ranked(archive: Archive, weights: Array) -> int:
    """Index of the entry with the least weighted sum; the archive must not be empty."""
    best, least = 0, np.inf
    for i in range(archive.n[0]):
        rank = weighted_sum(archive.values[i], weights)
        if rank < least:
            best, least = i, rank
    return best


@compiled
def leader(
    archive: Archive, dominant_streak: int, barren_streak: int, patience: int, weights: Array, rng: np.random.Generator
) -> int:
    """Index of the entry that leads the swarm (gBest); the archive must not be empty.

    Pareto-dominant entries came in for k generations in a row: it is diverse and still converging, the best-ranked
    leads. None for k generations: it has converged and may sit in a local optimum, a random marked entry leads.
    In between, a random entry that is not marked.
    """
    if dominant_streak >= patience:
        return best_ranked(archive, weights)
    wanted, n_wanted = 1.0 if barren_streak >= patience else 0.0, 0
    for i in range(archive.n[0]):
        if archive.values[i, MARK] == wanted:
            n_wanted += 1
    if n_wanted == 0:
        return best_ranked(archive, weights)
    pick = rng.integers(0, n_wanted)
    for i in range(archive.n[0]):
        if archive.values[i, MARK] == wanted:
            if pick == 0:
                return i
            pick -= 1
    return 0


@compiled
def drop_dominated(archive: Archive, value: Array) -> bool:
    """Remove all entries that a `value` (3 or more,) Pareto-dominates; whether there were any."""
    count, kept = archive.n[0], 0
    for i in range(count):
        if not pareto_dominates(value, archive.values[i]):
            if kept < i:
                copy_entry(archive, i, kept)
            kept += 1
    archive.n[0] = kept
    return kept < count


@compiled
def make_room(archive: Archive, value: Array, mark: float, weights: Array) -> bool:
    """In a full archive the worst-ranked goes, marked ones first; False if that is the newcomer."""
    worst, worst_mark, worst_sum = -1, mark, weighted_sum(value, weights)
    for i in range(archive.n[0]):
        own_mark, rank = archive.values[i, MARK], weighted_sum(archive.values[i], weights)
        if own_mark > worst_mark or (own_mark == worst_mark and rank > worst_sum):
            worst, worst_mark, worst_sum = i, own_mark, rank
    if worst < 0:
        return False
    archive.n[0] -= 1
    copy_entry(archive, archive.n[0], worst)
    return True


@compiled
def copy_entry(archive: Archive, source: int, target: int) -> None:
    """Copy one row of the archive over another."""
    for j in range(archive.x.shape[1]):
        archive.x[target, j] = archive.x[source, j]
    for j in range(archive.values.shape[1]):
        archive.values[target, j] = archive.values[source, j]
