"""Neighbours and movers in time: where they will be, how far off one has to be, and that plans keep it."""

import numpy as np
import pytest

from companion.fleet.neighbour import Neighbour
from companion.mapping.movers import Mover
from companion.planner.planner import PlanRequest
from companion.planner.traffic import PARTING_AFTER_S, PARTING_M_S, body_distance, crowding, mover_clearance, traffic
from companion.sensing.scan import Scan
from missions.mission import Mission
from missions.mission_items import Track
from missions.trajectory import Motion, Trajectory, at_rest
from missions.tunnel import TrajectoryKind
from tests.unit.companion.planner.problems import INDOOR, TERRAIN, make_planner

LIMITS = INDOOR.limits
START_M, GOAL_M = np.array([2.0, 3.0, 1.5]), np.array([9.0, 3.0, 1.5])


def neighbour(trajectory: Trajectory, radius_m: float = 0.2) -> Neighbour:
    return Neighbour(2, trajectory, radius_m, TrajectoryKind.COMMITTED, 0.0)


def line(from_m, to_m, duration_s: float, start_s: float = 0.0) -> Trajectory:
    inner = np.linspace(from_m, to_m, 6)
    control = np.vstack((np.tile(from_m, (3, 1)), inner[1:-1], np.tile(to_m, (3, 1)))).astype(float)
    return Trajectory(control, start_s, duration_s / (len(control) - 3))


def test_a_neighbour_is_where_its_trajectory_says():
    path = line([5.0, 1.0, 1.5], [5.0, 6.0, 1.5], 4.0, start_s=10.0)
    moving = traffic((), (neighbour(path),), LIMITS, 11.0, 6.0, START_M)
    for after_s in np.linspace(0.0, 6.0, 31):
        expected_m = np.linalg.norm(path.at(11.0 + after_s).position_m - START_M)
        assert body_distance(*START_M, after_s, 0, moving) == pytest.approx(expected_m, abs=0.01)


def test_a_mover_goes_straight_on_and_grows():
    moving = traffic(
        (Mover(0.0, np.array([5.0, 3.0, 1.5]), np.array([0.0, 1.0, 0.0]), 0.3),), (), LIMITS, 1.0, 6.0, START_M
    )
    assert mover_clearance(5.0, 2.0, 1.5, 0.0, moving) == pytest.approx(2.0 - 0.3)
    assert mover_clearance(5.0, 2.0, 1.5, 1.0, moving) == pytest.approx(3.0 - 0.3 - 0.1, abs=0.01)


def test_separation_grows_with_what_is_uncertain_and_touching_counts_in_launch_zones():
    beside = at_rest(np.array([3.0, 3.0, 1.5]), 0.0)
    certain = traffic((), (neighbour(beside),), LIMITS, 0.0, 5.0, np.array([9.0, 9.0, 1.0]))
    vague = traffic((), (neighbour(beside, 0.7),), LIMITS, 0.0, 5.0, np.array([9.0, 9.0, 1.0]))
    assert crowding(2.4, 3.0, 1.5, 1.0, False, certain) == pytest.approx(LIMITS.separation_m - 0.6)
    assert crowding(2.4, 3.0, 1.5, 1.0, False, vague) == pytest.approx(LIMITS.separation_m + 0.5 - 0.6)
    assert crowding(2.4, 3.0, 1.5, 1.0, True, certain) == 0.0


def test_who_is_too_near_may_set_out_at_its_own_pace_but_comes_no_nearer_and_leaves():
    beside = at_rest(np.array([3.0, 3.0, 1.5]), 0.0)
    too_near = traffic((), (neighbour(beside),), LIMITS, 0.0, 5.0, np.array([2.5, 3.0, 1.5]))
    assert crowding(2.5, 3.0, 1.5, PARTING_AFTER_S, False, too_near) == 0.0
    assert crowding(2.6, 3.0, 1.5, 0.5, False, too_near) == pytest.approx(0.1)
    assert crowding(2.5, 3.0, 1.5, PARTING_AFTER_S + 1.0, False, too_near) == pytest.approx(PARTING_M_S)


def test_a_vehicle_finds_out_of_a_neighbours_circle_from_rest():
    planner = make_planner()
    guide = planner.lay_guide(Track(GOAL_M[None], np.array([3.0])), 0, START_M)
    silent = neighbour(at_rest(START_M + [-0.6, 0.2, 0.0], 0.0), 0.95)
    resting = Motion(START_M, np.zeros(3), np.zeros(3))
    assert planner.plan(PlanRequest(0, resting, 0.0, guide, 0.0, neighbours=(silent,))).trajectory is not None


def test_a_plan_keeps_its_distance_from_a_neighbour_that_crosses_at_the_same_time():
    planner = make_planner()
    guide = planner.lay_guide(Track(GOAL_M[None], np.array([3.0])), 0, START_M)
    resting = Motion(START_M, np.zeros(3), np.zeros(3))
    alone = planner.plan(PlanRequest(0, resting, 0.0, guide, 0.0)).trajectory
    assert alone is not None
    middle_s = alone.start_s + 0.5 * alone.duration_s
    meets = line(
        alone.at(middle_s).position_m - [0.0, 2.0, 0.0], alone.at(middle_s).position_m + [0.0, 2.0, 0.0], 2.0 * middle_s
    )
    other = neighbour(meets)
    assert not planner.is_clear(alone, 0.0, (other,))
    plan = planner.plan(PlanRequest(1, resting, 0.0, guide, 0.0, neighbours=(other,))).trajectory
    assert plan is not None
    assert planner.is_clear(plan, 0.0, (other,))
    times_s = plan.grid(0.02)
    apart_m = np.linalg.norm(plan.sample(times_s).position_m - meets.sample(times_s).position_m, axis=1)
    assert apart_m.min() >= LIMITS.separation_m - 0.02


@pytest.mark.parametrize(("mission", "off_m"), [(INDOOR, 0.2), (TERRAIN, 2.0)], ids=["indoor", "outdoor"])
def test_a_neighbour_seen_beside_where_it_says_it_is_is_not_an_obstacle(mission: Mission, off_m: float):
    """Both estimates are wrong by what their positioning is worth; what stands farther off is mapped all the same."""
    planner, eye_m = make_planner(mission), mission.start_m(mission.vehicles[0])
    up_m = np.array([0.0, 0.0, 10.0 if mission is TERRAIN else 0.0])
    away_m = 8.0 * mission.onboard.voxel_m
    said_m = eye_m + up_m + np.array([3.0 * away_m, 0.0, 0.0])
    other = neighbour(at_rest(said_m, 0.0), mission.limits.body_radius_m)
    seen_m, standing_m = said_m + np.array([0.0, off_m, 0.0]), said_m + np.array([0.0, off_m + away_m, 0.0])
    for number in range(4):
        points_m = np.array([seen_m, standing_m])
        planner.observe(Scan(0.1 * number, eye_m + up_m, points_m, mission.sensor.range_m), (other,))
    mapped_m, _, _ = planner.certain()
    assert len(mapped_m) == 1
    assert np.linalg.norm(mapped_m[0] - standing_m) < 2.0 * mission.onboard.voxel_m
