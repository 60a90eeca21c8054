"""The cloud's plan as it is drawn: one curve per vehicle, and the track points that its vehicle is given."""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
import viser

from gcs.planner.plan import FleetPlan
from gcs.view import shapes
from gcs.view.colours import Rgb, vivid
from gcs.view.theme import DARK, Theme
from gcs.view.vehicle_scene import MANY

Array = npt.NDArray[np.float64]
Colours = npt.NDArray[np.uint8]

CURVE_PX, CURVE_OF_MANY_PX = 1.5, 1.0
MOST_SEGMENTS = 300
"""Per curve: enough to look smooth, and little to send."""


class PlanScene:
    """Curves and track points of the newest plan.

    Args:
        scene: of the page.
        point_m: size of a track point's marker.
    """

    def __init__(self, scene: viser.SceneApi, point_m: float) -> None:
        self._scene, self._point_m = scene, point_m
        self._plan: FleetPlan | None = None
        self._theme = DARK

    def use(self, theme: Theme) -> None:
        """Draw plans for a dark or a light page from now on."""
        if theme is not self._theme:
            self._theme, self._plan = theme, None

    def show(self, plan: FleetPlan | None, by_sysid: Mapping[int, Rgb]) -> bool:
        """Draw a plan unless it is the one that is drawn already, of a large fleet the curves alone; was it new?"""
        if plan is self._plan or plan is None:
            return False
        self._plan, many = plan, len(plan.vehicles) > MANY
        curves: list[Array] = []
        points: list[Array] = []
        tints: list[Colours] = []
        colours: list[Colours] = []
        for part in plan.vehicles:
            own = np.array(self._theme.line_planned(vivid(by_sysid[part.sysid]), many=many), np.uint8)
            step = max(1, len(part.curve_m) // MOST_SEGMENTS)
            curve = shapes.polyline(np.concatenate((part.curve_m[:-1:step], part.curve_m[-1:])))
            curves.append(curve)
            tints.append(np.broadcast_to(own, curve.shape))
            points.append(part.track.points_m)
            colours.append(np.broadcast_to(own, part.track.points_m.shape))
        self._scene.add_line_segments(
            "/plan/curves",
            np.concatenate(curves),
            np.concatenate(tints),
            thickness=CURVE_OF_MANY_PX if many else CURVE_PX,
            thickness_units="screen",
        )
        self._scene.add_point_cloud(
            "/plan/track points",
            np.concatenate(points),
            np.concatenate(colours),
            point_size=self._point_m,
            point_shape="circle",
            point_shading="flat",
            precision="float32",
            visible=not many,
        )
        return True
