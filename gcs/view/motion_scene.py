"""Where the vehicles have been and what lies ahead of them, as it is drawn.

Of each trail only the newest part is sent at every update; what is older is sealed, and goes out once.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import viser

from gcs.desk import Desk
from gcs.flight.trails import Trails
from gcs.view import lines
from gcs.view.colours import Rgb, faded, vivid
from gcs.view.lines import AHEAD, CHUNK, AheadLine, TrailLine
from gcs.view.sightings import Sighting

Array = npt.NDArray[np.float64]

TRAIL_PX, AHEAD_PX = 2.5, 5.0
WHITE: Rgb = (255, 255, 255)


class MotionScene:
    """Trails and companions' trajectories of all vehicles.

    Args:
        scene: of the page.
        spacing_m: between two points of a trail, at least.
    """

    def __init__(self, scene: viser.SceneApi, spacing_m: float) -> None:
        self._scene, self._spacing_m = scene, spacing_m
        self._trails: Trails | None = None
        self._past: dict[int, TrailLine] = {}
        self._future: dict[int, AheadLine] = {}
        self._sealed: list[viser.LineSegmentsHandle] = []
        self._drawn: list[int] = []
        self._tails: viser.LineSegmentsHandle | None = None
        self._ahead: viser.LineSegmentsHandle | None = None

    def update(self, desk: Desk, seen: Sequence[Sighting], now_s: float) -> None:
        """Follow the vehicles to where they are now."""
        if desk.trails is not self._trails:
            self._forget(desk.trails)
        if not seen:
            return
        for sighting in seen:
            self._seal(sighting)
            companion_heard = sighting.state.companion_online(now_s)
            self._future.setdefault(sighting.sysid, AheadLine()).take(sighting.state.companion, alive=companion_heard)
        positions_m = np.array([sighting.position_m for sighting in seen])
        tails = lines.tails([self._past[sighting.sysid] for sighting in seen], positions_m)
        ahead = lines.ways_ahead([self._future[sighting.sysid] for sighting in seen], positions_m)
        if [sighting.sysid for sighting in seen] != self._drawn:
            self._drawn = [sighting.sysid for sighting in seen]
            self._tails = self._live("tails", tails, [_trail_colour(s) for s in seen], CHUNK, TRAIL_PX)
            self._ahead = self._live(
                "ahead", ahead, [faded(vivid(s.colour), WHITE, 0.2) for s in seen], AHEAD, AHEAD_PX
            )
        assert self._tails is not None
        assert self._ahead is not None
        self._tails.points = tails.astype(np.float32)
        self._ahead.points = ahead.astype(np.float32)

    def _forget(self, trails: Trails | None) -> None:
        """Begin anew: the frame of the page has changed."""
        for handle in self._sealed:
            handle.remove()
        self._trails, self._past, self._sealed = trails, {}, []

    def _seal(self, sighting: Sighting) -> None:
        line = self._past.setdefault(sighting.sysid, TrailLine(self._spacing_m))
        trail = self._trails.by_sysid.get(sighting.sysid) if self._trails is not None else None
        if trail is None:
            return
        first = line.sealed
        for index, chunk in enumerate(line.take(trail)):
            name = f"/trails/{sighting.sysid}/{first + index}"
            colour = _trail_colour(sighting)
            handle = self._scene.add_line_segments(name, chunk, colour, thickness=TRAIL_PX, thickness_units="screen")
            self._sealed.append(handle)

    def _live(
        self, name: str, segments: Array, own: Sequence[Rgb], per_vehicle: int, width_px: float
    ) -> viser.LineSegmentsHandle:
        tints = np.repeat(np.array(own, dtype=np.uint8), per_vehicle, axis=0)[:, None].repeat(2, axis=1)
        return self._scene.add_line_segments(
            f"/fleet/{name}", segments, tints, thickness=width_px, thickness_units="screen"
        )


def _trail_colour(sighting: Sighting) -> Rgb:
    return faded(vivid(sighting.colour), share=0.1)
