"""Guides, references, ways around, and the spline's constants."""

import msgspec
import numpy as np
import pytest

from companion.planner.detours import blocked_samples, lead_around
from companion.planner.grid_search import way_around
from companion.planner.guide import corner_speeds, lay_guide, nearest_on, run_out
from companion.planner.reference import LEG_SPEED, SPEED_CAP, TANGENT, Way, corner_speed, lay_reference, reach_speeds
from companion.planner.spline_shape import sample_rows, spline_shape
from missions import bspline, obstacles
from missions.mission_items import Track
from missions.time_law import arc_length, resample, speeds_along
from missions.trajectory import Motion, Trajectory
from missions.world import Box, World
from tests.unit.companion.planner.problems import (
    AROUND_THE_CRATE_M,
    INDOOR,
    TERRAIN,
    limits_and_surroundings,
    way_of,
)

LIMITS, AROUND = limits_and_surroundings()
HORIZON_M = INDOOR.onboard.horizon_m
TRACK = Track(AROUND_THE_CRATE_M[1:], np.full(7, 3.0), tuple(range(1, 8)))
START_M, TARGET_M = AROUND_THE_CRATE_M[0], AROUND_THE_CRATE_M[-1]


def along(corners_m: np.ndarray) -> np.ndarray:
    """(400, 3) points along a polyline."""
    arcs = arc_length(corners_m)
    return resample(corners_m, arcs, np.linspace(0.0, arcs[-1], 400))


def guide_from(place_m: np.ndarray, index: int = 0, track: Track = TRACK):
    return lay_guide(track, index, np.asarray(place_m, dtype=float), HORIZON_M, LIMITS)


# --------------------------------------------------------------------------------- guide


def test_a_guide_leads_from_the_vehicle_through_every_point_of_the_track():
    guide = guide_from(START_M)
    for arc_m, point_m in zip(guide.track_arc_m, TRACK.points_m, strict=True):
        np.testing.assert_allclose(guide.point(arc_m), point_m, atol=1e-9)
    np.testing.assert_allclose(guide.point(0.0), START_M)
    assert guide.length_m == pytest.approx(arc_length(AROUND_THE_CRATE_M)[-1])
    assert np.diff(guide.way.arc_m).max() <= HORIZON_M / 60 + 1e-9


def test_points_that_were_passed_are_left_out():
    guide = guide_from([9.0, 5.0, 1.5], index=3)
    assert guide.first_index == 3
    np.testing.assert_allclose(guide.point(guide.track_arc_m[0]), TRACK.points_m[3])
    assert guide.way.points_m[:, 0].min() >= 9.0 - 1e-9


def test_a_vehicle_before_the_track_flies_to_its_first_point():
    guide = guide_from([1.0, 9.0, 1.5])
    np.testing.assert_allclose(guide.point(guide.track_arc_m[0]), TRACK.points_m[0])


def test_a_vehicle_beside_the_track_joins_it_ahead():
    guide = guide_from([11.0, 7.0, 1.5], index=4)
    joined = guide.way.points_m[1:]
    assert np.all(np.diff(joined[:, 0]) > 0.0), "not back to where it left"
    _, off_m = nearest_on(AROUND_THE_CRATE_M, arc_length(AROUND_THE_CRATE_M), guide.point(2.5))
    assert off_m < 0.3


def test_of_a_track_that_comes_back_the_earlier_part_is_joined():
    there_and_back = Track(np.array([[5.0, 2, 2], [15.0, 2, 2], [15.0, 2.2, 2], [1.0, 2.2, 2]]), np.full(4, 3.0))
    guide = guide_from([8.0, 2.1, 2.0], index=1, track=there_and_back)
    assert guide.first_index == 1
    assert guide.length_m == pytest.approx(7.0 + 0.2 + 14.0, abs=0.3)


def test_progress_is_measured_along_the_guide():
    guide = guide_from(START_M)
    for arc_m in (0.0, 3.3, 9.9, guide.length_m):
        beside_m = guide.point(arc_m) + np.array([0.0, 0.1, 0.05])
        assert guide.project(beside_m, max(arc_m - 1.0, 0.0), 3.0) == pytest.approx(arc_m, abs=0.15)
    assert guide.project(START_M, 5.0, 2.0) >= 5.0, "never backwards"
    indices = [guide.next_index(arc_m) for arc_m in np.linspace(0.0, guide.length_m, 40)]
    assert indices == sorted(indices)
    assert (indices[0], indices[-1]) == (0, 6)


def test_legs_without_a_speed_are_flown_at_cruise_speed():
    guide = guide_from(START_M, track=Track(TARGET_M[None], np.array([np.nan])))
    assert guide.way.samples[:, LEG_SPEED].max() == pytest.approx(LIMITS.cruise_m_s)


def test_sharp_corners_are_slow_and_straights_are_not():
    square = np.array([[0.0, 0, 1], [5, 0, 1], [5, 5, 1]])
    arcs = np.linspace(0.0, 10.0, 101)
    points = np.array([square[0] + [min(a, 5.0), max(a - 5.0, 0.0), 0.0] for a in arcs])
    speeds = corner_speeds(points, arcs, 0.9, LIMITS)
    assert speeds[50] == pytest.approx(np.sqrt(0.85 * 2.0 / (np.pi / 2 / 0.9)), rel=1e-6)
    assert speeds[20] > 100.0


def test_on_a_circle_the_corner_speed_is_that_of_its_radius():
    angle = np.linspace(0.0, 3.0, 400)
    circle = np.column_stack((3.0 * np.cos(angle), 3.0 * np.sin(angle), np.ones(400)))
    speeds = corner_speeds(circle, arc_length(circle), 0.9, LIMITS)
    assert speeds[200] == pytest.approx(np.sqrt(0.85 * 2.0 * 3.0), rel=0.02)


@pytest.mark.parametrize(("velocity_m_s", "runs_out"), [([2.5, 0, 0], True), ([0, 0, 0], False), ([0, 2.5, 0], False)])
def test_who_is_fast_and_turns_sharply_runs_out_first(velocity_m_s: list[float], runs_out: bool):
    north = Track(np.array([[3.0, 13.0, 1.5]]), np.array([3.0]))
    start = Motion(np.array([3.0, 3.0, 1.5]), np.array(velocity_m_s, dtype=float), np.zeros(3))
    over_m = run_out(north, 0, start, LIMITS)
    assert (over_m is not None) is runs_out
    if over_m is not None:
        guide = lay_guide(north, 0, start.position_m, HORIZON_M, LIMITS, over_m)
        np.testing.assert_allclose(over_m[1:], start.position_m[1:])
        assert over_m[0] - 3.0 > (2.5**2 - 1.0) / (2.0 * 2.0), "it needs that much to brake"
        assert np.linalg.norm(guide.way.points_m - over_m, axis=1).min() < 1e-9
        np.testing.assert_allclose(guide.point(guide.track_arc_m[0]), north.points_m[0])


# ----------------------------------------------------------------------------- detours


def test_a_guide_through_obstacles_is_led_around_them():
    guide = guide_from(START_M, track=Track(TARGET_M[None], np.array([3.0])))
    assert blocked_samples(guide.way.points_m, AROUND, LIMITS).any()
    led = lead_around(guide, AROUND, LIMITS, HORIZON_M, 0.2)
    assert led is not None
    assert obstacles.clearance(led.way.points_m, AROUND.obstacles).min() >= LIMITS.clearance_m
    np.testing.assert_allclose([led.point(0.0), led.end_m], [START_M, TARGET_M])
    assert led.length_m < 1.2 * guide.length_m
    assert led.track_arc_m[-1] == pytest.approx(led.length_m)


def test_a_guide_that_is_clear_stays_itself():
    guide = guide_from(START_M)
    assert lead_around(guide, AROUND, LIMITS, HORIZON_M, 0.2) is guide


def test_without_a_way_around_there_is_no_guide():
    inside = Track(np.array([[7.0, 7.0, 1.5]]), np.array([3.0]))
    blocked = guide_from(START_M, track=Track(np.array([[7.0, 7.0, 1.5], [12.0, 2.0, 1.5]]), np.full(2, 3.0)))
    walled_in = LIMITS._replace(clearance_m=8.0)
    assert lead_around(blocked, AROUND, walled_in, HORIZON_M, 0.2) is None
    assert inside.points_m.shape == (1, 3)


def test_a_way_around_is_clear_short_and_not_steeper_than_needed():
    corners = way_around(START_M, TARGET_M, 4.0, 0.2, LIMITS, AROUND)
    assert obstacles.clearance(along(corners), AROUND.obstacles).min() >= LIMITS.clearance_m
    assert arc_length(corners)[-1] < 1.2 * np.linalg.norm(TARGET_M - START_M)
    sides = np.diff(corners, axis=0)
    assert np.all(np.abs(sides[:, 2]) <= np.hypot(sides[:, 0], sides[:, 1]) * LIMITS.climb_tangent + 0.2)


def test_a_way_keeps_the_avoidance_distance_where_that_is_quicker():
    corners = way_around(START_M, np.array([13.0, 6.0, 1.5]), 4.0, 0.2, LIMITS, AROUND)
    assert obstacles.clearance(corners[1:-1], AROUND.obstacles).min() >= LIMITS.avoidance_distance_m - 0.2


def test_out_of_a_closed_room_there_is_no_way():
    walled_in = LIMITS._replace(clearance_m=20.0)
    start_m, goal_m = np.array([7.0, 3.0, 1.5]), np.array([7.0, 12.0, 1.5])
    assert way_around(start_m, goal_m, 4.0, 0.2, walled_in, AROUND).shape == (0, 3)


def with_boxes(*boxes: Box):
    """The room with nothing but some boxes in it."""
    world = msgspec.structs.replace(INDOOR.world, boxes=boxes, cylinders=())
    return AROUND._replace(obstacles=obstacles.pack(world))


@pytest.mark.parametrize("quick", [False, True])
def test_a_low_wall_from_side_to_side_is_flown_over(quick: bool):
    around = with_boxes(Box(name="wall", centre_m=(10.0, 7.5, 1.0), half_m=(0.2, 7.5, 1.0)))
    start_m, goal_m = np.array([7.0, 7.0, 1.5]), np.array([13.0, 7.0, 1.5])
    assert way_around(start_m, goal_m, 4.0, 0.2, LIMITS, around, flat=True, quick=quick).shape == (0, 3)
    corners = way_around(start_m, goal_m, 4.0, 0.2, LIMITS, around, quick=quick)
    assert corners[:, 2].max() >= 2.0 + LIMITS.clearance_m
    assert obstacles.clearance(along(corners), around.obstacles).min() >= LIMITS.clearance_m


def test_over_is_flown_where_beside_takes_much_longer():
    around = with_boxes(Box(name="wall", centre_m=(10.0, 4.0, 0.5), half_m=(0.2, 4.0, 1.0)))
    start_m, goal_m = np.array([8.0, 2.0, 1.5]), np.array([12.0, 2.0, 1.5])
    corners = way_around(start_m, goal_m, 8.0, 0.2, LIMITS, around, flat=True)
    assert corners[:, 1].max() < 6.0
    assert corners[:, 2].max() >= 1.5 + LIMITS.clearance_m


def test_a_level_way_keeps_to_the_line_from_start_to_goal_in_height():
    around = with_boxes(Box(name="post", centre_m=(10.0, 7.0, 2.0), half_m=(0.5, 0.5, 2.0)))
    start_m, goal_m = np.array([6.0, 7.0, 1.0]), np.array([14.0, 7.0, 2.0])
    places_m = along(way_around(start_m, goal_m, 4.0, 0.2, LIMITS, around))
    np.testing.assert_allclose(places_m[:, 2], 1.0 + (places_m[:, 0] - 6.0) / 8.0, atol=0.05)


def test_a_guide_whose_next_places_are_walled_in_is_led_to_the_track_point():
    walls = [(9.0, 7.0, 0.2, 3.0), (17.0, 7.0, 0.2, 3.0), (13.0, 4.2, 4.0, 0.2), (13.0, 9.8, 4.0, 0.2)]
    boxes = [
        Box(name=f"wall {i}", centre_m=(east, north, 2.0), half_m=(half_east, half_north, 2.0))
        for i, (east, north, half_east, half_north) in enumerate(walls)
    ]
    around, track = with_boxes(*boxes), Track(np.array([[19.0, 7.0, 1.5]]), np.array([3.0]))
    guide = guide_from([2.0, 7.0, 1.5], track=track)
    led = lead_around(guide, around, LIMITS, 5.0, 0.2, quick=True)
    assert led is not None
    assert obstacles.clearance(led.way.points_m, around.obstacles).min() >= LIMITS.clearance_m
    np.testing.assert_allclose(led.end_m, [19.0, 7.0, 1.5])


def test_large_worlds_are_searched_with_larger_cells():
    limits, around = limits_and_surroundings(TERRAIN)
    start_m, target_m = np.array([0.0, 0.0, 10.0]), np.array([2000.0, 1200.0, 900.0])
    corners = way_around(start_m, target_m, 500.0, 4.0, limits, around)
    assert obstacles.clearance(along(corners), around.obstacles).min() >= limits.clearance_m


# --------------------------------------------------------------------------- reference


def test_reachable_speeds_are_the_time_laws():
    rng = np.random.default_rng(1)
    arcs = np.cumsum(rng.uniform(0.05, 0.3, 60))
    aims = rng.uniform(0.5, 3.0, 60)
    points = np.column_stack((arcs, np.zeros(60), np.zeros(60)))
    expected = speeds_along(points, aims.copy(), 1.7, start_m_s=0.4)
    reach_speeds(arcs, aims, 0.4, 1.7)
    np.testing.assert_allclose(aims, expected, atol=1e-12)


def test_who_starts_too_fast_brakes_as_hard_as_it_can():
    arcs, speeds = np.linspace(0.0, 3.0, 31), np.full(31, 1.0)
    reach_speeds(arcs, speeds, 2.0, 1.5)
    np.testing.assert_allclose(speeds[:10], np.sqrt(4.0 - 3.0 * arcs[:10]), atol=1e-9)


def reference_of(start: np.ndarray, points_m: np.ndarray = AROUND_THE_CRATE_M, to_m: float = 7.5):
    return lay_reference(way_of(points_m), 0.0, to_m, start, 61, LIMITS, AROUND)


def test_a_reference_begins_at_the_vehicle_and_ends_on_the_way():
    start = np.array([[1.0, 6.8, 1.4], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    reference = reference_of(start)
    np.testing.assert_allclose(reference.samples[0, :3], start[0])
    np.testing.assert_allclose(reference.samples[-1, :3], guide_from(START_M).point(7.5), atol=0.02)


def test_a_reference_keeps_the_speed_rule_and_the_acceleration():
    start = np.array([START_M, np.zeros(3), np.zeros(3)])
    reference = reference_of(start)
    step_s = reference.duration_s / 60
    speeds = np.linalg.norm(np.diff(reference.samples[:, :3], axis=0), axis=1) / step_s
    middle = 0.5 * (reference.samples[1:, :3] + reference.samples[:-1, :3])
    near = obstacles.clearance(middle, AROUND.obstacles) < LIMITS.avoidance_distance_m - 0.05
    assert speeds.max() <= LIMITS.cruise_m_s * LIMITS.nominal_ratio + 1e-6
    assert near.any()
    assert speeds[near].max() <= LIMITS.avoidance_m_s * LIMITS.nominal_ratio + 0.1
    assert np.abs(np.diff(speeds)).max() / step_s <= 1.3 * LIMITS.braking_m_s2


def test_a_way_that_lacks_a_little_distance_is_passed_farther_off_at_speed():
    beside = np.array([[3.0, 4.4, 1.5], [11.0, 4.4, 1.5]])  # 1.1 m from the crate, planned with 1.15 m
    reference = reference_of(np.array([beside[0], np.zeros(3), np.zeros(3)]), beside, 8.0)
    free_m = obstacles.clearance(np.ascontiguousarray(reference.samples[:, :3]), AROUND.obstacles)
    assert free_m.min() >= LIMITS.avoidance_distance_m - 0.01
    assert reference.duration_s < 5.0


def test_on_a_circle_a_reference_has_the_speed_of_its_radius():
    angle = np.linspace(0.0, 2.0, 64)
    circle = np.column_stack((3.0 * np.cos(angle), 3.0 * np.sin(angle), np.ones(64)))
    for j in (0, 30, 63):
        assert corner_speed(circle, j, LIMITS) == pytest.approx(np.sqrt(0.85 * 2.0 * 3.0), rel=0.01)
    straight = np.column_stack((angle, angle, angle))
    assert corner_speed(straight, 30, LIMITS) > 100.0


def test_a_reference_takes_corners_slowly_and_rounds_them():
    square = np.array([[4.0, 9.0, 1.5], [8.0, 9.0, 1.5], [8.0, 5.0, 1.5]])
    open_air = AROUND._replace(obstacles=obstacles.pack(World(bounds=INDOOR.world.bounds)))
    start = np.array([square[0], np.zeros(3), np.zeros(3)])
    reference = lay_reference(way_of(square), 0.0, 7.0, start, 61, LIMITS, open_air)
    step_s = reference.duration_s / 60
    steps = np.diff(reference.samples[:, :3], axis=0)
    speeds = np.linalg.norm(steps, axis=1) / step_s
    corner = int(np.argmin(np.linalg.norm(reference.samples[:, :3] - square[1], axis=1)))
    assert speeds[corner - 1 : corner + 1].max() < 0.75 * speeds.max()
    across = np.linalg.norm(np.diff(steps, axis=0), axis=1)[corner - 4 : corner + 4] / step_s**2
    assert across.max() < 1.6 * LIMITS.acceleration_m_s2


def test_who_moves_leaves_in_its_direction():
    start = np.array([START_M, [1.2, 1.2, 0.0], np.zeros(3)])
    first = reference_of(start).samples[:4, :3] - START_M
    turned = np.arctan2(first[1:, 1], first[1:, 0])
    assert turned[0] > np.radians(25.0)
    assert np.all(np.diff(turned) < 0.0), "and comes back to its way"


def test_leg_speeds_cap_a_reference_and_tangents_are_unit_vectors():
    start = np.array([START_M, np.zeros(3), np.zeros(3)])
    slow = lay_reference(way_of(AROUND_THE_CRATE_M, 1.2), 0.0, 6.0, start, 61, LIMITS, AROUND)
    speeds = np.linalg.norm(np.diff(slow.samples[:, :3], axis=0), axis=1) / (slow.duration_s / 60)
    assert speeds.max() <= 1.2 + 1e-6
    assert slow.samples[:, SPEED_CAP].max() == pytest.approx(1.2 / LIMITS.nominal_ratio)
    lengths = np.linalg.norm(slow.samples[:, TANGENT : TANGENT + 3], axis=1)
    assert np.all((np.abs(lengths - 1.0) < 1e-9) | (lengths == 0.0))


def test_a_reference_at_the_target_reads_nothing_behind_the_ways_only_sample():
    samples = np.vstack((np.array([*START_M, 3.0, 0.2]), np.full(5, np.nan)))
    at_target = Way(samples[:1], np.array([0.0, np.nan])[:1])
    start = np.array([START_M, np.zeros(3), np.zeros(3)])
    reference = lay_reference(at_target, 0.0, 0.0, start, 61, LIMITS, AROUND)
    np.testing.assert_allclose(reference.samples[:, :3], np.tile(START_M, (61, 1)), atol=1e-9)


# ------------------------------------------------------------------------ spline shape


@pytest.mark.parametrize("n_control", [7, 12, 15])
def test_sample_rows_are_the_trajectorys_own(n_control: int):
    control = np.random.default_rng(2).normal(size=(n_control, 3))
    trajectory = Trajectory(control, 0.0, 1.0)
    rows = sample_rows(n_control)
    times_s = np.linspace(0.0, trajectory.end_s, len(rows))
    np.testing.assert_allclose(rows @ control, trajectory.sample(times_s).position_m, atol=1e-12)


def test_the_fit_reproduces_what_is_a_spline_already():
    """A straight line at constant speed has no third difference: smoothing does not bend it."""
    shape = spline_shape(12)
    control = np.outer(np.arange(12.0), [1.0, 0.5, 0.0])
    path = sample_rows(12) @ control
    ends = np.vstack((control[:3], control[-3:]))
    free = shape.fit_path @ path + shape.layout[:, :6] @ ends
    np.testing.assert_allclose(free, control[3:-3], atol=1e-9)


def test_modes_are_orthogonal_in_jerk_the_smoothest_first_and_one_metre_at_most():
    shape = spline_shape(12)
    differences = np.diff(np.eye(12), n=3, axis=0)[:, 3:-3]
    gram = shape.modes.T @ differences.T @ differences @ shape.modes
    np.testing.assert_allclose(gram, np.eye(6) * gram[0, 0], atol=1e-9)
    heights = np.abs(shape.modes).max(axis=0)
    assert heights[0] == pytest.approx(1.0)
    assert np.all(np.diff(heights) < 0.0)


def test_fewer_than_seven_control_points_leave_nothing_to_plan():
    with pytest.raises(ValueError, match="at least 7 control points, got 6"):
        spline_shape(6)


def test_the_matrix_of_the_paper_is_used_for_the_rows():
    value, first, second = bspline.uniform_rows(np.array([0.0, 0.5]))
    np.testing.assert_array_equal(spline_shape(12).rows, np.stack((value, first, second)))
