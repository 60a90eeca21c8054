"""The door of the map: scans go in, an immutable view of what is around comes out."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from companion.mapping.distance_field import (
    SATURATED,
    VOXELS_PER_NODE,
    Field,
    no_field,
    templates,
)
from companion.mapping.movers import Mover, MoverWatch
from companion.mapping.occupancy import BLOCK, HIT, Grid, integrate, rebuild, vacate
from companion.mapping.sorting import CANDIDATE, NEAR_SELF, Known, sort_points
from companion.sensing.scan import Scan

Array = npt.NDArray[np.float64]

WINDOW_VOXELS = np.array([256, 256, 64])
"""The largest map; it moves along with the vehicle ..."""
OFF_CENTRE = 0.2
"""... when this share of it lies between the vehicle and the middle."""
MARGIN_VOXELS = 8
"""Beyond the flight range."""
LEAST_REACH, LARGEST_REACH = 3, 10
"""Of the distance field, in nodes."""
REBUILT_PER_SCAN = 8
"""Stale blocks that a scan takes out of the field."""
CERTAIN = 2 * HIT
"""A voxel of this strength was hit by more than one scan: noise and passers-by seldom are."""


@dataclass(frozen=True)
class View:
    """What is known of the surroundings at one moment; never changed.

    Args:
        field: distances to what stands.
        movers: what moves.
    """

    field: Field
    movers: tuple[Mover, ...] = ()


NOTHING_SEEN = View(no_field())


class LocalMap:
    """A rolling map of one vehicle's surroundings.

    Args:
        known: what need not be mapped: known obstacles, the ground, the flight range.
        voxel_m: edge of a voxel.
        reach_m: distances up to this are wanted.
        body_radius_m: of this vehicle; what is nearer to the sensor is itself.
    """

    def __init__(self, known: Known, voxel_m: float, reach_m: float, body_radius_m: float) -> None:
        self.view = NOTHING_SEEN
        """The latest; replaced as a whole by each scan, so that others may read it at any time."""
        self._known, self._body_radius_m = known, body_radius_m
        spacing_m = VOXELS_PER_NODE * voxel_m
        reach_nodes = int(np.clip(np.ceil(reach_m / spacing_m), LEAST_REACH, LARGEST_REACH))
        size_m = known.room_m[1] - known.room_m[0]
        wanted = np.ceil((size_m / voxel_m + 2 * MARGIN_VOXELS) / BLOCK).astype(np.int64) * BLOCK
        self._size = np.minimum(wanted, WINDOW_VOXELS)
        self._fits = wanted <= WINDOW_VOXELS
        low_m = known.room_m[0] - MARGIN_VOXELS * voxel_m
        self._grid = _empty(self._size, low_m, voxel_m, templates(reach_nodes), (reach_nodes + 0.25) * spacing_m)
        self._watch = MoverWatch(voxel_m)
        self._next_block = 0

    def observe(self, scan: Scan, others: Array) -> None:
        """Take in a scan.

        Args:
            scan: what was seen.
            others: (k, 4) balls, middle ENU [m] and radius [m], in which neighbours are seen at that time.
        """
        self._recentre(scan.sensor_enu_m)
        points_m = np.ascontiguousarray(scan.points_enu_m, dtype=float)
        kinds = sort_points(points_m, scan.sensor_enu_m, self._body_radius_m, self._known, others)
        candidates = np.ascontiguousarray(points_m[kinds == CANDIDATE])
        moving = self._watch.observe(scan.time_s, scan.sensor_enu_m, candidates)
        rays = np.ascontiguousarray(points_m[kinds != NEAR_SELF])
        grid = self._grid
        integrate(grid, scan.sensor_enu_m, np.ascontiguousarray(candidates[~moving]), rays)
        for place_m, radius_m in self._watch.vacated():
            self.forget(place_m, radius_m)
        self._next_block = rebuild(grid, self._next_block, REBUILT_PER_SCAN)
        field = Field(grid.field.copy(), grid.low_m, VOXELS_PER_NODE * grid.voxel_m, grid.step_m)
        self.view = View(field, self._watch.movers)

    def certain(self) -> tuple[Array, Array, Array]:
        """What is occupied for certain: (n, 3) centres of voxels, ENU [m], and the window's two corners.

        Ask it in the thread that observes.
        """
        grid = self._grid
        flat = np.flatnonzero(grid.strength.ravel() >= CERTAIN)  # many times faster than an argwhere of three axes
        voxels = np.column_stack(np.unravel_index(flat, grid.strength.shape))
        centres_m = grid.low_m + (voxels + 0.5) * grid.voxel_m
        return centres_m, grid.low_m, grid.low_m + self._size * grid.voxel_m

    def forget(self, centre_m: Array, radius_m: float) -> None:
        """Take everything in a ball, centre (3,) ENU, out of the map."""
        vacate(self._grid, centre_m, radius_m)

    def _recentre(self, sensor_m: Array) -> None:
        """Move the window, in whole blocks, so that the vehicle is not near its edge."""
        grid = self._grid
        off = (sensor_m - grid.low_m) / grid.voxel_m - 0.5 * self._size
        off = np.where(self._fits | (np.abs(off) < OFF_CENTRE * self._size), 0.0, off)
        shift = np.rint(off / BLOCK).astype(np.int64)
        if np.any(shift != 0):
            self._grid = _shifted(grid, shift)


def _empty(
    size: npt.NDArray[np.int64], low_m: Array, voxel_m: float, masks: npt.NDArray[np.uint8], reach_m: float
) -> Grid:
    return Grid(
        np.zeros(size, np.int8),
        np.full(size // VOXELS_PER_NODE, SATURATED, np.uint8),
        np.zeros(size // BLOCK, np.int32),
        np.zeros(size // BLOCK, np.uint8),
        masks,
        np.asarray(low_m, dtype=float),
        voxel_m,
        reach_m / SATURATED,
    )


def _shifted(grid: Grid, blocks: npt.NDArray[np.int64]) -> Grid:
    """The same map `blocks` (3,) farther east, north, up; what leaves it is forgotten."""
    reach_m = grid.step_m * SATURATED
    new = _empty(
        np.array(grid.strength.shape), grid.low_m + blocks * BLOCK * grid.voxel_m, grid.voxel_m, grid.templates, reach_m
    )
    for before, after in zip(grid[:4], new[:4], strict=True):
        per_block = np.array(before.shape) // np.array(grid.counts.shape)
        shift = blocks * per_block
        after[_overlap(-shift, before.shape)] = before[_overlap(shift, before.shape)]
    return new


def _overlap(shift: npt.NDArray[np.int64], shape: tuple[int, ...]) -> tuple[slice, ...]:
    return tuple(slice(max(int(s), 0), max(n + min(int(s), 0), 0)) for s, n in zip(shift, shape, strict=True))
