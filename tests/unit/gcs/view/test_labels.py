"""Name tags keep clear of each other."""

import itertools

import numpy as np
import pytest

from gcs.view.framing import Pose
from gcs.view.labels import STEM_PX, TAG_HEIGHT_PX, Area, Lens, lifts_px

LENS = Lens(Pose(np.array([0.0, -10.0, 0.0]), np.zeros(3)), np.deg2rad(90.0), 1000, 800)
"""From the south, 10 m off: 400 pixels above the centre are 10 m."""


def test_what_the_camera_looks_at_is_in_the_middle_of_the_picture():
    np.testing.assert_allclose(LENS.project(np.zeros((1, 3))), [[0.0, 0.0]], atol=1e-9)


def test_east_is_right_and_up_is_up_in_a_view_from_the_south():
    points_m = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 10.0, 0.0]])
    np.testing.assert_allclose(LENS.project(points_m), [[40.0, 0.0], [0.0, 40.0], [20.0, 0.0]], atol=1e-9)
    np.testing.assert_allclose(LENS.metres_per_pixel(points_m), [0.025, 0.025, 0.05])


def test_a_lone_tag_stands_on_the_shortest_stem():
    assert lifts_px(np.array([[0.0, 0.0]]), [80.0], [30.0]).tolist() == [15.0 + STEM_PX]


def tag_areas(anchors_px: np.ndarray, widths_px: list[float], lifts: np.ndarray) -> list[Area]:
    half = TAG_HEIGHT_PX / 2
    return [Area(x, y + up + half, w / 2, half) for (x, y), w, up in zip(anchors_px, widths_px, lifts, strict=True)]


@pytest.mark.parametrize("spread_px", [0.0, 20.0, 100.0, 400.0])
def test_ten_tags_do_not_cover_each_other_nor_the_vehicles(spread_px: float):
    rng = np.random.default_rng(3)
    anchors_px, widths_px = rng.normal(scale=spread_px, size=(10, 2)), [110.0] * 10
    tags = tag_areas(anchors_px, widths_px, lifts_px(anchors_px, widths_px, [28.0] * 10))
    vehicles = [Area(x, y, 14.0, 14.0) for x, y in anchors_px]
    assert not any(one.overlaps(other) for one, other in itertools.combinations(tags, 2))
    assert not any(tag.overlaps(vehicle) for tag in tags for vehicle in vehicles)


def test_lower_vehicles_have_the_shorter_stems():
    anchors_px = np.array([[0.0, 30.0], [0.0, 0.0]])
    lifts = lifts_px(anchors_px, [100.0, 100.0], [20.0, 20.0])
    assert lifts[0] + 30.0 > lifts[1]
