"""Points of one scan grouped into things: neighbours on a coarse grid belong together. Compiled."""

import numpy as np
import numpy.typing as npt

from missions.kernels import compiled

Array = npt.NDArray[np.float64]

CELLS = 40
"""Along each edge of the cube that is looked at, around the sensor."""
COUNT, LOW, HIGH, MEAN = 0, 1, 4, 7
"""Columns of a cluster: number of points; lowest and highest corner, mean of its points (three each, ENU [m])."""
WIDTH = 10
MOST_CLUSTERS = 256
NOT_LOOKED_AT = -1


@compiled
def group(points_m: Array, centre_m: Array, cell_m: float, labels: npt.NDArray[np.int64]) -> Array:
    """Group points.

    Args:
        points_m: (n, 3) ENU.
        centre_m: (3,) the middle of the cube, ENU.
        cell_m: edge of a cell; points in the same or in touching cells belong together.
        labels: (n,) is filled with each point's cluster, NOT_LOOKED_AT outside of the cube.

    Returns:
        (c, WIDTH) the clusters.
    """
    cells = np.full((CELLS, CELLS, CELLS), NOT_LOOKED_AT, np.int16)
    places = np.empty((len(points_m), 3), np.int64)
    for i in range(len(points_m)):
        labels[i] = NOT_LOOKED_AT
        inside = True
        for axis in range(3):
            at = np.floor((points_m[i, axis] - centre_m[axis]) / cell_m) + CELLS // 2
            inside = inside and 0 <= at < CELLS
            places[i, axis] = int(at)
        if inside:
            cells[places[i, 0], places[i, 1], places[i, 2]] = MOST_CLUSTERS  # occupied, in no cluster yet
            labels[i] = 0
    clusters, count = np.zeros((MOST_CLUSTERS, WIDTH)), 0
    for i in range(len(points_m)):
        if labels[i] == NOT_LOOKED_AT:
            continue
        if cells[places[i, 0], places[i, 1], places[i, 2]] == MOST_CLUSTERS and count < MOST_CLUSTERS:
            _flood(cells, places[i], count)
            count += 1
        labels[i] = cells[places[i, 0], places[i, 1], places[i, 2]]
        if labels[i] == MOST_CLUSTERS:
            labels[i] = NOT_LOOKED_AT
        else:
            _add(clusters[labels[i]], points_m[i])
    return clusters[:count]


@compiled
def _flood(cells: npt.NDArray[np.int16], first: npt.NDArray[np.int64], label: int) -> None:
    """Give a label to all occupied cells that hang together with the first."""
    waiting = [(first[0], first[1], first[2])]
    cells[first[0], first[1], first[2]] = label
    while len(waiting) > 0:
        x, y, z = waiting.pop()
        for a in range(max(x - 1, 0), min(x + 2, CELLS)):
            for b in range(max(y - 1, 0), min(y + 2, CELLS)):
                for c in range(max(z - 1, 0), min(z + 2, CELLS)):
                    if cells[a, b, c] == MOST_CLUSTERS:
                        cells[a, b, c] = label
                        waiting.append((a, b, c))


@compiled
def _add(cluster: Array, point_m: Array) -> None:
    n = cluster[COUNT]
    for axis in range(3):
        at = point_m[axis]
        cluster[LOW + axis] = at if n == 0.0 else min(cluster[LOW + axis], at)
        cluster[HIGH + axis] = at if n == 0.0 else max(cluster[HIGH + axis], at)
        cluster[MEAN + axis] += (at - cluster[MEAN + axis]) / (n + 1.0)
    cluster[COUNT] = n + 1.0
