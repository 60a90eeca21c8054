"""The ground as it is drawn: a floor with a grid, or terrain in the tints of a map with its contour lines."""

import numpy as np
import numpy.typing as npt
import trimesh
import viser
from PIL import Image
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from gcs.view import relief, shapes
from gcs.view.colours import Rgb
from gcs.view.relief import Heights
from gcs.view.theme import Theme
from missions import obstacles
from missions.obstacles import Obstacles
from missions.world import Bounds

Array = npt.NDArray[np.float64]

TERRAIN_CELLS = 160
GRID_LINES = 20
"""About as many lies the grid's spacing between the sides of the flight range."""
LIFT_SHARE = 0.0015
"""How far above the ground lines are drawn, of the flight range's longer side."""


def grid_spacing_m(extent_m: float) -> float:
    """The spacing 1, 2 or 5 times a power of ten that cuts an extent into about `GRID_LINES` parts."""
    wanted = extent_m / GRID_LINES
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(min((step * power for step in (1, 2, 5, 10)), key=lambda spacing: abs(np.log(spacing / wanted))))


class GroundScene:
    """The ground of a flight range.

    Args:
        scene: of the page.
        bounds: of the flight range.
        peaks: what rises from it.
    """

    def __init__(self, scene: viser.SceneApi, bounds: Bounds, peaks: Obstacles) -> None:
        self._scene, self._bounds, self._peaks = scene, bounds, peaks
        self._extent_m = max(np.ptp(bounds.east_m), np.ptp(bounds.north_m))

    def height_m(self, places_m: Array) -> Array:
        """(n,) height of the ground [m] at (n, 2 or 3) places."""
        return obstacles.terrain_height(places_m, self._peaks)

    def draw(self, theme: Theme) -> None:
        """Draw it, in place of what was drawn before."""
        if len(self._peaks.peaks):
            self._draw_terrain(theme)
        else:
            self._draw_floor(theme)

    def _draw_floor(self, theme: Theme) -> None:
        mesh = shapes.terrain(self._bounds, self._peaks, 1)
        self._scene.add_mesh_simple("/world/ground", mesh.vertices, mesh.faces, color=theme.ground, side="double")
        spacing_m = grid_spacing_m(self._extent_m)
        for name, every, colour in (("grid", 1, theme.grid), ("main", 5, theme.grid_main)):
            self._lines(name, shapes.draped(self._bounds, self._peaks, spacing_m * every, 1), colour, 1.0)

    def _draw_terrain(self, theme: Theme) -> None:
        ground = self._heights(TERRAIN_CELLS)
        mesh = shapes.terrain(self._bounds, self._peaks, TERRAIN_CELLS)
        low, size = self._bounds.low_enu_m[:2], (self._bounds.high_enu_m - self._bounds.low_enu_m)[:2]
        material = PBRMaterial(
            baseColorTexture=Image.fromarray(relief.tinted(ground, theme)[::-1]),
            metallicFactor=0.0,
            roughnessFactor=1.0,
            doubleSided=True,
        )
        visual = TextureVisuals(uv=(mesh.vertices[:, :2] - low) / size, material=material)
        textured = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False, visual=visual)
        self._scene.add_mesh_trimesh("/world/ground", textured, cast_shadow=False, receive_shadow=False)
        minor, main = relief.contours(ground, self._extent_m * LIFT_SHARE)
        self._lines("contours", minor, theme.contour, 0.6)
        self._lines("main contours", main, theme.contour, 1.4)
        spacing_m = 5 * grid_spacing_m(self._extent_m)
        self._lines("grid", shapes.draped(self._bounds, self._peaks, spacing_m, TERRAIN_CELLS), theme.contour, 0.5)

    def _heights(self, cells: int) -> Heights:
        east_m, north_m = np.linspace(*self._bounds.east_m, cells + 1), np.linspace(*self._bounds.north_m, cells + 1)
        points = np.stack(np.meshgrid(east_m, north_m, indexing="xy"), axis=-1)
        return Heights(east_m, north_m, self.height_m(points))

    def _lines(self, name: str, segments: Array, colour: Rgb, width_px: float) -> None:
        if len(segments):
            name = f"/world/{name}"
            self._scene.add_line_segments(name, segments, colour, thickness=width_px, thickness_units="screen")
