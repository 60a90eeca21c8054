"""The fleet as it is drawn: quadrotors, and the stems that show where above the ground they are."""

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt
import viser

from gcs.view import colours, shapes
from gcs.view.labels import Lens
from gcs.view.sightings import Sighting

Array = npt.NDArray[np.float64]

SPAN_M = 0.55
"""True size of a vehicle, from rotor tip to rotor tip."""
LEAST_SPAN_PX = 46.0
"""A vehicle is drawn larger than it is where it would be smaller than this in the picture."""


def spans_m(positions_m: Array, lens: Lens | None) -> Array:
    """(n,) sizes at which vehicles at (n, 3) positions are drawn."""
    if lens is None:
        return np.full(len(positions_m), SPAN_M)
    return np.maximum(SPAN_M, LEAST_SPAN_PX * lens.metres_per_pixel(positions_m))


class VehicleScene:
    """All vehicles, as a few batched nodes.

    Args:
        scene: of the page.
        ground_height_m: the height of the ground below (n, 2) places.
    """

    def __init__(self, scene: viser.SceneApi, ground_height_m: Callable[[Array], Array]) -> None:
        self._scene, self._ground_height_m = scene, ground_height_m
        self._drawn: list[int] = []
        self._batches: list[viser.BatchedMeshHandle] = []
        self._stems: viser.LineSegmentsHandle | None = None

    def move(self, seen: Sequence[Sighting], lens: Lens | None) -> None:
        """Bring every vehicle to where it is now."""
        if not seen:
            return
        positions_m = np.array([sighting.position_m for sighting in seen])
        rotations = np.array([sighting.wxyz for sighting in seen])
        sizes_m = spans_m(positions_m, lens)
        if [sighting.sysid for sighting in seen] != self._drawn:
            self._build(seen, positions_m, rotations, sizes_m)
        for batch in self._batches:
            batch.batched_positions = positions_m.astype(np.float32)
            batch.batched_wxyzs = rotations.astype(np.float32)
            batch.batched_scales = sizes_m.astype(np.float32)
        assert self._stems is not None
        self._stems.points = self._stem_lines(positions_m).astype(np.float32)

    def _build(self, seen: Sequence[Sighting], positions_m: Array, rotations: Array, sizes_m: Array) -> None:
        self._drawn = [sighting.sysid for sighting in seen]
        own = np.array([colours.vivid(sighting.colour) for sighting in seen], dtype=np.uint8)
        grey = np.tile(np.array(colours.AIRFRAME, np.uint8), (len(seen), 1))
        quadrotor = shapes.quadrotor()
        self._batches = [
            self._batch("hull", quadrotor.hull, own, positions_m, rotations, sizes_m),
            self._batch("airframe", quadrotor.airframe, grey, positions_m, rotations, sizes_m),
            self._batch("rotors", quadrotor.rotors, own, positions_m, rotations, sizes_m, opacity=0.45),
        ]
        tints = np.repeat(own[:, None], 2, axis=1)
        self._stems = self._scene.add_line_segments(
            "/fleet/stems", self._stem_lines(positions_m), tints, thickness=1.0, thickness_units="screen"
        )

    def _batch(
        self,
        name: str,
        mesh: shapes.Mesh,
        tints: npt.NDArray[np.uint8],
        positions_m: Array,
        rotations: Array,
        sizes_m: Array,
        opacity: float | None = None,
    ) -> viser.BatchedMeshHandle:
        return self._scene.add_batched_meshes_simple(
            f"/fleet/{name}",
            mesh.vertices,
            mesh.faces,
            rotations,
            positions_m,
            batched_scales=sizes_m,
            batched_colors=tints,
            opacity=opacity,
            flat_shading=True,
            side="double",
            lod="off",
        )

    def _stem_lines(self, positions_m: Array) -> Array:
        feet = np.column_stack((positions_m[:, :2], self._ground_height_m(positions_m[:, :2])))
        return np.stack((feet, positions_m), axis=1)
