"""A way around what blocks the guide: A* on a grid, then straightened. Asked only when the guide itself is blocked.

The cost of a way is its time at the speeds that the mission's rule allows: obstacles are passed slowly or far off. A
cell is looked at when the search comes to it, not before. Ways beside things are looked for first, on a sheet from
start to goal that is one cell thick; ways over and under them only where going beside them takes much longer.
"""

import heapq
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from companion.planner.limits import FlightLimits, Surroundings, ends_of, free_space, lacking, span
from missions.kernels import compiled

Array = npt.NDArray[np.float64]

MAX_CELLS = 60_000
QUICK_CELLS = 6_000
"""A quick search gives up when it has gone on from so many cells: a few milliseconds."""
NARROW_CELL = 0.5
"""Size of the cells for narrow places, as a share of the usual one."""
BESIDE_IS_WELL = 1.5
"""A way on the sheet that takes at most this multiple of the straight line's time is not compared with any other."""
STEEPEST_SHEET = 0.5
"""Share of the steepest climb that a sheet may have."""
CELL_MARGIN = 0.25
"""Cells need so much more clearance, as a share of their size: the way between two cells is clear as well."""
FADED_CELLS = 6.0
"""The margin fades out within so many cells of either end: who stands in a narrow place is not walled in by it."""
PROBES_PER_CELL = 2.0
"""How densely a straight line is looked at."""
BERTH_RESERVES, NEAR_SHARE = 4.0, 0.7
"""With less clearance than that required and so many reserves, ways are counted as slower: this share of the speed."""
BLOCKED = 0.0
UNSEEN = -1.0
"""Speed of a cell that the search has not come to yet."""
SQRT2, SQRT3 = float(np.sqrt(2.0)), float(np.sqrt(3.0))
GREED = 1.3
"""The estimate of the rest of a way is taken by so much too seriously: far fewer cells, hardly longer ways."""


def way_around(
    start_m: Array,
    goal_m: Array,
    room_m: float,
    cell_m: float,
    limits: FlightLimits,
    around: Surroundings,
    *,
    narrow: bool = False,
    flat: bool = False,
    quick: bool = False,
) -> Array:
    """The quickest way from one place to another.

    Args:
        start_m: (3,) ENU [m].
        goal_m: (3,) ENU [m].
        room_m: how far around the two to look.
        cell_m: least size of a cell; larger ones are taken where there would be too many.
        limits: clearance and speeds.
        around: what is in the way, and the flight range.
        narrow: take smaller cells, which need a smaller margin and fit through narrower places.
        flat: go over or under things only where going beside them is possible, but takes longer.
        quick: give up early, as who is in flight has to.

    Returns:
        (m, 3) corners from start to goal; (0, 3) when there is no way.
    """
    start_m, goal_m = np.asarray(start_m, dtype=float), np.asarray(goal_m, dtype=float)
    cell_m, most_cells = NARROW_CELL * cell_m if narrow else cell_m, QUICK_CELLS if quick else MAX_CELLS
    return find_way(start_m, goal_m, room_m, cell_m, CELL_MARGIN, flat, most_cells, limits, around)


class Lattice(NamedTuple):
    """Where cells lie."""

    low_m: Array
    """(3,) the first cell, ENU."""
    cell_m: float
    shape: npt.NDArray[np.int64]
    """(3,) number of cells."""
    tilt: Array
    """(2,) how steeply its layers rise to the east and to the north."""
    first: npt.NDArray[np.int64]
    """(3,) the cell where ways begin; it may be blocked itself."""
    last: npt.NDArray[np.int64]
    """(3,) where they end; likewise."""


@compiled
def find_way(
    start_m: Array,
    goal_m: Array,
    room_m: float,
    cell_m: float,
    margin: float,
    flat: bool,
    most_cells: int,
    limits: FlightLimits,
    around: Surroundings,
) -> Array:
    """`way_around`, compiled: between (3,) places; `margin` in cells, at most so many of them, in a sheet if `flat`."""
    low = np.maximum(np.minimum(start_m, goal_m) - room_m, around.room_m[0])
    high = np.minimum(np.maximum(start_m, goal_m) + room_m, around.room_m[1])
    ends, off = ends_of(start_m, goal_m, around, limits), goal_m - start_m
    level2, beside, beside_s = off[0] * off[0] + off[1] * off[1], np.empty((0, 3)), np.inf
    if abs(off[2]) <= STEEPEST_SHEET * limits.climb_tangent * np.sqrt(level2):
        tilt = off[:2] * (off[2] / max(level2, 1e-9))
        low_up = start_m[2] + tilt[0] * (low[0] - start_m[0]) + tilt[1] * (low[1] - start_m[1])
        sheet_low = np.array([low[0], low[1], low_up])
        sheet_high = np.array([high[0], high[1], low_up])
        sheet = lattice_between(sheet_low, sheet_high, start_m, goal_m, cell_m, tilt)
        beside, beside_s = astar(
            sheet, margin * sheet.cell_m, start_m, goal_m, most_cells, np.inf, limits, around, ends
        )
        straight_s = span(off[0], off[1], off[2]) / limits.cruise_m_s
        if beside_s <= BESIDE_IS_WELL * straight_s:
            return straighten(beside, sheet.cell_m, limits, around, ends)
    if flat and len(beside) == 0:
        return beside
    space = lattice_between(low, high, start_m, goal_m, cell_m, np.zeros(2))
    path, path_s = astar(space, margin * space.cell_m, start_m, goal_m, most_cells, beside_s, limits, around, ends)
    if not path_s < beside_s:
        path = beside
    return straighten(path, space.cell_m, limits, around, ends) if len(path) > 0 else path


@compiled
def lattice_between(low: Array, high: Array, start_m: Array, goal_m: Array, cell_m: float, tilt: Array) -> Lattice:
    """A lattice that fills a box from `low` to `high`, (3,) each; its cells are larger where they would be too many."""
    volume, axes = 1.0, 3 if high[2] > low[2] else 2
    for axis in range(axes):
        volume *= max(high[axis] - low[axis], cell_m)
    cell_m = max(cell_m, (volume / MAX_CELLS) ** (1.0 / axes))
    shape, first, last = np.ones(3, np.int64), np.zeros(3, np.int64), np.zeros(3, np.int64)
    for axis in range(axes):
        shape[axis] = max(int(np.floor((high[axis] - low[axis]) / cell_m)), 0) + 1
        first[axis] = min(max(int(np.rint((start_m[axis] - low[axis]) / cell_m)), 0), shape[axis] - 1)
        last[axis] = min(max(int(np.rint((goal_m[axis] - low[axis]) / cell_m)), 0), shape[axis] - 1)
    return Lattice(low, cell_m, shape, tilt, first, last)


@compiled
def astar(
    lattice: Lattice,
    margin_m: float,
    start_m: Array,
    goal_m: Array,
    most_cells: int,
    most_s: float,
    limits: FlightLimits,
    around: Surroundings,
    ends: Array,
) -> tuple[Array, float]:
    """(m, 3) places of the quickest way between two, both included, and its time [s]; (0, 3) when there is none.

    Args:
        lattice: the cells.
        margin_m: cells need so much more clearance, but for those around the first and the last one.
        start_m, goal_m: (3,) both ends, ENU.
        most_cells: it is given up when the search has gone on from so many.
        most_s: only quicker ways are of interest.
        limits, around, ends: see `lacking`.
    """
    shape, cell_m, first, last = lattice.shape, lattice.cell_m, lattice.first, lattice.last
    n_north, n_up = shape[1], shape[2]
    begin, end = (first[0] * n_north + first[1]) * n_up + first[2], (last[0] * n_north + last[1]) * n_up + last[2]
    n, gone_on = shape[0] * n_north * n_up, 0
    speeds, cost, parents = np.full(n, UNSEEN), np.full(n, np.inf), np.full(n, -1, np.int64)
    probe, climb_sine, fast_m_s = new_probe(), sine_of(limits), limits.cruise_m_s
    cost[begin] = 0.0
    queue: list[tuple[float, int]] = [(0.0, int(begin))]
    while len(queue) > 0 and gone_on < most_cells:
        estimate, cell = heapq.heappop(queue)
        east, north, up = cell // (n_north * n_up), cell // n_up % n_north, cell % n_up
        ahead = GREED * steps_between(last[0] - east, last[1] - north, last[2] - up) * cell_m / fast_m_s
        if cell == end:
            break
        if estimate > cost[cell] + ahead + 1e-9:
            continue  # an older entry of the queue: a quicker way was found since
        gone_on += 1
        for step in range(27):
            de, dn, du = step // 9 - 1, step // 3 % 3 - 1, step % 3 - 1
            e, n_, u = east + de, north + dn, up + du
            if e < 0 or n_ < 0 or u < 0 or e >= shape[0] or n_ >= n_north or u >= n_up:
                continue
            other = (e * n_north + n_) * n_up + u
            if speeds[other] == UNSEEN:
                put(lattice, e, n_, u, probe.place_m[0])
                off = min(span(e - first[0], n_ - first[1], u - first[2]), span(e - last[0], n_ - last[1], u - last[2]))
                speeds[other] = speed_at(probe, margin_m * min(off / FADED_CELLS, 1.0), limits, around, ends)
            if speeds[other] == BLOCKED and other != end:
                continue
            length_m = climbed(span(de, dn, du), du, climb_sine) * cell_m
            reached = cost[cell] + length_m / max(speeds[other], NEAR_SHARE * limits.avoidance_m_s)
            if reached < cost[other]:
                left = steps_between(last[0] - e, last[1] - n_, last[2] - u) * cell_m / fast_m_s
                if reached + left < most_s:
                    cost[other], parents[other] = reached, cell
                    heapq.heappush(queue, (float(reached + GREED * left), int(other)))
    return _trace(parents, begin, end, lattice, start_m, goal_m), float(cost[end])


@compiled
def put(lattice: Lattice, east: int, north: int, up: int, place_m: Array) -> None:
    """Write where a cell is into (3,)."""
    cell_m, tilt = lattice.cell_m, lattice.tilt
    place_m[0], place_m[1] = lattice.low_m[0] + cell_m * east, lattice.low_m[1] + cell_m * north
    place_m[2] = lattice.low_m[2] + cell_m * (up + tilt[0] * east + tilt[1] * north)


@compiled
def steps_between(de: int, dn: int, du: int) -> float:
    """Length, in cells, of the shortest way on an empty grid with 26 neighbours."""
    a, b, c = abs(de), abs(dn), abs(du)
    most, least = max(a, max(b, c)), min(a, min(b, c))
    return most + (SQRT2 - 1.0) * (a + b + c - most - least) + (SQRT3 - SQRT2) * least


class Probe(NamedTuple):
    """Room to look at one place."""

    place_m: Array
    """(1, 3)."""
    free_m: Array
    """(1,)."""
    lacking_m: Array
    """(1,)."""
    scarce_m: Array
    """(1,)."""


@compiled
def new_probe() -> Probe:
    return Probe(np.empty((1, 3)), np.empty(1), np.empty(1), np.empty(1))


@compiled
def speed_at(probe: Probe, margin_m: float, limits: FlightLimits, around: Surroundings, ends: Array) -> float:
    """The speed [m/s] that is allowed at the probe's place; BLOCKED where clearance (less a margin) or height lacks.

    Near obstacles it is less: from afar their edges are seen roughly, and ways that hug them are soon blocked again.
    """
    free_space(probe.place_m, 0.0, around, probe.free_m)
    slow = probe.free_m[0] < limits.avoidance_distance_m
    near = probe.free_m[0] < limits.clearance_m + BERTH_RESERVES * limits.reserve_m
    probe.free_m[0] -= margin_m
    lacking(probe.place_m, probe.free_m, 0.0, around, ends, limits, probe.lacking_m, probe.scarce_m)
    if probe.lacking_m[0] > 0.0:
        return BLOCKED
    speed_m_s = limits.avoidance_m_s if slow else limits.cruise_m_s
    return speed_m_s * NEAR_SHARE if near else speed_m_s


@compiled
def _trace(
    parents: npt.NDArray[np.int64], begin: int, end: int, lattice: Lattice, start_m: Array, goal_m: Array
) -> Array:
    count, cell = 1, end
    while cell != begin:
        cell = parents[cell]
        if cell < 0:
            return np.empty((0, 3))
        count += 1
    path, cell, n_north, n_up = np.empty((max(count, 2), 3)), end, lattice.shape[1], lattice.shape[2]
    for i in range(count - 1, -1, -1):
        put(lattice, cell // (n_north * n_up), cell // n_up % n_north, cell % n_up, path[i])
        cell = parents[cell]
    path[0], path[len(path) - 1] = start_m, goal_m
    return path


@compiled
def climbed(length_m: float, up_m: float, climb_sine: float) -> float:
    """Length [m] of a way, or of the longer one that climbs (or descends) as far at the steepest angle allowed."""
    return max(length_m, abs(up_m) / climb_sine)


@compiled
def straighten(path: Array, cell_m: float, limits: FlightLimits, around: Surroundings, ends: Array) -> Array:
    """Leave out corners of a (m, 3) path where the straight line is clear and no slower, found by bisection."""
    probe, m = new_probe(), len(path)
    times = np.zeros(m)
    for i in range(1, m):
        times[i] = times[i - 1] + flown_s(path[i - 1], path[i], cell_m, limits, around, ends, probe, np.inf)
    kept, count = np.zeros(m, np.int64), 1
    while kept[count - 1] < m - 1:
        i, j = kept[count - 1], m - 1
        reached, beyond = i + 1, m
        while j > reached:
            most_s = times[j] - times[i] + 1e-9
            if flown_s(path[i], path[j], cell_m, limits, around, ends, probe, most_s) <= most_s:
                reached = j
            else:
                beyond = j
            j = (reached + beyond) // 2
        kept[count] = reached
        count += 1
    return path[kept[:count]]


@compiled
def flown_s(
    a: Array,
    b: Array,
    cell_m: float,
    limits: FlightLimits,
    around: Surroundings,
    ends: Array,
    probe: Probe,
    most_s: float,
) -> float:
    """Time [s] along a straight line at the allowed speeds; where it is blocked, a thousand times the slowest.

    It is not looked at any farther once it takes more than `most_s`.
    """
    length_m = span(b[0] - a[0], b[1] - a[1], b[2] - a[2])
    n = max(int(np.ceil(length_m / cell_m * PROBES_PER_CELL)), 1)
    margin_m = min(limits.reserve_m, CELL_MARGIN * cell_m)
    part_m, total_s = climbed(length_m, b[2] - a[2], sine_of(limits)) / n, 0.0
    for i in range(n):
        share = (i + 0.5) / n
        for axis in range(3):
            probe.place_m[0, axis] = a[axis] + share * (b[axis] - a[axis])
        speed_m_s = speed_at(probe, margin_m, limits, around, ends)
        total_s += part_m / (speed_m_s if speed_m_s > BLOCKED else 1e-3 * limits.avoidance_m_s)
        if total_s > most_s:
            break
    return total_s


@compiled
def sine_of(limits: FlightLimits) -> float:
    """Of the steepest climb."""
    return np.sin(np.arctan(limits.climb_tangent))
