"""Which voxels are occupied: hits occupy, what is seen through becomes free, unknown is free. Compiled.

A voxel is occupied by its first hit and becomes the surer the oftener it is hit; each scan that sees through it makes
it less so. What only one scan has hit is free again after three scans that looked through it; old walls last longer.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from companion.mapping.distance_field import GROWN_VOXELS, SATURATED, VOXELS_PER_NODE, lower
from missions.kernels import compiled

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

BLOCK = 16
"""Voxels along a block's edge: what is free again is taken out of the field by blocks."""
NODES = BLOCK // VOXELS_PER_NODE
"""Field nodes along a block's edge."""
HIT, MOST = 3, 15
"""What one scan's hit adds to a voxel's strength, and the most that it gets; a scan that sees through it takes 1."""
WAS_HIT, WAS_MISSED = 64, 32
"""Flags beside the strength while a scan is taken in."""
STRENGTH = 31
CORE = 0.45
"""A ray sees through a voxel if it passes its centre by less than this share of its size ..."""
BEFORE_END = 1.6
"""... and this many sizes before it ends: what lies just in front of a surface belongs to it."""
FAR = 1e6
"""Squared distance [voxels] to what is not there."""
HALF_DIAGONAL = 0.87 * VOXELS_PER_NODE
"""No place is farther than this from a node, in voxels."""


class Grid(NamedTuple):
    """A box of voxels in the mission's frame and the distances to the occupied ones."""

    strength: npt.NDArray[np.int8]
    """(x, y, z) voxels; above 0: occupied."""
    field: npt.NDArray[np.uint8]
    """(x / 2, y / 2, z / 2) nodes of the distance field."""
    counts: npt.NDArray[np.int32]
    """(x / 16, y / 16, z / 16) occupied voxels per block."""
    stale: npt.NDArray[np.uint8]
    """Like `counts`: 1 where the field knows voxels that are free again."""
    templates: npt.NDArray[np.uint8]
    low_m: Array
    """(3,) the lowest corner, ENU [m]; it is the field's first node, too."""
    voxel_m: float
    step_m: float
    """One unit of the field [m]."""


@compiled
def integrate(grid: Grid, sensor_m: Array, hits_m: Array, ends_m: Array) -> None:
    """Take in a scan.

    Args:
        grid: changed.
        sensor_m: (3,) ENU, where the rays begin.
        hits_m: (h, 3) ENU, what is to be occupied.
        ends_m: (n, 3) ENU, ends of all rays, whatever they hit.
    """
    strength = grid.strength.reshape(-1)
    hit, n_hit = np.empty(len(hits_m), np.int64), 0
    for i in range(len(hits_m)):
        v = voxel_of(grid, hits_m[i, 0], hits_m[i, 1], hits_m[i, 2])
        if v >= 0 and strength[v] & WAS_HIT == 0:
            strength[v] |= WAS_HIT
            hit[n_hit] = v
            n_hit += 1
    missed = see_through(grid, sensor_m, ends_m)
    for i in range(n_hit):
        before = strength[hit[i]] & STRENGTH
        strength[hit[i]] = min(before + HIT, MOST)
        if before == 0:
            occupy(grid, hit[i])
    for v in missed:
        strength[v] = (strength[v] & STRENGTH) - 1
        if strength[v] == 0:
            release(grid, v)


@compiled
def see_through(grid: Grid, sensor_m: Array, ends_m: Array) -> Integers:
    """(m,) occupied voxels that rays pass through and nothing hit, flagged; open space is crossed in long steps."""
    strength, field, low_m, voxel_m = grid.strength.reshape(-1), grid.field, grid.low_m, grid.voxel_m
    missed, n_missed = np.empty(4096, np.int64), 0
    step = grid.step_m / voxel_m
    x0, y0, z0 = (
        (sensor_m[0] - low_m[0]) / voxel_m,
        (sensor_m[1] - low_m[1]) / voxel_m,
        (sensor_m[2] - low_m[2]) / voxel_m,
    )
    for i in range(len(ends_m)):
        dx, dy, dz = ends_m[i, 0] - sensor_m[0], ends_m[i, 1] - sensor_m[1], ends_m[i, 2] - sensor_m[2]
        range_m = np.sqrt(dx * dx + dy * dy + dz * dz)
        if range_m < voxel_m:
            continue
        dx, dy, dz = dx / range_m, dy / range_m, dz / range_m
        t, end = 0.0, range_m / voxel_m - BEFORE_END
        while t < end:
            x, y, z = x0 + t * dx, y0 + t * dy, z0 + t * dz
            a, b, c = int(0.5 * x + 0.5), int(0.5 * y + 0.5), int(0.5 * z + 0.5)
            if x < 0.0 or y < 0.0 or z < 0.0 or a >= field.shape[0] or b >= field.shape[1] or c >= field.shape[2]:
                break
            free = float(field[a, b, c]) * step + GROWN_VOXELS - HALF_DIAGONAL - CORE
            if free > 0.5:
                t += free
                continue
            t += 0.5
            off_x, off_y, off_z = x - np.floor(x) - 0.5, y - np.floor(y) - 0.5, z - np.floor(z) - 0.5
            v = (int(x) * grid.strength.shape[1] + int(y)) * grid.strength.shape[2] + int(z)
            through = off_x * off_x + off_y * off_y + off_z * off_z < CORE * CORE
            if through and 0 < strength[v] <= MOST and n_missed < len(missed):
                strength[v] |= WAS_MISSED
                missed[n_missed] = v
                n_missed += 1
    return missed[:n_missed]


@compiled
def voxel_of(grid: Grid, east: float, north: float, up: float) -> int:
    """Index of the voxel at a place in the flattened grid; -1 outside."""
    shape = grid.strength.shape
    x, y, z = (
        (east - grid.low_m[0]) / grid.voxel_m,
        (north - grid.low_m[1]) / grid.voxel_m,
        (up - grid.low_m[2]) / grid.voxel_m,
    )
    if not (0.0 <= x < shape[0] and 0.0 <= y < shape[1] and 0.0 <= z < shape[2]):
        return -1
    return (int(x) * shape[1] + int(y)) * shape[2] + int(z)


@compiled
def occupy(grid: Grid, v: int) -> None:
    """A voxel has become occupied: the field falls around it."""
    x, y, z = _indices(grid, v)
    grid.counts[x // BLOCK, y // BLOCK, z // BLOCK] += 1
    lower(grid.field, grid.templates[(x & 1) + 2 * (y & 1) + 4 * (z & 1)], x // 2, y // 2, z // 2)


@compiled
def release(grid: Grid, v: int) -> None:
    """A voxel has become free: the field around it is stale."""
    x, y, z = _indices(grid, v)
    grid.counts[x // BLOCK, y // BLOCK, z // BLOCK] -= 1
    reach, stale = grid.templates.shape[1] // 2, grid.stale
    for i in range(max(x // 2 - reach, 0) // NODES, min((x // 2 + reach) // NODES + 1, stale.shape[0])):
        for j in range(max(y // 2 - reach, 0) // NODES, min((y // 2 + reach) // NODES + 1, stale.shape[1])):
            for k in range(max(z // 2 - reach, 0) // NODES, min((z // 2 + reach) // NODES + 1, stale.shape[2])):
                stale[i, j, k] = 1


@compiled
def rebuild(grid: Grid, first: int, most: int) -> int:
    """Write the field anew in up to `most` stale blocks, from the `first` on; where to go on the next time."""
    stale = grid.stale.reshape(-1)
    for _ in range(len(stale)):
        first = (first + 1) % len(stale)
        if stale[first]:
            stale[first] = 0
            _rebuild_block(grid, first)
            most -= 1
            if most <= 0:
                break
    return first


@compiled
def _rebuild_block(grid: Grid, block: int) -> None:
    """Write one block's distances anew, axis by axis: exact, and the cheaper the fewer columns are occupied."""
    shape = grid.stale.shape
    low = np.array([block // (shape[1] * shape[2]), block // shape[2] % shape[1], block % shape[2]]) * NODES
    reach = grid.templates.shape[1] // 2
    first = np.maximum(low - reach, 0) * VOXELS_PER_NODE
    last = np.empty(3, np.int64)
    for axis in range(3):
        last[axis] = min((low[axis] + NODES + reach) * VOXELS_PER_NODE, grid.strength.shape[axis])
    squared = np.full((NODES, NODES, NODES), np.float32(FAR), np.float32)
    plane, column = np.empty((NODES, NODES), np.float32), np.empty(NODES, np.float32)
    for x in range(first[0], last[0]):
        plane[:] = FAR
        occupied = False
        for y in range(first[1], last[1]):
            if _has_voxels(grid.counts, x, y, first[2], last[2]) and _measure_column(
                grid.strength[x, y], first[2], last[2], VOXELS_PER_NODE * low[2], column
            ):
                occupied = True
                for b in range(NODES):
                    _lower_row(plane[b], column, VOXELS_PER_NODE * (low[1] + b) - y - 0.5)
        if occupied:
            for a in range(NODES):
                for b in range(NODES):
                    _lower_row(squared[a, b], plane[b], VOXELS_PER_NODE * (low[0] + a) - x - 0.5)
    scale = grid.voxel_m / grid.step_m
    for a in range(NODES):
        for b in range(NODES):
            for c in range(NODES):
                value = min(int(max(np.sqrt(squared[a, b, c]) - GROWN_VOXELS, 0.0) * scale), SATURATED)
                grid.field[low[0] + a, low[1] + b, low[2] + c] = value


@compiled
def _has_voxels(counts: npt.NDArray[np.int32], x: int, y: int, first: int, last: int) -> bool:
    """Any block that a column passes through holds occupied voxels."""
    total = 0
    for k in range(first // BLOCK, (last - 1) // BLOCK + 1):
        total += counts[x // BLOCK, y // BLOCK, k]
    return total > 0


@compiled
def _measure_column(
    strength: npt.NDArray[np.int8], first: int, last: int, low: int, column: npt.NDArray[np.float32]
) -> bool:
    """Fill `column` with squared distances [voxels] from nodes to the occupied voxels of a column; if there are any."""
    found = False
    for z in range(first, last):
        if strength[z] > 0:
            if not found:
                column[:] = FAR
            found = True
            for c in range(NODES):
                off = np.float32(low + VOXELS_PER_NODE * c - z - 0.5)
                column[c] = min(column[c], off * off)
    return found


@compiled
def _lower_row(row: npt.NDArray[np.float32], by: npt.NDArray[np.float32], off: float) -> None:
    """Lower squared distances to those of a row that lies `off` beside it."""
    beside = np.float32(off * off)
    for c in range(NODES):
        row[c] = min(row[c], by[c] + beside)


@compiled
def _indices(grid: Grid, v: int) -> tuple[int, int, int]:
    _, b, c = grid.strength.shape
    return v // (b * c), v // c % b, v % c


@compiled
def vacate(grid: Grid, centre_m: Array, radius_m: float) -> None:
    """Free all voxels in a ball: what was seen there has turned out to move."""
    shape, strength = grid.strength.shape, grid.strength.reshape(-1)
    first, last = np.empty(3, np.int64), np.empty(3, np.int64)
    for axis in range(3):
        at = centre_m[axis] - grid.low_m[axis]
        first[axis] = max(int(np.floor((at - radius_m) / grid.voxel_m)), 0)
        last[axis] = min(int(np.floor((at + radius_m) / grid.voxel_m)) + 1, shape[axis])
    for x in range(first[0], last[0]):
        for y in range(first[1], last[1]):
            for z in range(first[2], last[2]):
                v = (x * shape[1] + y) * shape[2] + z
                if strength[v] > 0:
                    strength[v] = 0
                    release(grid, v)
