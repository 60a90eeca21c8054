"""What the vehicles have seen and no map explains, as it grows: a cloud of the voxels that their companions report."""

import math

import numpy as np
import viser

from gcs.mapping.observed_map import ObservedMap
from gcs.view.theme import DARK, Theme

INTERVAL_S = 0.5
"""A map that changes all the time is drawn anew this often at most."""
MOST_VOXELS = 40_000
"""Of a larger map every second, third ... voxel is drawn: a browser that comes late is sent all of them at once."""
FILLED = 0.9
"""A voxel's marker, of its edge: what lies behind is seen between them."""


class ObservedScene:
    """The observed obstacles of a fleet.

    Args:
        scene: of the page.
    """

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene, self._theme = scene, DARK
        self._cloud: viser.PointCloudHandle | None = None
        self._drawn: tuple[ObservedMap, int] | None = None
        self._drawn_s = -math.inf

    def use(self, theme: Theme) -> None:
        """Draw it for a dark or a light page from now on."""
        if theme is not self._theme:
            self._theme, self._drawn = theme, None
            self._remove()

    def update(self, observed: ObservedMap, now_s: float) -> bool:
        """Follow the map, if it looks different now and the last time is long enough ago; whether it was drawn."""
        if self._drawn is not None and self._drawn[0] is observed and self._drawn[1] == observed.changes:
            return False
        if self._drawn is not None and abs(now_s - self._drawn_s) < INTERVAL_S:
            return False
        self._drawn, self._drawn_s = (observed, observed.changes), now_s
        points_m = observed.points_enu_m
        points_m = points_m[:: math.ceil(len(points_m) / MOST_VOXELS) or 1].astype(np.float32)
        if len(points_m) == 0:
            self._remove()
        elif self._cloud is None:
            self._cloud = self._scene.add_point_cloud(
                "/observed",
                points_m,
                self._theme.observed,
                point_size=FILLED * observed.voxel_m,
                point_shape="square",
                point_shading="flat",
                precision="float32",
            )
        else:
            self._cloud.points = points_m
        return True

    def _remove(self) -> None:
        if self._cloud is not None:
            self._cloud.remove()
            self._cloud = None
