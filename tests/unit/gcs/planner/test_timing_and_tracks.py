"""When vehicles are where, and what an autopilot is told of it."""

import itertools

import numpy as np
import pytest

from gcs.planner import feasibility
from gcs.planner.curves import cross, curvature, dense_curves, path_lengths
from gcs.planner.timing import Timing, common_timing
from gcs.planner.track_points import MOST_POINTS, sample_track, thin
from missions import obstacles, time_law
from missions.mission import Mission, load_mission
from tests.unit.gcs.planner.worlds import room, wall

NO_STOPS = np.empty((0, 3))


def lines(*ends: tuple[tuple[float, ...], tuple[float, ...]], count: int = 600) -> np.ndarray:
    """(vehicles, m, 3) straight curves."""
    return np.array([np.linspace(begin, end, count) for begin, end in ends])


def distances_to_segment(points_m: np.ndarray, begin_m: np.ndarray, end_m: np.ndarray) -> np.ndarray:
    """(n,) distances of (n, 3) points to the straight segment between two (3,) points."""
    leg = end_m - begin_m
    along = np.clip((points_m - begin_m) @ leg / max(float(leg @ leg), 1e-12), 0.0, 1.0)
    return np.linalg.norm(points_m - begin_m - along[:, None] * leg, axis=1)


def douglas_peucker(curve_m: np.ndarray, begin: int, end: int, tolerance_m: float) -> set[int]:
    off_m = distances_to_segment(curve_m[begin : end + 1], curve_m[begin], curve_m[end])
    worst = begin + int(np.argmax(off_m))
    if off_m.max() <= tolerance_m:
        return {begin, end}
    halves = (begin, worst), (worst, end)
    return set().union(*(douglas_peucker(curve_m, *half, tolerance_m) for half in halves))


def timed(mission: Mission, curves_m: np.ndarray) -> Timing:
    measured = feasibility.measure(mission, curves_m)
    return common_timing(mission, curves_m, measured.clearance_m, measured.curvature_1_m)


GAP = room(wall(10.0, (5.2, 6.8)), pads_m=((1.0, 6.0, 0.0),), targets_m=((19.0, 6.0, 1.5),))
"""In the gap there are 0.8 m of clearance: enough to pass, too little to pass at cruise speed."""
THROUGH_THE_GAP = lines(((1, 6, 1.5), (19, 6, 1.5)))


def test_a_dense_curve_is_equally_spaced_and_keeps_its_ends():
    control_m = np.array([[0, 0, 0], [1, 4, 0], [5, 5, 2], [9, 0, 1], [9, 1, 0], [12, 3, 2.0]])
    (curve_m,) = dense_curves(control_m[None], 0.05)
    steps_m = np.linalg.norm(np.diff(curve_m, axis=0), axis=1)
    assert steps_m.max() <= 0.05
    np.testing.assert_allclose(steps_m, steps_m.mean(), rtol=1e-3)
    np.testing.assert_array_equal(curve_m[[0, -1]], control_m[[0, -1]])


def test_the_curvature_of_a_circle_is_one_over_its_radius():
    angle = np.linspace(0.0, 2.0, 400)
    circle = np.stack((4.0 * np.cos(angle), 4.0 * np.sin(angle), 0.0 * angle), axis=-1)
    np.testing.assert_allclose(curvature(circle), 0.25, rtol=1e-4)


def test_in_the_open_a_vehicle_speeds_up_cruises_and_stops():
    mission = room(pads_m=((1.0, 6.0, 0.0),), targets_m=((19.0, 6.0, 1.5),))
    timing = timed(mission, THROUGH_THE_GAP)
    assert timing.times_s[-1] == pytest.approx(18.0 / 3.0 + 3.0 / 2.0, abs=0.02)  # L / v + v / a
    assert not timing.held_back.any()


def test_near_an_obstacle_it_flies_at_avoidance_speed_and_brakes_before():
    timing = timed(GAP, THROUGH_THE_GAP)
    speed_m_s = np.diff(THROUGH_THE_GAP[0, :, 0]) / np.diff(timing.times_s)
    near = obstacles.clearance(THROUGH_THE_GAP[0], obstacles.pack(GAP.world)) < 1.0
    assert np.all(speed_m_s[near[1:] & near[:-1]] < 1.0 + 1e-6)
    assert speed_m_s.max() == pytest.approx(3.0, abs=0.01)
    acceleration_m_s2 = np.diff(speed_m_s) / np.diff(timing.times_s)[1:]
    assert np.abs(acceleration_m_s2[10:-10]).max() < 2.1
    assert timing.held_back[near].all()
    braking = timing.held_back & ~near
    assert THROUGH_THE_GAP[0, braking, 0].max() < 10.0  # ahead of the wall only
    assert np.count_nonzero(braking) * 18.0 / 600 == pytest.approx(2.0, abs=0.1)  # (3^2 - 1^2) / (2 a)


def test_all_vehicles_pass_equal_shares_of_their_paths_at_the_same_time():
    """The shorter path is flown slower; whoever is in the open waits for who is near an obstacle."""
    curves_m = lines(((1, 6, 1.5), (19, 6, 1.5)), ((1, 1, 1.5), (7, 1, 1.5)))
    alone, together = timed(GAP, curves_m[:1]), timed(GAP, curves_m)
    np.testing.assert_allclose(together.times_s, alone.times_s)
    speed_m_s = np.diff(curves_m[1, :, 0]) / np.diff(together.times_s)
    assert speed_m_s.max() == pytest.approx(1.0, abs=0.01)


def test_turns_are_flown_no_faster_than_the_acceleration_allows():
    mission = room(pads_m=((9.0, 7.0, 0.0),), targets_m=((11.0, 7.0, 1.5),))
    angle = np.linspace(0.0, np.pi, 800)
    curve_m = np.stack((10.0 - np.cos(angle), 7.0 + np.sin(angle), 1.5 + 0.0 * angle), axis=-1)
    timing = timed(mission, curve_m[None])
    speed_m_s = (np.pi / 799) / np.diff(timing.times_s)
    assert speed_m_s.max() <= np.sqrt(2.0 * 1.0) * 1.01  # v^2 / R <= a


def test_between_two_obstacles_it_does_not_speed_up_for_a_moment():
    two = room(wall(8.0, (5.2, 6.8)) + wall(12.0, (5.2, 6.8)), pads_m=((1.0, 6.0, 0.0),), targets_m=((19.0, 6.0, 1.5),))
    assert np.count_nonzero(np.diff(timed(two, THROUGH_THE_GAP).held_back)) == 2


def test_a_straight_flight_is_one_leg_to_the_target():
    mission = room(pads_m=((1.0, 6.0, 0.0),), targets_m=((19.0, 6.0, 1.5),))
    track = sample_track(mission, THROUGH_THE_GAP[0], timed(mission, THROUGH_THE_GAP), NO_STOPS)
    np.testing.assert_allclose(track.points_m, [[19.0, 6.0, 1.5]])
    assert track.speeds_m_s.tolist() == [3.0]


def test_no_leg_is_faster_than_obstacles_allow_and_speed_changes_are_few():
    track = sample_track(GAP, THROUGH_THE_GAP[0], timed(GAP, THROUGH_THE_GAP), NO_STOPS)
    assert track.speeds_m_s.tolist() == [3.0, 1.0, 3.0]
    begins_m = np.concatenate(([[1, 6, 1.5]], track.points_m[:-1]))
    solid = obstacles.pack(GAP.world)
    for begin_m, end_m, speed_m_s in zip(begins_m, track.points_m, track.speeds_m_s, strict=True):
        clearance_m = obstacles.clearance(np.linspace(begin_m, end_m, 200)[1:-1], solid)
        assert speed_m_s == 1.0 or clearance_m.min() >= 1.0


def wavy(swing_m: float) -> np.ndarray:
    x = np.linspace(1.0, 19.0, 900)
    return np.stack((x, 7.0 + swing_m * np.sin(3.0 * x), 1.5 + 0.0 * x), axis=-1)[None]


@pytest.mark.parametrize("swing_m", [0.3, 1.0])
def test_legs_stay_near_the_curve_unless_that_takes_too_many(swing_m: float):
    mission = room(pads_m=((1.0, 7.0, 0.0),), targets_m=((19.0, 7.0, 1.5),), turn_radius_m=0.0)
    curves_m = wavy(swing_m)
    track = sample_track(mission, curves_m[0], timed(mission, curves_m), NO_STOPS)
    corners_m = np.concatenate((curves_m[0, :1], track.points_m))
    off_m = np.min([distances_to_segment(curves_m[0], a, b) for a, b in itertools.pairwise(corners_m)], axis=0).max()
    assert len(track.points_m) <= MOST_POINTS
    assert off_m <= (0.11 if swing_m == 0.3 else 0.7)
    np.testing.assert_array_equal(track.points_m[-1], curves_m[0, -1])


def test_outdoors_leg_speeds_are_fine_enough_to_arrive_together():
    mission = load_mission("terrain-1-5uav")
    curves_m = lines(((0, 0, 0), (2000, 1200, 900)), ((0, 0, 0), (2000, 680, 280)), count=2500)
    timing = timed(mission, curves_m)
    tracks = [sample_track(mission, curve_m, timing, NO_STOPS) for curve_m in curves_m]
    lengths_m = path_lengths(curves_m)
    arrivals_s = [length_m / track.speeds_m_s[0] for length_m, track in zip(lengths_m, tracks, strict=True)]
    assert abs(arrivals_s[0] - arrivals_s[1]) < 2.0
    assert tracks[0].speeds_m_s[0] == 3.0
    assert tracks[1].speeds_m_s[0] == pytest.approx(3.0 * lengths_m[1] / lengths_m[0], abs=0.005)


def test_times_follow_from_the_law_of_the_missions_package():
    timing = timed(GAP, THROUGH_THE_GAP)
    limit_m_s = timing.allowed_1_s * 18.0
    expected = time_law.times_along(THROUGH_THE_GAP[0], time_law.speeds_along(THROUGH_THE_GAP[0], limit_m_s, 2.0))
    np.testing.assert_allclose(timing.times_s, expected, atol=1e-6)


def test_targets_on_the_way_are_points_of_the_track_in_their_order():
    mission = room(pads_m=((1.0, 7.0, 0.0),), targets_m=((19.0, 7.0, 1.5),), turn_radius_m=0.0)
    curves_m = wavy(0.3)
    stops_m = curves_m[0, [300, 500]] + 0.01
    track = sample_track(mission, curves_m[0], timed(mission, curves_m), stops_m)
    first, second = (np.flatnonzero(np.all(track.points_m == stop_m, axis=1)) for stop_m in stops_m)
    assert len(first) == len(second) == 1
    assert first[0] < second[0] < len(track.points_m) - 1


@pytest.mark.parametrize("seed", range(5))
def test_the_compiled_thinning_is_that_of_douglas_and_peucker(seed: int):
    rng = np.random.default_rng(seed)
    curve_m = np.cumsum(rng.normal(0.0, 1.0, (300, 3)), axis=0)
    fixed, kept = np.array([0, 120, 299]), np.zeros(300, bool)
    kept[fixed] = True
    thin(curve_m, fixed, 2.0, kept)
    expected = douglas_peucker(curve_m, 0, 120, 2.0) | douglas_peucker(curve_m, 120, 299, 2.0)
    assert set(np.flatnonzero(kept).tolist()) == expected


def test_cross_products_are_those_of_numpy():
    a, b = np.random.default_rng(1).normal(size=(2, 4, 5, 3))
    np.testing.assert_allclose(cross(a, b), np.cross(a, b), atol=1e-12)
