"""Where the name tags of vehicles and targets stand in one browser's picture, so that they can be read; pure.

Pixels are counted from the picture's upper left corner, x to the right and y downwards.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import numpy.typing as npt

from gcs.view.framing import Pose, camera_axes

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

CELL_PX = 5.0
"""The picture is divided into cells this wide; each is taken or free."""
GAP_PX = 6.0
"""Between what is named and its tag."""
STEP_PX, RINGS = 26.0, 7
"""A tag without room beside what it names moves away in steps, at most so many."""
NEAREST_M = 1e-3


@dataclass(frozen=True)
class Lens:
    """One browser's camera: from where, how wide, and how many pixels."""

    pose: Pose
    fov_rad: float
    width_px: int
    height_px: int

    @cached_property
    def axes(self) -> Array:
        """(3, 3) unit vectors to the right, upwards and towards the camera."""
        return np.array(camera_axes(self.pose.position_m - self.pose.look_at_m))

    def metres_per_pixel(self, points_m: Array) -> Array:
        """(n,) at the distances of (n, 3) points."""
        depths_m = np.maximum((self.pose.position_m - points_m) @ self.axes[2], NEAREST_M)
        return depths_m * (float(np.tan(self.fov_rad / 2)) / (self.height_px / 2))

    def project(self, points_m: Array) -> tuple[Array, Bools]:
        """(n, 2) pixels of (n, 3) points, and which of them are before the camera and in its picture."""
        from_camera_m = (points_m - self.pose.position_m) @ self.axes.T
        depths_m = -from_camera_m[:, 2]
        scale = (self.height_px / 2) / (np.tan(self.fov_rad / 2) * np.maximum(depths_m, NEAREST_M))
        pixels = np.stack(
            (self.width_px / 2 + from_camera_m[:, 0] * scale, self.height_px / 2 - from_camera_m[:, 1] * scale), axis=1
        )
        inside = np.all((pixels >= 0.0) & (pixels < [self.width_px, self.height_px]), axis=1)
        return pixels, inside & (depths_m > NEAREST_M)


def place(
    anchors_px: Array,
    sizes_px: Array,
    spans_px: Array,
    picture_px: tuple[int, int],
    before_px: Array | None = None,
    *,
    rings: int = RINGS,
    kept_free_px: Sequence[tuple[float, float, float, float]] = (),
) -> Array:
    """(n, 2) from each anchor to the middle of its tag; NaN for a tag for which there is no room.

    The tags are placed in the order in which they are given: the first ones get the best places.

    Args:
        anchors_px: (n, 2) what is named.
        sizes_px: (n, 2) width and height of the tags.
        spans_px: (n,) width and height of what is named; no tag covers it.
        picture_px: width and height of the picture; tags stay inside.
        before_px: (n, 2) the last result for the same tags: a tag stays where it stood as long as it is free there.
        rings: how far a tag may move away, in steps.
        kept_free_px: left, top, right and bottom of what no tag may cover.
    """
    taken = _Cells(picture_px)
    for left, top, right, bottom in kept_free_px:
        taken.take(np.array([left + right, top + bottom]) / 2, ((right - left) / 2, (bottom - top) / 2))
    for anchor, span in zip(anchors_px, spans_px, strict=True):
        taken.take(anchor, (span / 2, span / 2))
    result = np.full((len(anchors_px), 2), np.nan)
    for index, (anchor, size) in enumerate(zip(anchors_px, sizes_px, strict=True)):
        half = (float(size[0]) / 2, float(size[1]) / 2)
        offsets = _candidates(round(float(size[0])), round(float(size[1])), round(float(spans_px[index])), rings)
        stood = before_px[index : index + 1] if before_px is not None else offsets[:0]
        for offset in (offsets[0], *stood, *offsets[1:]):
            if taken.is_free(anchor + offset, half):
                taken.take(anchor + offset, half)
                result[index] = offset
                break
    return result


class _Cells:
    """Which cells of a picture are taken."""

    def __init__(self, picture_px: tuple[int, int]) -> None:
        self._width, self._height = picture_px
        self._taken = np.zeros((int(self._height / CELL_PX) + 2, int(self._width / CELL_PX) + 2), dtype=bool)

    def is_free(self, middle: Array, half: tuple[float, float]) -> bool:
        """Whether a rectangle lies in the picture and covers nothing."""
        x, y = float(middle[0]), float(middle[1])
        if not (half[0] <= x <= self._width - half[0] and half[1] <= y <= self._height - half[1]):
            return False  # also where the place is not a number
        return not self._taken[self._area(x, y, half)].any()

    def take(self, middle: Array, half: tuple[float, float]) -> None:
        self._taken[self._area(float(middle[0]), float(middle[1]), half)] = True

    @staticmethod
    def _area(x: float, y: float, half: tuple[float, float]) -> tuple[slice, slice]:
        left, right = int(max(x - half[0], 0.0) / CELL_PX), int(max(x + half[0], 0.0) / CELL_PX)
        top, bottom = int(max(y - half[1], 0.0) / CELL_PX), int(max(y + half[1], 0.0) / CELL_PX)
        return slice(top, bottom + 1), slice(left, right + 1)


@lru_cache(maxsize=512)
def _candidates(width_px: int, height_px: int, span_px: int, rings: int) -> Array:
    """(m, 2) places of a tag's middle around its anchor, the best first: above, beside, below, then farther away."""
    near = (span_px + height_px) / 2 + GAP_PX
    beside = (span_px + width_px) / 2 + GAP_PX
    places = [(0.0, -near), (beside, 0.0), (-beside, 0.0), (0.0, near)]
    for ring in range(1, rings + 1):
        far = near + ring * STEP_PX
        aside = np.array([0.0, 0.45, -0.45, 0.9, -0.9]) * (width_px + ring * STEP_PX / 2)
        places += [(float(x), y) for y in (-far, far) for x in aside]
    return np.array(places)
