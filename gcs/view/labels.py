"""How the name tags of vehicles and targets keep out of each other's way in the picture; pure."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from gcs.view.framing import Pose, camera_axes

Array = npt.NDArray[np.float64]

TAG_HEIGHT_PX = 22.0
STEM_PX = 8.0
"""Between what is named and the foot of its tag, at least."""
CHARACTER_PX = 7.5
PADDING_PX = 14.0
STEP_PX, STEPS = 12.0, 16
"""A tag stands in one of these heights above its anchor, so that it does not tremble."""
SIDEWAYS_COST, BELOW_COST_PX = 0.8, 40.0
MOST_SETTLED = 40
"""More tags than this stand right above what they name: there is no room for order."""
NEAREST_M = 1e-3


@dataclass(frozen=True)
class Lens:
    """One browser's camera: from where, how wide, and how many pixels."""

    pose: Pose
    fov_rad: float
    width_px: int
    height_px: int

    @property
    def picture_axes(self) -> Array:
        """(2, 3) the directions that are to the right and up in the picture."""
        return np.array(camera_axes(self.pose.position_m - self.pose.look_at_m)[:2])

    def metres_per_pixel(self, points_m: Array) -> Array:
        """(n,) at the distances of (n, 3) points."""
        _, _, back = camera_axes(self.pose.position_m - self.pose.look_at_m)
        depths_m: Array = np.maximum((self.pose.position_m - points_m) @ back, NEAREST_M)
        return depths_m * (float(np.tan(self.fov_rad / 2)) / (self.height_px / 2))

    def project(self, points_m: Array) -> Array:
        """(n, 2) pixels, x to the right and y upwards from the picture's centre, of (n, 3) points before the camera."""
        right, up, _ = camera_axes(self.pose.position_m - self.pose.look_at_m)
        from_camera_m = points_m - self.pose.position_m
        return np.stack((from_camera_m @ right, from_camera_m @ up), axis=1) / self.metres_per_pixel(points_m)[:, None]


def tag_width_px(text: str) -> float:
    """About how wide a tag with this text is."""
    return CHARACTER_PX * len(text) + PADDING_PX


def offsets_px(
    anchors_px: Array,
    widths_px: Sequence[float],
    spans_px: Sequence[float],
    picture_px: tuple[float, float],
    before_px: Array | None = None,
) -> Array:
    """(n, 2) where the foot of each tag has to stand, from its anchor, so that no two cover each other or a vehicle.

    The tags are placed one after the other, from the lowest anchor upwards: right above if there is room, else where
    it stood before, else as near as it can be.

    Args:
        anchors_px: (n, 2) x to the right and y upwards, from the picture's centre.
        widths_px: n widths of the tags.
        spans_px: n widths and heights of what is named.
        picture_px: width and height of the picture; tags outside of it are of no use.
        before_px: (n, 2) the last result for the same tags, if there is one.
    """
    count = len(widths_px)
    if count > MOST_SETTLED:
        return np.stack((np.zeros(count), np.array(spans_px) / 2 + STEM_PX), axis=1)
    taken = _Taken(np.tile(anchors_px, (2, 1)), np.zeros((2 * count, 2)), np.array(picture_px) / 2, count)
    taken.halves[:count] = np.array(spans_px)[:, None] / 2
    result = np.zeros((count, 2))
    for index in np.argsort(anchors_px[:, 1], kind="stable"):
        feet, half = _candidates(widths_px[index], spans_px[index]), np.array([widths_px[index], TAG_HEIGHT_PX]) / 2
        favoured = feet[:1] if before_px is None else np.array([feet[0], before_px[index]])
        result[index] = taken.take(anchors_px[index], half, favoured, feet)
    return result


@dataclass
class _Taken:
    """Rectangles in the picture that are taken: `count` of them, by centre and half size (m, 2)."""

    centres: Array
    halves: Array
    half_picture: Array
    count: int

    def take(self, anchor: Array, half: Array, favoured: Array, feet: Array) -> Array:
        """Take the place of a tag: on the first foot that is free, those in favour before the others."""
        lift = np.array([0.0, half[1]])
        foot = feet[0]
        for tried in (favoured, feet):
            free = self._free(anchor + tried + lift, half)
            if free.any():
                foot = tried[np.argmax(free)]
                break
        self.centres[self.count], self.halves[self.count] = anchor + foot + lift, half
        self.count += 1
        return foot

    def _free(self, middles: Array, half: Array) -> npt.NDArray[np.bool_]:
        """Which of the rectangles around (k, 2) places lie in the picture and cover nothing that is taken."""
        gaps = np.abs(middles[:, None] - self.centres[: self.count]) - self.halves[: self.count] - half
        inside = np.all(np.abs(middles) + half <= self.half_picture, axis=1)
        return inside & np.all(np.any(gaps >= 0.0, axis=2), axis=1)


@cache
def _candidates(width_px: float, span_px: float) -> Array:
    """(m, 2) feet around an anchor, the best first: above, then higher, to the sides and below."""
    up = span_px / 2 + STEM_PX + STEP_PX * np.arange(STEPS)
    down = -(span_px / 2 + STEM_PX + TAG_HEIGHT_PX) - STEP_PX * np.arange(STEPS)
    aside = np.array([0.0, 0.35, -0.35, 0.7, -0.7, 1.05, -1.05]) * width_px
    sideways, upwards = np.meshgrid(aside, np.concatenate((up, down)))
    feet = np.column_stack((sideways.ravel(), upwards.ravel())).astype(np.float64)
    costs = np.hypot(feet[:, 0] * SIDEWAYS_COST, feet[:, 1]) + np.where(feet[:, 1] < 0.0, BELOW_COST_PX, 0.0)
    return feet[np.argsort(costs, kind="stable")]
