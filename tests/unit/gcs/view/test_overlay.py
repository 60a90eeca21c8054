"""What lies over one browser's picture."""

import re

import numpy as np
import pytest

from gcs.view.framing import Pose
from gcs.view.labels import Lens
from gcs.view.overlay import FEW, Overlay, Tag, length_words

LENS = Lens(Pose(np.array([0.0, -10.0, 0.0]), np.zeros(3)), np.deg2rad(90.0), 1000, 800)
"""From the south: 40 pixels are a metre at the origin."""


def tag(name: str, **options) -> Tag:
    return Tag(f"vehicle {name}", name, "Offboard · 90 %", (10, 200, 30), 30.0, **options)


def line_of(count: int) -> np.ndarray:
    """Places side by side, none over the corner."""
    return np.column_stack((np.linspace(-8.0, 8.0, count), np.zeros(count), np.full(count, -2.0)))


def test_a_tag_names_its_vehicle_in_its_colour_and_stands_above_it():
    html = Overlay().render([tag("alpha")], np.zeros((1, 3)), LENS)
    assert "<b>alpha</b><span>Offboard · 90 %</span>" in html
    assert "--own:#0ac81e" in html
    found = re.search(r'class="tag vehicle" style="--x:(\d+);--y:(\d+)', html)
    assert found is not None
    assert int(found[1]) == 500
    assert int(found[2]) == pytest.approx(400 - 31, abs=1)


def test_what_comes_from_outside_is_text():
    html = Overlay().render([tag("<img src=x>")], np.zeros((1, 3)), LENS)
    assert "<img" not in html
    assert "&lt;img" in html


def test_in_a_large_fleet_only_those_that_want_attention_tell_more_than_their_name():
    tags = [tag(f"v{index}", urgency=3 if index == 7 else 0) for index in range(FEW + 1)]
    html = Overlay().render(tags, line_of(FEW + 1), LENS)
    assert html.count("<span>") == 1
    assert "<b>v7</b><span>" in html


def test_a_vehicle_out_of_the_picture_has_an_arrow_at_the_edge_towards_it():
    html = Overlay().render([tag("alpha")], np.array([[100.0, 0.0, 0.0]]), LENS)
    assert 'class="tag' not in html
    found = re.search(r'class="out" style="--x:(\d+);--y:(\d+);color:#0ac81e;--turn:(-?\d+)deg', html)
    assert found is not None
    assert int(found[1]) > 950
    assert int(found[2]) == pytest.approx(400, abs=2)
    assert found[3] == "0"


def test_what_is_selected_has_a_ring_even_where_its_tag_has_no_room():
    crowd = [tag(f"v{index}", urgency=2) for index in range(80)] + [tag("chosen", selected=True)]
    html = Overlay().render(crowd, np.zeros((81, 3)), LENS)
    assert html.count("<circle cx") == 1
    assert "<b>chosen</b>" not in html


def test_tags_go_along_with_their_vehicles_and_do_not_tremble():
    overlay, places_m = Overlay(), np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.1]])
    tags = [tag("alpha"), tag("bravo")]

    def stands(html: str) -> list[tuple[int, int]]:
        return [(int(x), int(y)) for x, y in re.findall(r'class="tag vehicle" style="--x:(\d+);--y:(\d+)', html)]

    first = stands(overlay.render(tags, places_m, LENS))
    for step in range(1, 8):
        moved = stands(overlay.render(tags, places_m + [0.05 * step, 0.0, 0.0], LENS))
        assert np.allclose(np.array(moved) - first, [2 * step, 0], atol=1)


def test_the_needle_points_north():
    assert 'rotate(0)">' in Overlay().render([], np.zeros((0, 3)), LENS)
    from_east = Lens(Pose(np.array([10.0, 0.0, 3.0]), np.zeros(3)), np.deg2rad(90.0), 1000, 800)
    assert 'rotate(90)">' in Overlay().render([], np.zeros((0, 3)), from_east)  # north is to the right
    above = Lens(Pose(np.array([0.0, -0.01, 10.0]), np.zeros(3)), np.deg2rad(90.0), 1000, 800)
    assert 'rotate(0)">' in Overlay().render([], np.zeros((0, 3)), above)


def test_the_scale_bar_is_a_round_length():
    html = Overlay().render([], np.zeros((0, 3)), LENS)
    assert 'class="scale" style="--long:80">2 m' in html


@pytest.mark.parametrize(("length_m", "words"), [(500.0, "500 m"), (2000.0, "2 km"), (0.5, "50 cm"), (0.002, "2 mm")])
def test_lengths_are_told_in_the_unit_that_fits(length_m: float, words: str):
    assert length_words(length_m) == words
