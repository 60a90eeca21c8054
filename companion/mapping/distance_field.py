"""How far it is to what was seen: a field of distances on nodes two voxels apart, kept up to date voxel by voxel.

A voxel that becomes occupied lowers the field around itself by a template, which is a few hundred bytes compared in
rows. One that becomes free only makes the blocks around it stale: they are written anew some at a time, so that the
field errs to the safe side meanwhile, and no scan takes long.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from missions.kernels import compiled
from missions.obstacles import FAR_M

Array = npt.NDArray[np.float64]
Bytes = npt.NDArray[np.uint8]

VOXELS_PER_NODE = 2
SATURATED = 255
"""A node's value from which on nothing is near."""
GROWN_VOXELS = 0.25
"""What is hit lies anywhere in its voxel, and between nodes distances are read a little too long: so much is taken off
them."""


class Field(NamedTuple):
    """Distances to the nearest occupied voxel's centre less a quarter of a voxel, in steps, at most `SATURATED`."""

    values: Bytes
    """(a, b, c) nodes; (0, 0, 0) where nothing senses."""
    low_m: Array
    """(3,) the first node, mission ENU."""
    spacing_m: float
    """Between nodes."""
    step_m: float
    """One unit of the values."""


def no_field() -> Field:
    """The field of a vehicle that sees nothing."""
    return Field(np.zeros((0, 0, 0), np.uint8), np.zeros(3), 1.0, 1.0)


def templates(reach_nodes: int) -> Bytes:
    """(8, s, s, s) values around an occupied voxel, for the eight ways in which it may lie between the nodes.

    Row `o` of an axis belongs to the node `o - reach_nodes` after the voxel's own; s = 2 reach_nodes + 2. The value
    `SATURATED` stands for a distance of `reach_nodes` + 1/4 spacings.
    """
    offsets, grown = np.arange(-reach_nodes, reach_nodes + 2), GROWN_VOXELS / VOXELS_PER_NODE
    out: list[Array] = []
    for way in range(8):
        parts = [(offsets - (0.75 if way >> axis & 1 else 0.25)) ** 2 for axis in range(3)]
        distance = np.sqrt(parts[0][:, None, None] + parts[1][None, :, None] + parts[2][None, None, :])
        distance = np.maximum(distance - grown, 0.0)
        out.append(np.minimum(np.floor(distance * SATURATED / (reach_nodes + 0.25)), SATURATED))
    return np.array(out).astype(np.uint8)


@compiled
def distance_at(east: float, north: float, up: float, field: Field) -> float:
    """Distance [m] at a place, between the nodes linearly; `FAR_M` beyond the field's reach and outside of it."""
    low_m, spacing_m = field.low_m, field.spacing_m
    x, y, z = (east - low_m[0]) / spacing_m, (north - low_m[1]) / spacing_m, (up - low_m[2]) / spacing_m
    return interpolated(x, y, z, field.values, field.step_m)


@compiled
def lower_to_field(points_m: Array, field: Field, out: Array) -> None:
    """Lower `out` (m,) to the distances [m] at (m, 3 or more) points; further columns are not read."""
    values, low_m, spacing_m, step_m = field.values, field.low_m, field.spacing_m, field.step_m
    if len(values) == 0:
        return
    east, north, up, per_m = low_m[0], low_m[1], low_m[2], 1.0 / spacing_m
    for i in range(len(points_m)):
        x, y, z = (points_m[i, 0] - east) * per_m, (points_m[i, 1] - north) * per_m, (points_m[i, 2] - up) * per_m
        out[i] = min(out[i], interpolated(x, y, z, values, step_m))


@compiled
def interpolated(x: float, y: float, z: float, values: Bytes, step_m: float) -> float:
    """`distance_at` in units of the nodes' spacing."""
    if not (x >= 0.0 and y >= 0.0 and z >= 0.0):
        return FAR_M
    i, j, k = int(x), int(y), int(z)
    n_north, n_up = values.shape[1], values.shape[2]
    if i + 1 >= values.shape[0] or j + 1 >= n_north or k + 1 >= n_up:
        return FAR_M
    flat, near_row = values.reshape(-1), np.uint64((i * n_north + j) * n_up + k)
    one, next_row, far_row = np.uint64(1), near_row + np.uint64(n_up), near_row + np.uint64(n_north * n_up)
    last_row = far_row + np.uint64(n_up)
    a, b = np.int64(flat[near_row]), np.int64(flat[near_row + one])
    c, d = np.int64(flat[next_row]), np.int64(flat[next_row + one])
    e, f = np.int64(flat[far_row]), np.int64(flat[far_row + one])
    g, h = np.int64(flat[last_row]), np.int64(flat[last_row + one])
    if a + b + c + d + e + f + g + h == 8 * SATURATED:
        return FAR_M
    p, q, r = x - i, y - j, z - k
    near = (a + (b - a) * r) * (1.0 - q) + (c + (d - c) * r) * q
    far = (e + (f - e) * r) * (1.0 - q) + (g + (h - g) * r) * q
    return (near + (far - near) * p) * step_m


@compiled
def lower(values: Bytes, template: Bytes, a: int, b: int, c: int) -> None:
    """Lower the values (a, b, c) of a field by the template (s, s, s) of an occupied voxel behind the node a, b, c."""
    size, shape = len(template), values.shape
    reach = size // 2 - 1
    field, mask = values.reshape(-1), template.reshape(-1)
    first, last = max(reach - c, 0), min(size, shape[2] - c + reach)
    for i in range(max(reach - a, 0), min(size, shape[0] - a + reach)):
        for j in range(max(reach - b, 0), min(size, shape[1] - b + reach)):
            at = np.uint64(((a - reach + i) * shape[1] + b - reach + j) * shape[2] + c - reach + first)
            of = np.uint64((i * size + j) * size + first)
            for k in range(np.uint64(last - first)):
                if mask[of + k] < field[at + k]:
                    field[at + k] = mask[of + k]
