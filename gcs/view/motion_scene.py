"""Where the vehicles have been, what lies ahead of them and what is below, as it is drawn for all browsers.

Of each trail only the newest part is sent at every update; what is older is sealed, thinned, and merged now and then,
so that a browser that comes late in a long flight is sent few lines.
"""

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt
import viser

from gcs.desk import Desk
from gcs.flight.trails import Trails
from gcs.view.colours import Rgb, vivid
from gcs.view.line_model import line_model
from gcs.view.lines import (
    AHEAD,
    AHEAD_OF_MANY,
    CHUNK,
    FleetTrails,
    SealedLine,
    SealedLines,
    WaysAhead,
    joined_where,
    thinned,
)
from gcs.view.sightings import Sightings
from gcs.view.theme import DARK, Theme
from gcs.view.vehicle_scene import MANY
from gcs.view.viser_internals import send

Array = npt.NDArray[np.float64]
GroundHeight = Callable[[Array], Array]
"""(n,) height of the ground [m] below (n, 2) places."""

TRAIL_PX, AHEAD_PX, STEM_PX = 2.5, 5.0, 1.0
TRAIL_OF_MANY_PX, AHEAD_OF_MANY_PX = 1.5, 3.0


class MotionScene:
    """Trails and companions' trajectories of all vehicles, and the stems that show where above the ground they are.

    Args:
        scene: of the page.
        spacing_m: between two points of a trail, at least.
        tolerance_m: by how much a trail may be off where points are left out of it.
        ground_height_m: see `GroundHeight`.
    """

    def __init__(
        self, scene: viser.SceneApi, spacing_m: float, tolerance_m: float, ground_height_m: GroundHeight
    ) -> None:
        self._scene, self._ground_height_m = scene, ground_height_m
        self._spacing_m, self._tolerance_m = spacing_m, tolerance_m
        self._trails: Trails | None = None
        self._drawn: list[int] = []
        self._sealed: dict[str, viser.SceneNodeHandle] = {}
        self._theme = DARK
        self._begin(Sightings())

    def use(self, theme: Theme) -> None:
        """Draw lines for a dark or a light page from now on."""
        if theme is not self._theme:
            self._theme, self._trails = theme, None

    def update(self, desk: Desk, seen: Sightings, now_s: float, *, lines: bool = True) -> None:
        """Follow the vehicles to where they are now: the trails' ends, and if it is their turn all lines."""
        if desk.trails is not self._trails or seen.sysids != self._drawn:
            self._trails = desk.trails
            self._begin(seen)
        if not seen or self._trails is None:
            return
        if lines:
            self._seal(self._past.take([self._trails.by_sysid.get(sysid) for sysid in seen.sysids]))
            self._send_batch()
            send(self._stems, points=self._stem_lines(seen.positions_m))
            self._future.take([state.companion for state in seen.states], now_s)
            send(self._ahead, points=self._future.segments(seen.positions_m))
        send(self._tails, points=self._past.segments(seen.positions_m))

    def _stem_lines(self, positions_m: Array) -> npt.NDArray[np.float32]:
        stems = np.repeat(positions_m[:, None].astype(np.float32), 2, axis=1)
        stems[:, 0, 2] = self._ground_height_m(positions_m[:, :2])
        return stems

    def _begin(self, seen: Sightings) -> None:
        """Begin anew: another frame, other vehicles, or another place in a recording."""
        for handle in self._sealed.values():
            handle.remove()
        self._sealed, self._lines, self._batch_sent = {}, SealedLines(), True
        self._drawn, self._past = seen.sysids, FleetTrails(len(seen), self._spacing_m)
        own = [vivid(colour) for colour in seen.colours]
        many = self._many = len(seen) > MANY
        ahead = AHEAD_OF_MANY if many else AHEAD
        self._future = WaysAhead(len(seen), ahead)
        self._colours = [self._theme.line_behind(colour, many=many) for colour in own]
        self._trail_px, ahead_px = (TRAIL_OF_MANY_PX, AHEAD_OF_MANY_PX) if many else (TRAIL_PX, AHEAD_PX)
        self._tails = self._live("/fleet/tails", CHUNK, self._colours, self._trail_px)
        self._ahead = self._live("/fleet/ahead", ahead, [self._theme.line_ahead(colour) for colour in own], ahead_px)
        self._stems = self._live("/fleet/stems", 1, own, STEM_PX)
        self._batch = self._line("/trails/newest", self._lines.batch, self._lines.colours, visible=False)

    def _seal(self, chunks: Sequence[tuple[int, Array]]) -> None:
        """Seal chunks of trails, given with the index of their vehicle."""
        if not chunks:
            return
        chunks_m = np.array([points_m for _, points_m in chunks])
        segments, of_chunk = joined_where(chunks_m, thinned(chunks_m, self._tolerance_m))
        own = np.array([self._colours[index] for index, _ in chunks], dtype=np.uint8)
        new, gone = self._lines.add(segments, own[of_chunk])
        for line in gone:
            self._sealed.pop(line.name).remove()
        for line in new:
            self._sealed[line.name] = self._draw_sealed(line)
        self._batch_sent = False

    def _send_batch(self) -> None:
        if self._batch_sent:
            return
        self._batch_sent = True
        self._batch.points = self._lines.batch.astype(np.float32)
        self._batch.colors = self._lines.colours
        self._batch.visible = True

    def _draw_sealed(self, line: SealedLine) -> viser.SceneNodeHandle:
        """A large fleet's are many: plain lines, which cost a browser least."""
        name = f"/trails/{line.name}"
        if self._many:
            model = line_model(line.segments, line.colours)
            return self._scene.add_glb(name, model, cast_shadow=False, receive_shadow=False)
        return self._line(name, line.segments, line.colours, visible=True)

    def _line(
        self, name: str, segments: Array, colours: npt.NDArray[np.uint8], *, visible: bool
    ) -> viser.LineSegmentsHandle:
        return self._scene.add_line_segments(
            name, segments, colours, thickness=self._trail_px, thickness_units="screen", visible=visible
        )

    def _live(self, name: str, per_vehicle: int, own: Sequence[Rgb], width_px: float) -> viser.LineSegmentsHandle:
        tints = np.repeat(np.array(own, dtype=np.uint8).reshape(-1, 3), per_vehicle, axis=0)[:, None].repeat(2, axis=1)
        nowhere = np.zeros((len(tints), 2, 3))
        return self._scene.add_line_segments(
            name, nowhere, tints, thickness=width_px, thickness_units="screen", visible=bool(own)
        )
