"""Name tags keep clear of each other."""

import itertools
from typing import NamedTuple

import numpy as np
import pytest

from gcs.view.framing import Pose
from gcs.view.labels import STEM_PX, TAG_HEIGHT_PX, Lens, offsets_px

LENS = Lens(Pose(np.array([0.0, -10.0, 0.0]), np.zeros(3)), np.deg2rad(90.0), 1000, 800)
"""From the south, 10 m off: 400 pixels above the centre are 10 m."""


def test_what_the_camera_looks_at_is_in_the_middle_of_the_picture():
    np.testing.assert_allclose(LENS.project(np.zeros((1, 3))), [[0.0, 0.0]], atol=1e-9)


def test_east_is_right_and_up_is_up_in_a_view_from_the_south():
    points_m = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 10.0, 0.0]])
    np.testing.assert_allclose(LENS.project(points_m), [[40.0, 0.0], [0.0, 40.0], [20.0, 0.0]], atol=1e-9)
    np.testing.assert_allclose(LENS.metres_per_pixel(points_m), [0.025, 0.025, 0.05])


PICTURE_PX = (1200.0, 800.0)


def test_a_lone_tag_stands_right_above_what_it_names():
    np.testing.assert_array_equal(offsets_px(np.zeros((1, 2)), [80.0], [30.0], PICTURE_PX), [[0.0, 15.0 + STEM_PX]])


class Area(NamedTuple):
    """A rectangle in the picture, by its centre and half its size [px]."""

    x: float
    y: float
    half_width: float
    half_height: float

    def overlaps(self, other: "Area") -> bool:
        beside = abs(self.x - other.x) >= self.half_width + other.half_width - 1e-9
        above = abs(self.y - other.y) >= self.half_height + other.half_height - 1e-9
        return not beside and not above

    def inside(self, picture_px: tuple[float, float]) -> bool:
        width, height = picture_px
        return abs(self.x) + self.half_width <= width / 2 and abs(self.y) + self.half_height <= height / 2


def tag_areas(anchors_px: np.ndarray, widths_px: list[float], offsets: np.ndarray) -> list[Area]:
    half, feet = TAG_HEIGHT_PX / 2, anchors_px + offsets
    return [Area(x, y + half, width / 2, half) for (x, y), width in zip(feet, widths_px, strict=True)]


@pytest.mark.parametrize("spread_px", [0.0, 20.0, 100.0, 400.0])
@pytest.mark.parametrize("count", [2, 10, 20])
def test_tags_do_not_cover_each_other_nor_the_vehicles_and_stay_in_the_picture(spread_px: float, count: int):
    rng = np.random.default_rng(3)
    anchors_px, widths_px = np.clip(rng.normal(scale=spread_px, size=(count, 2)), -350, 350), [110.0] * count
    tags = tag_areas(anchors_px, widths_px, offsets_px(anchors_px, widths_px, [28.0] * count, PICTURE_PX))
    vehicles = [Area(x, y, 14.0, 14.0) for x, y in anchors_px]
    assert not any(one.overlaps(other) for one, other in itertools.combinations(tags, 2))
    assert not any(tag.overlaps(vehicle) for tag in tags for vehicle in vehicles)
    assert all(tag.inside(PICTURE_PX) for tag in tags)


def test_where_there_is_no_room_a_tag_stands_above_all_the_same():
    offsets = offsets_px(np.zeros((60, 2)), [110.0] * 60, [28.0] * 60, (300.0, 200.0))
    assert offsets.shape == (60, 2)
    assert offsets[-1].tolist() == [0.0, 14.0 + STEM_PX]


def test_a_tag_stays_where_it_stood_as_long_as_it_covers_nothing_and_goes_home_when_it_can():
    anchors_px, arguments = np.array([[0.0, 0.0], [10.0, 5.0]]), ([110.0] * 2, [28.0] * 2, PICTURE_PX)
    first = offsets_px(anchors_px, *arguments)
    assert first[1].tolist() != first[0].tolist()
    stood = first + np.array([[0.0, 0.0], [5.0, 17.0]])  # free as well
    np.testing.assert_array_equal(offsets_px(anchors_px, *arguments, stood), stood)
    apart_px = anchors_px + np.array([[0.0, 0.0], [300.0, 0.0]])
    np.testing.assert_array_equal(offsets_px(apart_px, *arguments, stood), np.tile([0.0, 14.0 + STEM_PX], (2, 1)))
