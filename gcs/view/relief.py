"""Terrain as a map shows it: tints by height, shade by slope, contour lines; pure."""

from typing import NamedTuple

import contourpy
import numpy as np
import numpy.typing as npt

from gcs.view.shapes import polyline
from gcs.view.theme import Theme

Array = npt.NDArray[np.float64]

SUN_ENU = np.array([-0.5, 0.5, 0.7])
"""Where maps have their light from: the north-west."""
SHADE = 0.45
"""How much darker a slope is that turns away from the sun."""
LEVELS = 14
"""About as many contour lines lie between the lowest and the highest ground."""
EVERY_MAIN = 5


class Heights(NamedTuple):
    """The ground at the points of a grid.

    Args:
        east_m: (n,) ascending.
        north_m: (m,) ascending.
        up_m: (m, n).
    """

    east_m: Array
    north_m: Array
    up_m: Array


def contour_interval_m(relief_m: float) -> float:
    """The step 1, 2 or 5 times a power of ten that gives about `LEVELS` levels."""
    wanted = relief_m / LEVELS
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(min((step * power for step in (1, 2, 5, 10)), key=lambda step: abs(np.log(step / wanted))))


def tinted(ground: Heights, theme: Theme) -> npt.NDArray[np.uint8]:
    """(m, n, 3) colours of a grid's points, its first row the southernmost."""
    share: Array = np.sqrt((ground.up_m - ground.up_m.min()) / max(float(np.ptp(ground.up_m)), 1e-9))
    stops = np.array([theme.valley, theme.slope, theme.summit], dtype=float)
    tint = np.stack([np.interp(share, [0.0, 0.45, 1.0], stops[:, channel]) for channel in range(3)], axis=-1)
    return (tint * _shade(ground)[..., None]).clip(0, 255).astype(np.uint8)


def contours(ground: Heights, lift_m: float) -> tuple[Array, Array]:
    """(n, 2, 3) segments of the contour lines, and of every `EVERY_MAIN`th of them apart; `lift_m` above the ground."""
    low, high = float(ground.up_m.min()), float(ground.up_m.max())
    if high - low < 1e-6:
        return np.zeros((0, 2, 3)), np.zeros((0, 2, 3))
    interval_m = contour_interval_m(high - low)
    lines = contourpy.contour_generator(ground.east_m, ground.north_m, ground.up_m)
    minor, main = [np.zeros((0, 2, 3))], [np.zeros((0, 2, 3))]
    for index in range(int(np.floor(low / interval_m)) + 1, int(np.ceil(high / interval_m))):
        for line in lines.lines(index * interval_m):
            points = np.column_stack((np.asarray(line), np.full(len(line), index * interval_m + lift_m)))
            (minor if index % EVERY_MAIN else main).append(polyline(points))
    return np.concatenate(minor), np.concatenate(main)


def _shade(ground: Heights) -> Array:
    """(m, n) brightness by the angle between the slope and the sun; 1 on level ground."""
    north, east = np.gradient(ground.up_m, ground.north_m, ground.east_m)
    normals = np.stack((-east, -north, np.ones_like(east)), axis=-1)
    sun = SUN_ENU / np.linalg.norm(SUN_ENU)
    lit = np.maximum(normals @ sun / np.linalg.norm(normals, axis=-1), 0.0)
    return 1.0 + SHADE * (lit - sun[2]) / sun[2]
