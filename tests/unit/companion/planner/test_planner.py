"""What the onboard planner promises: clear, within limits, from exactly the given state, to rest; and how it brakes."""

import msgspec
import numpy as np
import pytest

from companion.planner.planner import Plan, Planner, PlanRequest
from companion.settings import SearchSettings
from missions import obstacles
from missions.mission import Mission
from missions.mission_items import Track
from missions.trajectory import Motion, Trajectory, at_rest
from missions.world import World
from tests.unit.companion.planner.problems import AROUND_THE_CRATE_M, INDOOR, TERRAIN, make_planner

TRACK = Track(AROUND_THE_CRATE_M[1:], np.full(7, 3.0), tuple(range(1, 8)))
PLANNER = make_planner()


def standing(place_m: np.ndarray) -> Motion:
    return Motion(np.asarray(place_m, dtype=float), np.zeros(3), np.zeros(3))


def random_state(rng: np.random.Generator) -> tuple[Motion, float]:
    """A state that a vehicle on the track may well be in, and how far along the track that is."""
    guide = PLANNER.lay_guide(TRACK, 0, AROUND_THE_CRATE_M[0])
    arc_m = rng.uniform(0.0, guide.length_m - 1.0)
    here, ahead = guide.point(arc_m), guide.point(arc_m + 0.2)
    free_m = obstacles.clearance(here[None], PLANNER.around.obstacles)[0]
    fastest = 0.85 if free_m < 1.3 else min(2.3, 0.85 + 1.2 * (free_m - 1.3))
    to_go_m = guide.length_m - arc_m
    speed = rng.uniform(0.0, min(fastest, np.sqrt(1.2 * to_go_m)))
    velocity = speed * (ahead - here) / np.linalg.norm(ahead - here)
    return Motion(here + rng.normal(0.0, 0.03, 3), velocity, rng.normal(0.0, 0.15, 3)), arc_m


def request(start: Motion, arc_m: float = 0.0, planner: Planner = PLANNER, track: Track = TRACK, **more) -> PlanRequest:
    guide = planner.lay_guide(track, 0, AROUND_THE_CRATE_M[0] if track is TRACK else start.position_m)
    return PlanRequest(1, start, 50.0, guide, arc_m, **more)


def assert_keeps_its_promises(plan: Plan, mission: Mission = INDOOR, planner: Planner = PLANNER) -> None:
    """Everything that a trajectory must keep, checked densely and without the planner's own code."""
    trajectory, start, kept = plan.trajectory, plan.request.start, mission.limits
    assert trajectory is not None
    times_s = trajectory.grid(0.02)
    motion = trajectory.sample(times_s)
    for part, given in zip(trajectory.at(plan.request.start_s), start, strict=True):
        np.testing.assert_allclose(part, given, atol=1e-9)
    end = trajectory.at(trajectory.end_s)
    np.testing.assert_allclose([end.velocity_m_s, end.acceleration_m_s2], 0.0, atol=1e-9)
    free_m = obstacles.clearance(motion.position_m, planner.around.obstacles)
    assert free_m.min() >= min(kept.clearance_m, free_m[0], free_m[-1]) - 1e-6
    speed = np.linalg.norm(motion.velocity_m_s, axis=1)
    assert speed.max() <= kept.cruise_speed_m_s
    near = free_m < kept.avoidance_distance_m
    assert speed[near].max(initial=0.0) <= max(kept.avoidance_speed_m_s, speed[0]) + 0.05
    acceleration = np.linalg.norm(motion.acceleration_m_s2, axis=1)
    assert acceleration.max() <= 1.08 * max(kept.acceleration_m_s2, acceleration[0])
    bounds = mission.world.bounds
    assert np.all(motion.position_m >= bounds.low_enu_m - 1e-6)
    assert np.all(motion.position_m <= bounds.high_enu_m + 1e-6)
    assert motion.position_m[:, 2].min() >= min(kept.height_m, start.position_m[2]) - 1e-6


@pytest.mark.parametrize("seed", range(40))
def test_from_anywhere_along_the_track_it_plans_a_trajectory_that_keeps_its_promises(seed: int):
    rng = np.random.default_rng(seed)
    start, arc_m = random_state(rng)
    plan = make_planner(seed=seed).plan(request(start, arc_m))
    assert_keeps_its_promises(plan)


@pytest.mark.parametrize("turn_deg", [60.0, 90.0, 135.0])
@pytest.mark.parametrize("speed_m_s", [0.9, 1.6, 2.5])
def test_at_speed_it_turns_to_a_track_that_leads_elsewhere(speed_m_s: float, turn_deg: float):
    turn_rad = np.radians(turn_deg)
    empty = msgspec.structs.replace(INDOOR, world=World(bounds=INDOOR.world.bounds))
    start = Motion(np.array([8.0, 11.5, 1.5]), np.array([speed_m_s, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]))
    to_m = start.position_m + 5.0 * np.array([np.cos(turn_rad), -np.sin(turn_rad), 0.0])
    elsewhere = Track(to_m[None], np.array([3.0]))
    for seed in range(5):
        planner = make_planner(empty, seed=seed)
        plan = planner.plan(PlanRequest(1, start, 50.0, planner.join_track(elsewhere, 0, start), 0.0))
        assert_keeps_its_promises(plan, empty, planner)


def test_who_runs_out_into_something_turns_at_once_instead():
    start = Motion(np.array([1.0, 2.0, 1.5]), np.array([-2.0, 0.0, 0.0]), np.zeros(3))
    guide = PLANNER.join_track(Track(np.array([[1.0, 9.0, 1.5]]), np.array([3.0])), 0, start)
    assert guide.way.points_m[:, 0].min() == pytest.approx(1.0)


def test_it_stays_near_the_track():
    plan = PLANNER.plan(request(standing(AROUND_THE_CRATE_M[0])))
    guide = plan.guide
    for point_m in plan.trajectory.sample(plan.trajectory.grid(0.1)).position_m:
        nearest_m = guide.point(guide.project(point_m, 0.0, guide.length_m))
        assert np.linalg.norm(point_m - nearest_m) < 0.45


def test_it_aims_at_the_leg_speed_and_never_exceeds_it():
    slow = Track(TRACK.points_m, np.full(7, 1.5))
    planner = make_planner()
    plan = planner.plan(
        PlanRequest(1, standing(AROUND_THE_CRATE_M[0]), 0.0, planner.lay_guide(slow, 0, AROUND_THE_CRATE_M[0]), 0.0)
    )
    speed = np.linalg.norm(plan.trajectory.sample(plan.trajectory.grid(0.02)).velocity_m_s, axis=1)
    assert 1.35 < speed.max() <= 1.5 / 0.92


def test_a_target_behind_obstacles_is_planned_for_around_them():
    direct = Track(AROUND_THE_CRATE_M[-1:], np.array([np.nan]))
    plan = PLANNER.plan(request(standing(AROUND_THE_CRATE_M[0]), track=direct))
    assert_keeps_its_promises(plan)
    assert plan.guide.length_m > np.linalg.norm(AROUND_THE_CRATE_M[-1] - AROUND_THE_CRATE_M[0]) + 0.5


def test_near_the_target_the_plan_ends_in_it():
    guide = PLANNER.lay_guide(TRACK, 0, AROUND_THE_CRATE_M[0])
    arc_m = guide.length_m - 3.0
    plan = PLANNER.plan(request(standing(guide.point(arc_m)), arc_m))
    assert plan.reaches_end
    np.testing.assert_allclose(plan.trajectory.end_m, AROUND_THE_CRATE_M[-1], atol=1e-9)


def test_who_stands_too_near_to_a_wall_may_leave():
    beside_the_crate = np.array([6.0, 5.4, 1.5])  # 0.27 m from it; 0.6 m are required
    track = Track(np.array([[3.0, 4.0, 1.5], [2.0, 3.0, 1.5]]), np.full(2, 3.0))
    plan = PLANNER.plan(request(standing(beside_the_crate), track=track))
    assert_keeps_its_promises(plan)
    assert obstacles.clearance(plan.trajectory.end_m[None], PLANNER.around.obstacles)[0] > 0.6


def test_inside_of_something_there_is_no_path():
    track = Track(np.array([[7.0, 7.0, 1.5]]), np.array([3.0]))
    plan = PLANNER.plan(request(standing([4.0, 7.0, 1.5]), track=track))
    assert (
        plan.trajectory is None or obstacles.clearance(plan.trajectory.end_m[None], PLANNER.around.obstacles)[0] > 0.6
    )
    near = PlanRequest(2, standing([5.5, 7.0, 1.5]), 0.0, plan.guide, 1.5)
    assert PLANNER.plan(near).trajectory is None


def test_a_replan_follows_the_committed_trajectory_closely():
    first = PLANNER.plan(request(standing(AROUND_THE_CRATE_M[0]))).trajectory
    later_s = first.start_s + 1.0
    guide = PLANNER.lay_guide(TRACK, 0, AROUND_THE_CRATE_M[0])
    arc_m = guide.project(first.at(later_s).position_m, 0.0, 5.0)
    again = PLANNER.plan(PlanRequest(2, first.at(later_s), later_s, guide, arc_m, first)).trajectory
    for ahead_s in (0.2, 0.5, 0.8):
        apart_m = again.at(later_s + ahead_s).position_m - first.at(later_s + ahead_s).position_m
        assert np.linalg.norm(apart_m) < 0.2


def test_one_seed_is_one_plan():
    plans = [make_planner(seed=5).plan(request(standing(AROUND_THE_CRATE_M[0]))) for _ in range(2)]
    np.testing.assert_array_equal(plans[0].trajectory.control_points_m, plans[1].trajectory.control_points_m)


@pytest.mark.parametrize(
    "search",
    [
        SearchSettings(weighted_dominance=False),
        SearchSettings(adaptive_leader=False),
        SearchSettings(tabu_neighbours=0),
        SearchSettings(control_points=15),
        SearchSettings(iterations=0, tabu_neighbours=0),
    ],
)
def test_every_part_of_the_method_can_be_switched_off(search: SearchSettings):
    planner = make_planner(search=search)
    assert_keeps_its_promises(planner.plan(request(standing(AROUND_THE_CRATE_M[0]), planner=planner)), planner=planner)


def test_a_kilometre_of_mountains_is_planned_with_the_same_code():
    planner = make_planner(TERRAIN)
    start_m = np.array([0.0, 0.0, 10.0])
    track = Track(np.array([[300.0, 200.0, 150.0], [2000.0, 1200.0, 900.0]]), np.full(2, 3.0))
    plan = planner.plan(PlanRequest(1, standing(start_m), 0.0, planner.lay_guide(track, 0, start_m), 0.0))
    assert_keeps_its_promises(plan, TERRAIN, planner)
    assert np.linalg.norm(plan.trajectory.end_m - start_m) > 60.0


# ------------------------------------------------------------------- safety and braking


def test_the_rest_of_a_trajectory_is_checked_not_what_was_flown():
    past_the_crate = np.array([[4, 7, 1.5], [5, 7, 1.5], [6, 7, 1.5], [8.6, 7, 1.5], [9.5, 7, 1.5], [10.5, 7, 1.5]])
    control = np.vstack((past_the_crate, np.tile(past_the_crate[-1], (2, 1))))
    trajectory = Trajectory(control, 0.0, 1.0)
    assert not PLANNER.is_clear(trajectory, 0.0)
    assert PLANNER.is_clear(trajectory, 4.2)
    assert PLANNER.is_clear(at_rest(np.array([1.0, 6.5, 1.5]), 0.0), 99.0)


def test_the_check_asks_for_what_the_mission_requires_without_the_reserve():
    for off_m, clear in ((0.58, False), (0.62, True)):
        beside = np.array([[3.0, 5.5 - off_m, 1.5], [11.0, 5.5 - off_m, 1.5]])
        control = np.vstack((np.tile(beside[0], (3, 1)), np.linspace(*beside, 8), np.tile(beside[1], (3, 1))))
        assert PLANNER.is_clear(Trajectory(control, 0.0, 1.0), 0.0) == clear


@pytest.mark.parametrize(("speed_m_s", "too_fast"), [(0.9, False), (2.0, True)])
def test_the_check_notices_who_passes_something_too_fast_but_gives_the_time_to_brake(speed_m_s: float, too_fast: bool):
    beside_the_crate = np.linspace([1.0, 4.7, 1.5], [13.0, 4.7, 1.5], 25)
    control = np.vstack((beside_the_crate, np.tile(beside_the_crate[-1], (2, 1))))
    trajectory = Trajectory(control, 0.0, 0.5 / speed_m_s)
    nears_s = 4.5 / speed_m_s
    for from_s, judged in ((0.0, too_fast), (nears_s + 0.5, too_fast), (trajectory.end_s - 0.1, False)):
        outlook = PLANNER.outlook(trajectory, from_s)
        assert outlook.lacks_s == np.inf
        assert (outlook.too_fast_s < np.inf) == judged
    braking = PLANNER.brake(trajectory, nears_s + 0.5)
    assert PLANNER.outlook(braking, braking.start_s + 0.4 * braking.duration_s).too_fast_s == np.inf


@pytest.mark.parametrize(("off_m", "is_danger"), [(0.1, True), (0.17, True), (0.3, False)])
def test_who_flies_to_a_goal_beside_which_something_was_found_meanwhile_brakes_before_it_touches_that(
    off_m: float, is_danger: bool
):
    goal_m = np.array([7.0, 5.5 - off_m, 1.5])
    control = np.vstack((np.linspace([7.0, 2.5, 1.5], goal_m, 8), np.tile(goal_m, (2, 1))))
    trajectory = Trajectory(control, 0.0, 1.0)
    outlook = PLANNER.outlook(trajectory, 0.0)
    assert (outlook.lacks_s < trajectory.end_s) == is_danger
    assert (outlook.dangerous_s < trajectory.end_s) == is_danger


@pytest.mark.parametrize("seed", range(12))
def test_braking_stays_on_the_path_and_stops_within_the_limits(seed: int):
    rng = np.random.default_rng(seed)
    start, arc_m = random_state(rng)
    trajectory = PLANNER.plan(request(start, arc_m)).trajectory
    now_s = trajectory.start_s + rng.uniform(0.0, 0.8) * trajectory.duration_s
    braking = PLANNER.brake(trajectory, now_s)
    before, after = trajectory.at(now_s), braking.at(now_s)
    for part, expected in zip(after, before, strict=True):
        np.testing.assert_allclose(part, expected, atol=1e-9)
    path = trajectory.sample(trajectory.grid(0.005, now_s)).position_m
    flown = braking.sample(braking.grid(0.02))
    off_path_m = [np.linalg.norm(path - point, axis=1).min() for point in flown.position_m]
    assert max(off_path_m) < 0.05
    speed = np.linalg.norm(flown.velocity_m_s, axis=1)
    assert speed.max() <= max(np.linalg.norm(before.velocity_m_s) * 1.1, 0.15)
    assert braking.duration_s <= max(np.pi * speed[0] / 4.0, 0.4) + 1e-9
    assert speed[-1] == pytest.approx(0.0, abs=1e-9)
