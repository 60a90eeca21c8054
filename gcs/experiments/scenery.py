"""Peaks and threats of an outdoor world in a three-dimensional picture, as in figures 10 to 12."""

from typing import Any

import numpy as np

from missions import obstacles
from missions.world import World

CELLS = 36
"""Of the drawn ground, either way."""


def draw_world(axes: Any, world: World) -> None:
    """Draw ground and threats on a matplotlib 3-D axes, and set its bounds.

    Args:
        axes: of projection "3d"; matplotlib does not export their type.
        world: of peaks and threats.
    """
    low, high = world.bounds.low_enu_m, world.bounds.high_enu_m
    east, north = np.meshgrid(np.linspace(*world.bounds.east_m, CELLS), np.linspace(*world.bounds.north_m, CELLS))
    points = np.stack((east, north, np.zeros_like(east)), axis=-1)
    ground = obstacles.terrain_height(points, obstacles.pack(world))
    axes.plot_surface(east, north, ground, color="tab:green", alpha=0.35, linewidth=0, rcount=CELLS, ccount=CELLS)
    around, up = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 25), np.linspace(0.0, 0.5 * np.pi, 9))
    for threat in world.threats:
        x = threat.centre_m[0] + threat.radius_m * np.cos(around) * np.cos(up)
        y = threat.centre_m[1] + threat.radius_m * np.sin(around) * np.cos(up)
        axes.plot_surface(x, y, threat.radius_m * np.sin(up), color="tab:red", alpha=0.3, linewidth=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.tick_params(labelsize=5, pad=-3)
