"""A way around what blocks the guide: A* on a grid, then straightened. Asked only when the guide itself is blocked.

The cost of a way is its time at the speeds that the mission's rule allows: obstacles are passed slowly or far off.
"""

import heapq
import itertools

import numpy as np
import numpy.typing as npt

from companion.planner.limits import FlightLimits, Surroundings, ends_of, free_space, lacking, span
from missions.kernels import compiled

Array = npt.NDArray[np.float64]

MAX_CELLS = 150_000
CELL_MARGIN = 0.25
"""Cells need so much more clearance, as a share of their size: the way between two cells is clear as well."""
PROBES_PER_CELL = 4.0
"""How densely a straight line is looked at."""
BLOCKED = 0.0


def way_around(
    start_m: Array, goal_m: Array, room_m: float, cell_m: float, limits: FlightLimits, around: Surroundings
) -> Array:
    """The quickest way from one place to another.

    Args:
        start_m: (3,) ENU [m].
        goal_m: (3,) ENU [m].
        room_m: how far around the two to look.
        cell_m: least size of a cell; larger ones are taken where there would be too many.
        limits: clearance and speeds.
        around: what is in the way, and the flight range.

    Returns:
        (m, 3) corners from start to goal; (0, 3) when there is no way.
    """
    low = np.maximum(np.minimum(start_m, goal_m) - room_m, around.room_m[0])
    high = np.minimum(np.maximum(start_m, goal_m) + room_m, around.room_m[1])
    cell_m = max(cell_m, float(np.prod(np.maximum(high - low, cell_m)) / MAX_CELLS) ** (1.0 / 3.0))
    shape = np.maximum(np.floor((high - low) / cell_m).astype(np.int64), 0) + 1
    places = np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), axis=-1).reshape(-1, 3)
    places = np.ascontiguousarray(low + cell_m * places)
    ends = ends_of(np.asarray(start_m, dtype=float), np.asarray(goal_m, dtype=float), around, limits)
    speeds = speeds_at(places, CELL_MARGIN * cell_m, limits, around, ends)
    first, last = (_cell_of(end[:3], low, cell_m, shape) for end in ends)
    parents = astar(speeds, shape, cell_m, first, last, limits.avoidance_m_s, limits.cruise_m_s, _climb_sine(limits))
    cells = _trace(parents, first, last)
    if not cells:
        return np.empty((0, 3))
    path = np.vstack((start_m, places[cells[1:-1]], goal_m))
    return straighten(path, cell_m, limits, around, ends)


def speeds_at(points_m: Array, margin_m: float, limits: FlightLimits, around: Surroundings, ends: Array) -> Array:
    """(m,) speeds [m/s] that are allowed at (m, 3) points; BLOCKED where clearance (less a margin) or height lacks."""
    free_m, lacking_m = np.empty(len(points_m)), np.empty(len(points_m))
    free_space(points_m, 0.0, around, free_m)
    lacking(points_m, free_m - margin_m, 0.0, around, ends, limits, lacking_m)
    slow = free_m < limits.avoidance_distance_m
    return np.where(lacking_m > 0.0, BLOCKED, np.where(slow, limits.avoidance_m_s, limits.cruise_m_s))


@compiled
def astar(
    speeds_m_s: Array,
    shape: npt.NDArray[np.int64],
    cell_m: float,
    first: int,
    last: int,
    slow_m_s: float,
    fast_m_s: float,
    climb_sine: float,
) -> npt.NDArray[np.int64]:
    """For each cell of a grid (flattened) the one before it on the quickest way from `first`; -1 where not reached.

    The first and the last cell may be blocked: they are then passed at `slow_m_s`.
    """
    cost = np.full(len(speeds_m_s), np.inf)
    parents = np.full(len(speeds_m_s), -1, np.int64)
    cost[first] = 0.0
    queue = [(0.0, first)]
    n_north, n_up = shape[1], shape[2]
    east_last, north_last, up_last = last // (n_north * n_up), last // n_up % n_north, last % n_up
    while len(queue) > 0:
        estimate, cell = heapq.heappop(queue)
        east, north, up = cell // (n_north * n_up), cell // n_up % n_north, cell % n_up
        ahead = span(east_last - east, north_last - north, up_last - up) * cell_m / fast_m_s
        if cell == last:
            break
        if estimate > cost[cell] + ahead + 1e-9:
            continue  # an older entry of the queue: a quicker way was found since
        for step in range(27):
            de, dn, du = step // 9 - 1, step // 3 % 3 - 1, step % 3 - 1
            e, n, u = east + de, north + dn, up + du
            if e < 0 or n < 0 or u < 0 or e >= shape[0] or n >= n_north or u >= n_up:
                continue
            other = (e * n_north + n) * n_up + u
            if speeds_m_s[other] == BLOCKED and other != last:
                continue
            length_m = climbed(span(de, dn, du), du, climb_sine) * cell_m
            reached = cost[cell] + length_m / max(speeds_m_s[other], slow_m_s)
            if reached < cost[other]:
                cost[other], parents[other] = reached, cell
                left = span(east_last - e, north_last - n, up_last - u) * cell_m / fast_m_s
                heapq.heappush(queue, (reached + left, other))
    return parents


@compiled
def climbed(length_m: float, up_m: float, climb_sine: float) -> float:
    """Length [m] of a way, or of the longer one that climbs (or descends) as far at the steepest angle allowed."""
    return max(length_m, abs(up_m) / climb_sine)


def straighten(path: Array, cell_m: float, limits: FlightLimits, around: Surroundings, ends: Array) -> Array:
    """Leave out the corners of a (m, 3) path wherever the straight line is clear and no slower."""
    times = np.concatenate(
        ([0.0], np.cumsum([_time(a, b, cell_m, limits, around, ends) for a, b in itertools.pairwise(path)]))
    )
    kept = [0]
    while kept[-1] < len(path) - 1:
        i, j = kept[-1], len(path) - 1
        while j > i + 1 and _time(path[i], path[j], cell_m, limits, around, ends) > times[j] - times[i] + 1e-9:
            j -= 1
        kept.append(j)
    return path[kept]


def _time(a: Array, b: Array, cell_m: float, limits: FlightLimits, around: Surroundings, ends: Array) -> float:
    """Time [s] along a straight line at the allowed speeds; a blocked line takes as long as no way around would."""
    length_m = float(np.linalg.norm(b - a))
    n = max(int(np.ceil(length_m / cell_m * PROBES_PER_CELL)), 1)
    speeds = speeds_at(a + (b - a) * ((np.arange(n)[:, None] + 0.5) / n), 0.0, limits, around, ends)
    flown_m = climbed(length_m, b[2] - a[2], _climb_sine(limits))
    return float(np.sum(flown_m / n / np.where(speeds == BLOCKED, 1e-3 * limits.avoidance_m_s, speeds)))


def _climb_sine(limits: FlightLimits) -> float:
    return float(np.sin(np.arctan(limits.climb_tangent)))


def _cell_of(point_m: Array, low: Array, cell_m: float, shape: npt.NDArray[np.int64]) -> int:
    nearest = np.clip(np.rint((point_m - low) / cell_m).astype(int), 0, shape - 1)
    return int(np.ravel_multi_index(tuple(nearest), tuple(shape)))


def _trace(parents: npt.NDArray[np.int64], first: int, last: int) -> list[int]:
    """Cells from the first to the last; empty when the last was not reached."""
    cells = [last]
    while cells[-1] != first:
        before = int(parents[cells[-1]])
        if before < 0:
            return []
        cells.append(before)
    return cells[::-1]
