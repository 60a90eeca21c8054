"""The fleet as one browser is shown it: quadrotors, as large as its camera needs them."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import viser

from gcs.view import colours, shapes
from gcs.view.labels import Lens
from gcs.view.sightings import Sightings
from gcs.view.theme import DARK, Theme
from gcs.view.viser_internals import send

Array = npt.NDArray[np.float64]
Pick = Callable[[int, bool], None]
"""Called with the system id of the vehicle that was clicked, and whether it joins those that are selected."""

SPAN_M = 0.55
"""True size of a vehicle, from rotor tip to rotor tip."""
LEAST_SPAN_PX, LEAST_SPAN_OF_MANY_PX = 46.0, 24.0
"""A vehicle is drawn larger than it is where it would be smaller than this in the picture."""
MANY = 30
GROWTH = 1.05
"""Sizes are powers of this, so that they are seldom sent anew."""


def least_span_px(count: int) -> float:
    """How small a vehicle of such a fleet may become in the picture."""
    return LEAST_SPAN_OF_MANY_PX if count > MANY else LEAST_SPAN_PX


def spans_m(positions_m: Array, lens: Lens | None) -> Array:
    """(n,) sizes at which vehicles at (n, 3) positions are drawn."""
    if lens is None:
        return np.full(len(positions_m), SPAN_M)
    wanted_m = np.maximum(SPAN_M, least_span_px(len(positions_m)) * lens.metres_per_pixel(positions_m))
    steps: Array = np.log(wanted_m / SPAN_M) / np.log(GROWTH)
    return SPAN_M * GROWTH ** np.round(steps)


class VehicleScene:
    """All vehicles, as a few batched nodes; those of a large fleet, which are small, as one.

    Args:
        scene: of the page, or of one browser.
        on_pick: see `Pick`; in a thread of viser.
        theme: dark or light.
    """

    def __init__(self, scene: viser.SceneApi, on_pick: Pick | None = None, theme: Theme = DARK) -> None:
        self._scene, self._on_pick, self._theme = scene, on_pick, theme
        self._drawn: list[int] = []
        self._sizes_m = np.zeros(0)
        self._batches: list[viser.BatchedMeshHandle] = []

    def use(self, theme: Theme) -> None:
        """Draw the vehicles dark or light from now on."""
        self._theme, self._drawn = theme, []

    def move(self, seen: Sightings, lens: Lens | None, *, resize: bool = True) -> None:
        """Bring every vehicle to where it is now, and if wanted to the size that it needs there."""
        if not seen:
            return
        known = self._sizes_m if seen.sysids == self._drawn and not resize else None
        sizes_m = spans_m(seen.positions_m, lens) if known is None else known
        if seen.sysids != self._drawn:
            self._build(seen, sizes_m)
        places, turns = seen.positions_m.astype(np.float32), seen.wxyz.astype(np.float32)
        resized, self._sizes_m = not np.array_equal(sizes_m, self._sizes_m), sizes_m
        for batch in self._batches:
            send(batch, batched_positions=places, batched_wxyzs=turns)
            if resized:
                batch.batched_scales = sizes_m.astype(np.float32)

    def _build(self, seen: Sightings, sizes_m: Array) -> None:
        for batch in self._batches:
            batch.remove()
        self._drawn, self._sizes_m = seen.sysids, sizes_m
        own = np.array([colours.vivid(colour) for colour in seen.colours], dtype=np.uint8)
        if len(seen) > MANY:
            self._batches = [self._batch("hull", shapes.small_quadrotor(), own, seen, sizes_m)]
        else:
            quadrotor = shapes.quadrotor()
            grey = np.tile(np.array(self._theme.airframe, np.uint8), (len(seen), 1))
            self._batches = [
                self._batch("hull", quadrotor.hull, own, seen, sizes_m),
                self._batch("airframe", quadrotor.airframe, grey, seen, sizes_m),
                self._batch("rotors", quadrotor.rotors, own, seen, sizes_m, opacity=0.45),
            ]
        for batch in self._batches if self._on_pick is not None else ():
            batch.on_click(lambda event: self._clicked(event.instance_index, joins=False))
            batch.on_click(modifier="shift")(lambda event: self._clicked(event.instance_index, joins=True))

    def _clicked(self, index: int | None, *, joins: bool) -> None:
        drawn = self._drawn
        if index is not None and index < len(drawn) and self._on_pick is not None:
            self._on_pick(drawn[index], joins)

    def _batch(
        self,
        name: str,
        mesh: shapes.Mesh,
        tints: npt.NDArray[np.uint8],
        seen: Sightings,
        sizes_m: Array,
        opacity: float | None = None,
    ) -> viser.BatchedMeshHandle:
        return self._scene.add_batched_meshes_simple(
            f"/fleet/{name}",
            mesh.vertices,
            mesh.faces,
            seen.wxyz,
            seen.positions_m,
            batched_scales=sizes_m,
            batched_colors=tints,
            opacity=opacity,
            flat_shading=True,
            side="double",
            lod="off",
        )
