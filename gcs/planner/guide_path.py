"""A way around obstacles for vehicles whose straight line is hopeless: the shortest path on a grid, pulled taut."""

import itertools
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from gcs.planner.curves import lengths
from gcs.planner.limits import flight_box
from gcs.planner.problem import Route, Way
from missions import obstacles
from missions.mission import Mission
from missions.obstacles import Obstacles

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

MOST_CELLS = 60_000
CELL_SHARE = 0.5
"""Cells are as wide as this share of the limit of clearance, if that does not make too many."""
SPARE = 1.05
"""The path keeps so many times the limit of clearance, since no curve follows it exactly."""

STEPS = [step for step in itertools.product((-1, 0, 1), repeat=3) if step > (0, 0, 0) and any(step[:2])]
"""Half of the steps to neighbouring cells, the other half being their opposites; none is straight up."""


@dataclass(frozen=True)
class _Errand:
    """Who wants to get where, and how far away from everything.

    Args:
        mission: for its limits.
        solid: what stands in its world, as it is known.
        start_m: (3,) ENU.
        target_m: (3,).
        clearance_m: to be kept on the way.
    """

    mission: Mission
    solid: Obstacles
    start_m: Array
    target_m: Array
    clearance_m: float

    def is_free(self, points_m: Array) -> BoolArray:
        """(n,) whether the vehicle may be at (n, 3) points."""
        limits = self.mission.limits
        to_ends_m = np.minimum(lengths(points_m - self.start_m), lengths(points_m - self.target_m))
        in_zone = to_ends_m < self.mission.launch_zone_radius_m
        clear = obstacles.clearance(points_m, self.solid) >= np.where(in_zone, limits.body_radius_m, self.clearance_m)
        height_m = points_m[:, 2] - obstacles.terrain_height(points_m, self.solid)
        return clear & (height_m >= np.where(in_zone, 0.0, limits.height_m))


def guide_way(mission: Mission, route: Route, wider: float = 1.0) -> Way | None:
    """A way from target to target along guide paths; None where one of them cannot be reached from the one before it.

    Args:
        mission: world and limits.
        route: of one vehicle.
        wider: factor on the limit of clearance.
    """
    legs_m = [guide_path(mission, begin_m, end_m, wider) for begin_m, end_m in itertools.pairwise(route.places_m)]
    paths_m = [leg_m for leg_m in legs_m if leg_m is not None]
    if len(paths_m) < len(legs_m):
        return None
    corners_m = np.concatenate((route.start_m[None], *(path_m[1:] for path_m in paths_m)))
    ends = np.cumsum([len(path_m) - 1 for path_m in paths_m])
    return Way(corners_m, tuple(ends[:-1].tolist()))


def guide_path(mission: Mission, start_m: Array, target_m: Array, wider: float = 1.0) -> Array | None:
    """(m, 3) corners of a short way from start to target that keeps the limits of clearance, height and climb angle.

    Args:
        mission: world and limits.
        start_m: (3,) ENU.
        target_m: (3,).
        wider: factor on the limit of clearance.

    Returns:
        None where there is no way, as far as the grid can tell.
    """
    solid = obstacles.pack(mission.world.as_known())
    errand = _Errand(mission, solid, start_m, target_m, SPARE * wider * mission.limits.clearance_m)
    cell_m = _cell_m(mission)
    low_m, high_m = flight_box(mission)
    shape = np.floor((high_m - low_m) / cell_m).astype(int) + 1
    cells = np.stack(np.unravel_index(np.arange(np.prod(shape)), shape), axis=-1)
    centres_m = low_m + cells * cell_m
    free = errand.is_free(centres_m)
    if not free.any():
        return None
    begin, end = (int(np.argmin(np.where(free, lengths(centres_m - at_m), np.inf))) for at_m in (start_m, target_m))
    away_m, before = dijkstra(_graph(cells, shape, free, cell_m), indices=begin, return_predecessors=True)
    if not np.isfinite(away_m[end]):
        return None
    way = [end]
    while way[-1] != begin:
        way.append(int(before[way[-1]]))
    return _taut(errand, np.concatenate((start_m[None], centres_m[way[::-1]], target_m[None])), float(cell_m.min()))


def _cell_m(mission: Mission) -> Array:
    """(3,) size of a cell: steps to neighbours are level, or as steep as vehicles may climb."""
    low_m, high_m = flight_box(mission)
    steep = min(float(np.tan(np.radians(mission.limits.climb_angle_deg))), 1.0)
    fine_m = CELL_SHARE * max(mission.limits.clearance_m, mission.limits.body_radius_m)
    coarse_m = float(np.prod(high_m - low_m) / steep / MOST_CELLS) ** (1.0 / 3.0)
    return max(fine_m, coarse_m) * np.array([1.0, 1.0, steep])


def _graph(cells: IntArray, shape: IntArray, free: BoolArray, cell_m: Array) -> csr_array:
    """Distances between neighbouring free cells, both ways."""
    strides = np.array([shape[1] * shape[2], shape[2], 1])
    starts: list[IntArray] = []
    ends: list[IntArray] = []
    weights: list[Array] = []
    for step in STEPS:
        there = cells + np.array(step)
        inside = np.flatnonzero(free & np.all((there >= 0) & (there < shape), axis=1))
        reached = inside + int(strides @ step)
        both = free[reached]
        starts.append(inside[both])
        ends.append(reached[both])
        weights.append(np.full(np.count_nonzero(both), float(np.linalg.norm(cell_m * step))))
    ij = (np.concatenate(starts + ends), np.concatenate(ends + starts))
    return csr_array((np.concatenate(weights + weights), ij), shape=(len(cells), len(cells)))


def _taut(errand: _Errand, path_m: Array, spacing_m: float) -> Array:
    """The corners that remain when the path is pulled straight wherever nothing is in the way."""
    kept, at, last = [0], 0, len(path_m) - 1
    while at < last:
        farther = range(last, at + 1, -1)
        at = next((end for end in farther if _in_sight(errand, path_m[at], path_m[end], spacing_m)), at + 1)
        kept.append(at)
    return path_m[kept]


def _in_sight(errand: _Errand, begin_m: Array, end_m: Array, spacing_m: float) -> bool:
    leg = end_m - begin_m
    if abs(leg[2]) > np.hypot(leg[0], leg[1]) * np.tan(np.radians(errand.mission.limits.climb_angle_deg)):
        return False
    count = int(np.ceil(np.linalg.norm(leg) / spacing_m)) + 1
    return bool(errand.is_free(begin_m + np.linspace(0.0, 1.0, count)[:, None] * leg).all())
