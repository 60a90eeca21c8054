"""Where on the ground a ray meets it, and how several vehicles stand around a place; pure geometry."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

SAMPLES, REFINEMENTS = 4000, 30


def ground_under(
    origin_m: Array, direction: Array, ground_height_m: Callable[[Array], Array], far_m: float
) -> Array | None:
    """(3,) where a ray first meets the ground, or None if it does not within `far_m`.

    Args:
        origin_m: (3,) where it begins, ENU.
        direction: (3,) of any length.
        ground_height_m: heights of the ground [m] below (n, 2) places.
        far_m: how far it is followed.
    """
    direction = direction / np.linalg.norm(direction)
    reach_m = np.linspace(0.0, far_m, SAMPLES)
    below = _heights_m(origin_m, direction, reach_m, ground_height_m) <= 0.0
    if not below.any() or below[0]:
        return None
    index = int(np.argmax(below))
    low_m, high_m = reach_m[index - 1], reach_m[index]
    for _ in range(REFINEMENTS):
        middle_m = (low_m + high_m) / 2
        if _heights_m(origin_m, direction, np.array([middle_m]), ground_height_m)[0] <= 0.0:
            high_m = middle_m
        else:
            low_m = middle_m
    return origin_m + high_m * direction


def side_by_side(place_m: Array, count: int, spacing_m: float) -> Array:
    """(count, 3) places in a row from west to east around a (3,) place."""
    offsets_m = (np.arange(count) - (count - 1) / 2) * spacing_m
    return place_m + offsets_m[:, None] * np.array([1.0, 0.0, 0.0])


def _heights_m(origin_m: Array, direction: Array, reach_m: Array, ground_height_m: Callable[[Array], Array]) -> Array:
    points_m = origin_m + reach_m[:, None] * direction
    heights_m: Array = points_m[:, 2] - ground_height_m(points_m[:, :2])
    return heights_m
