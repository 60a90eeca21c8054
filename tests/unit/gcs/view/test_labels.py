"""Name tags keep clear of each other."""

import itertools
from typing import NamedTuple

import numpy as np
import pytest

from gcs.view.framing import Pose
from gcs.view.labels import CELL_PX, GAP_PX, Lens, place

LENS = Lens(Pose(np.array([0.0, -10.0, 0.0]), np.zeros(3)), np.deg2rad(90.0), 1000, 800)
"""From the south, 10 m off: 400 pixels above the centre are 10 m."""
PICTURE_PX = (1200, 800)
WIDTH_PX, HEIGHT_PX, SPAN_PX = 110.0, 20.0, 28.0


def test_what_the_camera_looks_at_is_in_the_middle_of_the_picture():
    np.testing.assert_allclose(LENS.project(np.zeros((1, 3)))[0], [[500.0, 400.0]], atol=1e-9)


def test_east_is_right_and_up_is_up_in_a_view_from_the_south():
    points_m = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 10.0, 0.0]])
    np.testing.assert_allclose(LENS.project(points_m)[0], [[540.0, 400.0], [500.0, 360.0], [520.0, 400.0]], atol=1e-9)
    np.testing.assert_allclose(LENS.metres_per_pixel(points_m), [0.025, 0.025, 0.05])


def test_what_is_behind_the_camera_or_beside_the_picture_is_not_seen():
    points_m = np.array([[0.0, 0.0, 0.0], [0.0, -20.0, 0.0], [20.0, 0.0, 0.0], [0.0, 0.0, -11.0]])
    assert LENS.project(points_m)[1].tolist() == [True, False, False, False]


def tags(anchors_px: np.ndarray, before_px: np.ndarray | None = None, **options) -> np.ndarray:
    count = len(anchors_px)
    sizes_px = np.tile([WIDTH_PX, HEIGHT_PX], (count, 1))
    return place(anchors_px, sizes_px, np.full(count, SPAN_PX), PICTURE_PX, before_px, **options)


HOME = [0.0, -(SPAN_PX + HEIGHT_PX) / 2 - GAP_PX]


def test_a_lone_tag_stands_right_above_what_it_names():
    np.testing.assert_array_equal(tags(np.array([[600.0, 400.0]])), [HOME])


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

    def inside(self) -> bool:
        across = self.half_width <= self.x <= PICTURE_PX[0] - self.half_width
        return across and self.half_height <= self.y <= PICTURE_PX[1] - self.half_height


@pytest.mark.parametrize("spread_px", [0.0, 20.0, 100.0, 400.0])
@pytest.mark.parametrize("count", [2, 10, 20])
def test_tags_do_not_cover_each_other_nor_the_vehicles_and_stay_in_the_picture(spread_px: float, count: int):
    rng = np.random.default_rng(3)
    anchors_px = np.clip(rng.normal((600, 400), spread_px, size=(count, 2)), 60.0, (1140.0, 740.0))
    middles = anchors_px + tags(anchors_px)
    assert not np.isnan(middles).any(), "there is room for all of them"
    drawn = [Area(x, y, WIDTH_PX / 2, HEIGHT_PX / 2) for x, y in middles]
    vehicles = [Area(x, y, SPAN_PX / 2, SPAN_PX / 2) for x, y in anchors_px]
    assert not any(one.overlaps(other) for one, other in itertools.combinations(drawn, 2))
    assert not any(tag.overlaps(vehicle) for tag in drawn for vehicle in vehicles)
    assert all(tag.inside() for tag in drawn)


def test_where_there_is_no_room_the_first_tags_are_shown_and_the_last_are_left_out():
    middles = tags(np.tile([600.0, 400.0], (60, 1)), rings=1)
    assert not np.isnan(middles[0]).any()
    assert np.isnan(middles[-1]).all()


def test_no_tag_covers_what_is_kept_free():
    offset = tags(np.array([[600.0, 400.0]]), kept_free_px=[(500.0, 300.0, 700.0, 385.0)])[0]
    assert offset.tolist() != HOME
    assert not np.isnan(offset).any()


def test_a_tag_stays_where_it_stood_as_long_as_it_covers_nothing_and_goes_home_when_it_can():
    anchors_px = np.array([[600.0, 400.0], [610.0, 405.0]])
    first = tags(anchors_px)
    assert first[1].tolist() != first[0].tolist()
    stood = first + np.array([[0.0, 0.0], [2 * CELL_PX, 17.0]])  # free as well
    np.testing.assert_array_equal(tags(anchors_px, stood), stood)
    apart_px = anchors_px + np.array([[0.0, 0.0], [300.0, 0.0]])
    np.testing.assert_array_equal(tags(apart_px, stood), [HOME, HOME])
