"""One desk's page: what stands in the scene and in the panels, and how often each is brought up to date."""

import asyncio
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import viser

from gcs.desk import Desk, Intent
from gcs.view import words
from gcs.view.cameras import Cameras
from gcs.view.colours import BRAND, GRID, GRID_MAIN, TARGET, vivid
from gcs.view.motion_scene import MotionScene
from gcs.view.panels import Panels, Press
from gcs.view.plan_scene import PlanScene
from gcs.view.sightings import Sighting, sightings, vehicle_colours, vehicle_order
from gcs.view.tag_scene import Tag, TagScene
from gcs.view.vehicle_scene import LEAST_SPAN_PX, VehicleScene
from gcs.view.world_scene import WorldScene, diagonal_m

Array = npt.NDArray[np.float64]

TITLE = "End-cloud GCS"
TELL_INTERVAL_S = 0.25
"""Panels and signs change this often; what moves is updated at every call."""

WATCHED_M = np.array([[-30.0, -30.0, 0.0], [30.0, 30.0, 15.0]])
"""What is framed where there is no mission, around where the first vehicle has its home."""
TARGET_TAG_SCALE, TARGET_PX = 0.85, 14.0
VEHICLE_FLATNESS = 0.6
"""A quadrotor is less high than wide in a picture from above."""
PLAIN: dict[str, Any] = {
    "cell_size": 5.0,
    "section_size": 25.0,
    "cell_color": GRID,
    "section_color": GRID_MAIN,
    "fade_distance": 250.0,
}
TRAIL_SPACING_SHARE = 1 / 2000
POINT_SHARE = 1 / 350
LEAST_TRAIL_SPACING_M = 0.05


class Page:
    """The page of one desk. All calls come on the event loop's thread.

    Args:
        server: an open viser server; the page fills it.
        desk: what is shown and commanded.
    """

    def __init__(self, server: viser.ViserServer, desk: Desk) -> None:
        self._server, self._desk, self._loop = server, desk, asyncio.get_running_loop()
        self._next_tell_s = -np.inf
        self._seen: list[Sighting] = []
        server.gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False, brand_color=BRAND)
        server.gui.set_panel_label(TITLE)
        _light(server.scene)
        size_m = self._draw_surroundings()
        self._plan = PlanScene(server.scene, size_m * POINT_SHARE)
        self._motion = MotionScene(server.scene, max(LEAST_TRAIL_SPACING_M, size_m * TRAIL_SPACING_SHARE))
        self._vehicles = VehicleScene(server.scene, self._ground_height_m)
        self._tags = TagScene(server.scene)
        self._panels = Panels(server, desk, self._press, self._views())

    def update(self, now_s: float) -> None:
        """Bring the page up to date; what is shown has the station's clock, which in a recording can be moved."""
        shown_s = self._desk.station.now_s
        self._seen = sightings(self._desk)
        lens = self._cameras.lens()
        with self._server.atomic():
            self._vehicles.move(self._seen, lens)
            self._motion.update(self._desk, self._seen, shown_s)
            self._cameras.move(self._seen)
            if now_s >= self._next_tell_s:
                self._next_tell_s = now_s + TELL_INTERVAL_S
                self._desk.collect_texts()
                self._show_plan()
                self._tags.show([*self._vehicle_tags(shown_s), *self._target_tags], lens)
                self._panels.update(self._seen, shown_s)
            self._tags.move(
                np.array([tagged.position_m for tagged in self._seen] + self._targets_m).reshape(-1, 3), lens
            )

    def _vehicle_tags(self, now_s: float) -> list[Tag]:
        return [
            Tag(
                f"vehicle {sighting.sysid}",
                f"{sighting.name}  {words.mode_words(sighting.state, now_s)[0]}  "
                f"{words.number_words(sighting.position_m[2])} m",
                sighting.position_m,
                vivid(sighting.colour),
                LEAST_SPAN_PX * VEHICLE_FLATNESS,
            )
            for sighting in self._seen
        ]

    def _draw_surroundings(self) -> float:
        """The world, or where there is no mission a plain; how large it is [m]."""
        mission = self._desk.mission
        self._world: WorldScene | None = None
        self._targets_m: list[Array] = []
        self._target_tags: list[Tag] = []
        if mission is None:
            self._server.scene.add_grid("/world/plain", infinite_grid=True, **PLAIN)
            self._cameras = Cameras(self._server, WATCHED_M[0], WATCHED_M[1], 1)
            return float(np.linalg.norm(WATCHED_M[1] - WATCHED_M[0]))
        self._targets_m = [np.array(target.position_m) for target in mission.targets]
        self._target_tags = [
            Tag(f"target {target.name}", target.name, place_m, TARGET, TARGET_PX, TARGET_TAG_SCALE)
            for target, place_m in zip(mission.targets, self._targets_m, strict=True)
        ]
        self._world = WorldScene(self._server, mission, simulated=self._desk.simulated)
        bounds = mission.world.bounds
        self._cameras = Cameras(self._server, bounds.low_enu_m, bounds.high_enu_m, len(mission.vehicles))
        return diagonal_m(bounds)

    def _show_plan(self) -> None:
        flight = self._desk.flight
        if flight is None or flight.plan is None or self._world is None:
            return
        by_sysid = vehicle_colours(vehicle_order(self._desk))
        if self._plan.show(flight.plan, by_sysid):
            parts = flight.plan.vehicles
            self._world.colour_targets({t.name: by_sysid[part.sysid] for part in parts for t in part.targets})

    def _ground_height_m(self, places_m: Array) -> Array:
        return self._world.ground_height_m(places_m) if self._world is not None else np.zeros(len(places_m))

    def _press(self, intent: Intent) -> None:
        """Called in a thread of viser."""
        self._loop.call_soon_threadsafe(lambda: self._desk.request(intent, sorted(self._panels.selected)))

    def _views(self) -> dict[str, tuple[viser.IconName, Press]]:
        return {
            "Overview": (viser.Icon.CUBE, self._view(self._cameras.overview)),
            "Top": (viser.Icon.MAP_2, self._view(self._cameras.from_above)),
            "Follow": (viser.Icon.FOCUS_2, self._view(self._follow)),
        }

    def _view(self, act: Callable[[viser.ClientHandle], None]) -> Press:
        def press(event: viser.GuiEvent) -> None:
            client = event.client
            if client is not None:
                self._loop.call_soon_threadsafe(act, client)

        return press

    def _follow(self, client: viser.ClientHandle) -> None:
        """Follow the selected vehicle, or the first one."""
        chosen = [sighting for sighting in self._seen if sighting.sysid in self._panels.picked_out]
        if self._seen:
            self._cameras.follow(client, (chosen or self._seen)[0])


def _light(scene: viser.SceneApi) -> None:
    """Daylight from the south-west, and enough of the sky to see into the shade; no shadows, which cost most."""
    scene.configure_default_lights(enabled=False)
    scene.configure_environment_map(None)
    scene.add_light_hemisphere("/light/sky", sky_color=(214, 226, 255), ground_color=(60, 62, 74), intensity=1.5)
    scene.add_light_directional("/light/sun", color=(255, 246, 232), intensity=2.0, position=(-3.0, -5.0, 8.0))
