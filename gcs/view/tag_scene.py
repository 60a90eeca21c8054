"""Name tags of vehicles and targets as they are drawn: upright, of one size, on stems, clear of each other."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import viser

from gcs.view.colours import Rgb
from gcs.view.labels import Lens, offsets_px, tag_width_px

Array = npt.NDArray[np.float64]

STEM_WIDTH_PX = 1.0
BLIND_LIFT_M = 0.4
"""How far up a tag stands as long as no camera is known."""
STILL_M = 1e-6


@dataclass(frozen=True)
class Tag:
    """A name tag: `key` stays the same while text and place change."""

    key: str
    text: str
    anchor_m: Array
    colour: Rgb
    span_px: float
    """How large what is named is in the picture."""
    scale: float = 1.0


class TagScene:
    """All tags.

    Args:
        scene: of the page.
    """

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._labels: dict[str, viser.LabelHandle] = {}
        self._stems: viser.LineSegmentsHandle | None = None
        self._offsets_px = np.zeros((0, 2))
        self._feet_m = np.zeros((0, 3))

    def show(self, tags: Sequence[Tag], lens: Lens | None) -> None:
        """Bring texts up to date, and settle anew where each tag stands."""
        if [tag.key for tag in tags] != list(self._labels):
            self._build(tags)
        for tag in tags:
            self._labels[tag.key].text = tag.text
        if lens is not None and tags:
            anchors_px = lens.project(np.array([tag.anchor_m for tag in tags]))
            widths_px = [tag_width_px(tag.text) * tag.scale for tag in tags]
            spans_px = [tag.span_px for tag in tags]
            picture_px = (float(lens.width_px), float(lens.height_px))
            self._offsets_px = offsets_px(anchors_px, widths_px, spans_px, picture_px, self._offsets_px)

    def move(self, anchors_m: Array, lens: Lens | None) -> None:
        """Bring the tags to where what they name is now: (n, 3), in the order in which they are shown."""
        if self._stems is None or len(anchors_m) != len(self._labels):
            return  # a vehicle has come or gone since they were shown
        feet_m = anchors_m + self._offsets_m(anchors_m, lens)
        moved = np.abs(feet_m - self._feet_m).max(axis=1) > STILL_M
        for label, foot_m, has_moved in zip(self._labels.values(), feet_m, moved.tolist(), strict=True):
            if has_moved:
                label.position = foot_m
        self._feet_m = feet_m
        self._stems.points = np.stack((anchors_m, feet_m), axis=1).astype(np.float32)

    def _offsets_m(self, anchors_m: Array, lens: Lens | None) -> Array:
        if lens is None:
            return np.broadcast_to([0.0, 0.0, BLIND_LIFT_M], anchors_m.shape)
        return (self._offsets_px * lens.metres_per_pixel(anchors_m)[:, None]) @ lens.picture_axes

    def _build(self, tags: Sequence[Tag]) -> None:
        for label in self._labels.values():
            label.remove()
        self._labels = {
            tag.key: self._scene.add_label(
                f"/tags/{tag.key}", tag.text, font_screen_scale=tag.scale, anchor="bottom-center"
            )
            for tag in tags
        }
        self._feet_m, self._offsets_px = np.full((len(tags), 3), np.inf), np.zeros((len(tags), 2))
        nowhere = np.zeros((len(tags), 2, 3))
        colours = np.array([[tag.colour] * 2 for tag in tags], dtype=np.uint8).reshape(-1, 2, 3)
        self._stems = self._scene.add_line_segments(
            "/tags/stems", nowhere, colours, thickness=STEM_WIDTH_PX, thickness_units="screen", visible=bool(tags)
        )
