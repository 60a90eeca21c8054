"""One map of what all vehicles have seen: the blocks of voxels that their companions report, fused. Sans-IO.

A voxel is occupied while any vehicle says so; who reported it takes it back by a newer revision of the block. The
map is bounded: blocks outside of the flight range are refused, and of one vehicle no more than `MOST_BLOCKS` are kept.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from scipy.spatial import KDTree

from missions.occupancy import BLOCK_VOXELS, BlockIndex, OccupancyBlock, centres_of
from missions.world import Bounds, Box

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

MOST_BLOCKS = 4096
"""Of one vehicle: a room of 50 x 50 x 10 m full of voxels of 0.2 m has as many."""
REVISION_WINDOW = 2**31
"""A revision that is ahead of the last one by less than this is newer; the counter wraps."""


NEAREST = 8
"""The nearest surface belongs to one of so many voxels whose centres are nearest."""


@dataclass(frozen=True)
class _Report:
    revision: int
    block: OccupancyBlock
    voxels: IntArray


class ObservedMap:
    """The observations of a fleet.

    Args:
        bounds: the flight range, where it is known; what lies outside of it does not concern anybody.
    """

    def __init__(self, bounds: Bounds | None = None) -> None:
        self.bounds = bounds
        self._reports: dict[int, dict[BlockIndex, _Report]] = {}
        self._voxel_m: float | None = None
        self.changes = 0
        """Counted up whenever the map looks different."""
        self._boxes: tuple[Box, ...] = ()
        self._tree: KDTree | None = None
        self._boxed_changes = self._tree_changes = 0
        self.refused = 0
        """Blocks outside of the flight range, of another voxel size, or too many."""

    def fold(self, sysid: int, block: OccupancyBlock) -> bool:
        """Take in a block that a vehicle has reported; whether the map looks different now."""
        reports = self._reports.setdefault(sysid, {})
        known = reports.get(block.index)
        if not self._is_acceptable(block) or (known is None and len(reports) >= MOST_BLOCKS):
            self.refused += 1
            return False
        if known is not None and not 0 < (block.revision - known.revision) % 2**32 < REVISION_WINDOW:
            return False
        before = known.block.occupied if known is not None else np.zeros_like(block.occupied)
        reports[block.index] = _Report(block.revision, block, block.voxels)
        self._voxel_m = block.voxel_m
        if np.array_equal(before, block.occupied):
            return False
        self.changes += 1
        return True

    def forget(self, sysid: int) -> None:
        """A companion has started anew: it counts its revisions from the beginning, and has seen nothing yet."""
        if self._reports.pop(sysid, None):
            self.changes += 1

    @property
    def voxel_m(self) -> float:
        """Edge of a voxel [m]; 0 before anything was reported."""
        return self._voxel_m or 0.0

    @property
    def voxels(self) -> IntArray:
        """(n, 3) indices of the voxels that any vehicle has seen occupied, each once."""
        seen = [report.voxels for reports in self._reports.values() for report in reports.values()]
        return _once(np.concatenate(seen)) if seen else np.empty((0, 3), np.int64)

    @property
    def points_enu_m(self) -> Array:
        """(n, 3) centres of the occupied voxels, ENU [m]."""
        return centres_of(self.voxels, self.voxel_m)

    def points_of(self, sysid: int) -> Array:
        """(n, 3) centres of the voxels that one vehicle has reported as occupied, ENU [m]."""
        seen = [report.voxels for report in self._reports.get(sysid, {}).values()]
        return centres_of(np.concatenate(seen), self.voxel_m) if seen else np.empty((0, 3))

    def boxes(self) -> tuple[Box, ...]:
        """The occupied voxels as few boxes, gaps of one voxel between them filled, as a planner reads obstacles."""
        if self._boxed_changes != self.changes:
            self._boxes, self._boxed_changes = self._merged(), self.changes
        return self._boxes

    def clearance(self, points_enu_m: Array) -> Array:
        """(n,) distances of (n, 3) ENU points from the nearest occupied voxel's surface [m]; infinite without any."""
        if self._tree_changes != self.changes:
            centres_m = self.points_enu_m
            self._tree, self._tree_changes = (KDTree(centres_m) if len(centres_m) else None), self.changes
        if self._tree is None:
            return np.full(len(points_enu_m), np.inf)
        _, nearest = self._tree.query(points_enu_m, k=min(NEAREST, self._tree.n))
        centres_m = self._tree.data[np.reshape(nearest, (len(points_enu_m), -1))]
        beside_m = np.abs(centres_m - points_enu_m[:, None]) - 0.5 * self.voxel_m
        return np.linalg.norm(np.maximum(beside_m, 0.0), axis=2).min(axis=1)

    def _merged(self) -> tuple[Box, ...]:
        spans = merged(_closed(self.voxels))
        lows_m, highs_m = spans[:, :3] * self.voxel_m, spans[:, 3:] * self.voxel_m
        middles, halves = (0.5 * (lows_m + highs_m)).tolist(), (0.5 * (highs_m - lows_m)).tolist()
        return tuple(
            Box(name=f"observed {number}", centre_m=tuple(middle), half_m=tuple(half))
            for number, (middle, half) in enumerate(zip(middles, halves, strict=True))
        )

    def _is_acceptable(self, block: OccupancyBlock) -> bool:
        if self._voxel_m is not None and block.voxel_m != self._voxel_m:
            return False
        if self.bounds is None:
            return True
        edge_m = BLOCK_VOXELS * block.voxel_m
        low_m = np.array(block.index) * edge_m
        return bool(np.all(low_m < self.bounds.high_enu_m) and np.all(low_m + edge_m > self.bounds.low_enu_m))


def _once(voxels: IntArray) -> IntArray:
    """(n, 3) voxel indices without those that occur before."""
    if len(voxels) == 0:
        return voxels
    low = voxels.min(axis=0)
    _, size_north, size_up = voxels.max(axis=0) - low + 1
    east, north, up = (voxels - low).T
    _, firsts = np.unique((east * size_north + north) * size_up + up, return_index=True)
    return voxels[firsts]


def merged(voxels: Iterable[Iterable[int]] | IntArray) -> IntArray:
    """(n, 3) voxel indices as (m, 6) boxes: lowest corner, and the corner behind the highest voxel.

    Runs along one axis are joined, then runs that lie side by side along the next one.
    """
    lows = np.asarray(voxels, np.int64).reshape(-1, 3)
    spans = np.hstack((lows, lows + 1))
    for axis in (2, 0, 1):
        spans = _joined(spans, axis)
    return spans


def _joined(spans: IntArray, axis: int) -> IntArray:
    """Boxes that touch along an axis, and are alike along the others, made one."""
    if len(spans) == 0:
        return spans
    alike = [column for column in range(6) if column not in {axis, axis + 3}]
    spans = spans[np.lexsort((spans[:, axis], *(spans[:, column] for column in alike)))]
    goes_on = np.all(spans[1:, alike] == spans[:-1, alike], axis=1) & (spans[1:, axis] == spans[:-1, axis + 3])
    begins = np.flatnonzero(np.concatenate(([True], ~goes_on)))
    ends = np.append(begins[1:], len(spans)) - 1
    joined = spans[begins].copy()
    joined[:, axis + 3] = spans[ends, axis + 3]
    return joined


def _closed(voxels: IntArray) -> IntArray:
    """Voxels with the gaps of one voxel between them filled: rays leave such gaps in a wall."""
    if len(voxels) == 0:
        return voxels
    low = voxels.min(axis=0) - 1
    grid = np.zeros(voxels.max(axis=0) - low + 2, np.bool_)
    grid[tuple((voxels - low).T)] = True
    closed = np.asarray(ndimage.binary_closing(grid, np.ones((3, 3, 3), np.bool_)), np.bool_)
    return np.argwhere(closed | grid) + low
