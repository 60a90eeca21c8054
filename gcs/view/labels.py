"""How the name tags of vehicles and targets keep out of each other's way in the picture; pure."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gcs.view.framing import Pose, camera_axes

Array = npt.NDArray[np.float64]

TAG_HEIGHT_PX = 22.0
STEM_PX = 8.0
"""Between what is named and the foot of its tag, at least."""
CHARACTER_PX = 7.5
PADDING_PX = 14.0
STEP_PX = 12.0
"""A tag is lifted by multiples of this, so that it does not tremble."""
MOST_STEPS = 30
NEAREST_M = 1e-3


class Area(NamedTuple):
    """A rectangle in the picture, by its centre and half its size [px]."""

    x: float
    y: float
    half_width: float
    half_height: float

    def overlaps(self, other: "Area") -> bool:
        return (
            abs(self.x - other.x) < self.half_width + other.half_width
            and abs(self.y - other.y) < self.half_height + other.half_height
        )


@dataclass(frozen=True)
class Lens:
    """One browser's camera: from where, how wide, and how many pixels."""

    pose: Pose
    fov_rad: float
    width_px: int
    height_px: int

    @property
    def up(self) -> Array:
        """(3,) the direction that is up in the picture."""
        return camera_axes(self.pose.position_m - self.pose.look_at_m)[1]

    def metres_per_pixel(self, points_m: Array) -> Array:
        """(n,) at the distances of (n, 3) points."""
        _, _, back = camera_axes(self.pose.position_m - self.pose.look_at_m)
        depths_m = np.maximum((self.pose.position_m - points_m) @ back, NEAREST_M)
        return depths_m * np.tan(self.fov_rad / 2) / (self.height_px / 2)

    def project(self, points_m: Array) -> Array:
        """(n, 2) pixels, x to the right and y upwards from the picture's centre, of (n, 3) points before the camera."""
        right, up, _ = camera_axes(self.pose.position_m - self.pose.look_at_m)
        from_camera_m = points_m - self.pose.position_m
        return np.stack((from_camera_m @ right, from_camera_m @ up), axis=1) / self.metres_per_pixel(points_m)[:, None]


def tag_width_px(text: str) -> float:
    """About how wide a tag with this text is."""
    return CHARACTER_PX * len(text) + PADDING_PX


def lifts_px(anchors_px: Array, widths_px: Sequence[float], spans_px: Sequence[float]) -> Array:
    """(n,) how far above its anchor each tag has to stand so that no two cover each other, or what is named.

    The tags are placed from the bottom of the picture upwards: the lowest anchor has the shortest stem.

    Args:
        anchors_px: (n, 2) x and y, y upwards.
        widths_px: n widths of the tags.
        spans_px: n widths and heights of what is named.
    """
    taken = [Area(x, y, span / 2, span / 2) for (x, y), span in zip(anchors_px, spans_px, strict=True)]
    result = np.zeros(len(widths_px))
    for index in np.argsort(anchors_px[:, 1], kind="stable"):
        (x, y), half = anchors_px[index], widths_px[index] / 2
        steps = spans_px[index] / 2 + STEM_PX + STEP_PX * np.arange(MOST_STEPS)
        areas = [Area(x, y + up + TAG_HEIGHT_PX / 2, half, TAG_HEIGHT_PX / 2) for up in steps]
        best = next((i for i, area in enumerate(areas) if not any(area.overlaps(other) for other in taken)), 0)
        taken.append(areas[best])
        result[index] = steps[best]
    return result
