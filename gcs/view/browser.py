"""One browser: the vehicles as large as its camera needs them, and what lies over its picture.

Everything that depends on where a camera is belongs to one browser; all else is drawn once for all of them.
"""

import asyncio
from collections.abc import Sequence
from importlib.resources import files

import numpy as np
import numpy.typing as npt
import viser

from gcs.view.framing import Pose
from gcs.view.labels import Lens
from gcs.view.overlay import Overlay, Tag
from gcs.view.sightings import Sightings
from gcs.view.theme import Theme
from gcs.view.vehicle_scene import Pick, VehicleScene

Array = npt.NDArray[np.float64]

MOST_FRAMES_S = 0.04
"""While a camera moves, its overlay follows at this interval."""


class Browser:
    """What one browser alone is shown.

    Args:
        client: viser's handle of it.
        on_pick: see `VehicleScene`.
        theme: dark or light.
        legend: HTML that stays below the overlay.
    """

    def __init__(self, client: viser.ClientHandle, on_pick: Pick, theme: Theme, legend: str) -> None:
        self._client, self._loop = client, asyncio.get_running_loop()
        self._vehicles = VehicleScene(client.scene, on_pick, theme)
        self._overlay, self._places_m = Overlay(), np.zeros((0, 3))
        self._tags: Sequence[Tag] = ()
        self._lens, self._drawn = self._look(), False
        self._waiting = False
        panel = client.gui.add_panel()
        with panel.add_tab(" "):
            client.gui.add_html(f"<style>{files('gcs.view').joinpath('overlay.css').read_text()}</style>")
            self._legend = client.gui.add_html(legend)
            self._html = client.gui.add_html("")
        panel.float(x=0, y=0, width=100)
        client.camera.on_update(self._camera_moved)

    def update(self, seen: Sightings, tags: Sequence[Tag], places_m: Array, *, overlay: bool) -> None:
        """Bring it up to date: vehicles, and if it is its turn the overlay, with (n, 3) places of what has a tag."""
        self._follow()
        self._tags, self._places_m = tags, places_m
        with self._client.atomic():
            self._vehicles.move(seen, self._lens, resize=overlay)
            if overlay:
                self._draw()

    def explain(self, legend: str) -> None:
        """Show this legend from now on."""
        self._legend.content = legend

    def use(self, theme: Theme) -> None:
        """Draw it dark or light from now on."""
        self._vehicles.use(theme)

    def _camera_moved(self, _: viser.CameraHandle) -> None:
        """Called in a thread of viser."""
        self._loop.call_soon_threadsafe(self._follow_camera_soon)

    def _follow_camera_soon(self) -> None:
        if not self._waiting:
            self._waiting = True
            self._loop.call_later(MOST_FRAMES_S, self._follow_camera)

    def _follow_camera(self) -> None:
        self._waiting = False
        drawn = self._drawn
        self._follow()
        if drawn and not self._drawn:
            self._draw()

    def _draw(self) -> None:
        self._drawn = True
        self._html.content = self._overlay.render(self._tags, self._places_m, self._lens)

    def _follow(self) -> None:
        """See where the camera is now; what was worked out for it holds as long as it stands still."""
        lens = self._look()
        if not _same(lens, self._lens):
            self._lens, self._drawn = lens, False

    def _look(self) -> Lens:
        camera = self._client.camera
        pose = Pose(camera.position, camera.look_at)
        return Lens(pose, camera.fov, max(camera.image_width, 1), max(camera.image_height, 1))


def _same(one: Lens, other: Lens) -> bool:
    sizes = (one.width_px, one.height_px, one.fov_rad) == (other.width_px, other.height_px, other.fov_rad)
    return sizes and all(
        np.array_equal(a, b) for a, b in zip(vars(one.pose).values(), vars(other.pose).values(), strict=True)
    )
