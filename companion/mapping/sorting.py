"""What the points of a scan are: unexplained, explained by what is known anyway, or the vehicle itself. Compiled."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from missions.kernels import compiled
from missions.obstacles import Obstacles, clearance_at, terrain_height_at

Array = npt.NDArray[np.float64]

CANDIDATE, EXPLAINED, NEAR_SELF = 0, 1, 2
"""Kinds of points: to be mapped; only the end of a ray; not even that."""
SELF_MARGIN = 1.25
"""What is nearer to the sensor than the body's radius times this is the vehicle itself."""


class Known(NamedTuple):
    """What need not be mapped."""

    obstacles: Obstacles
    room_m: Array
    """(2, 3) flight range, ENU."""
    tolerance_m: float
    """A point so near to a known surface, or to the known ground, is part of it."""
    beyond_m: float
    """What is farther than this out of the flight range concerns nobody."""


@compiled
def sort_points(
    points_m: Array, sensor_m: Array, body_radius_m: float, known: Known, others: Array
) -> npt.NDArray[np.uint8]:
    """(n,) kinds of (n, 3) points, ENU; `others` are (k, 4) centres and radii of bodies that are known otherwise."""
    kinds = np.empty(len(points_m), np.uint8)
    own2 = (SELF_MARGIN * body_radius_m) ** 2
    for i in range(len(points_m)):
        east, north, up = points_m[i, 0], points_m[i, 1], points_m[i, 2]
        de, dn, du = east - sensor_m[0], north - sensor_m[1], up - sensor_m[2]
        if de * de + dn * dn + du * du < own2:
            kinds[i] = NEAR_SELF
        else:
            kinds[i] = EXPLAINED if _is_explained(east, north, up, known, others) else CANDIDATE
    return kinds


@compiled
def _is_explained(east: float, north: float, up: float, known: Known, others: Array) -> bool:
    low_m, high_m, beyond_m = known.room_m[0], known.room_m[1], known.beyond_m
    if east < low_m[0] - beyond_m or north < low_m[1] - beyond_m or up < low_m[2] - beyond_m:
        return True
    if east > high_m[0] + beyond_m or north > high_m[1] + beyond_m or up > high_m[2] + beyond_m:
        return True
    if up - terrain_height_at(east, north, known.obstacles) < known.tolerance_m:
        return True
    for k in range(len(others)):
        de, dn, du = east - others[k, 0], north - others[k, 1], up - others[k, 2]
        if de * de + dn * dn + du * du < others[k, 3] ** 2:
            return True
    return clearance_at(east, north, up, known.obstacles) < known.tolerance_m
