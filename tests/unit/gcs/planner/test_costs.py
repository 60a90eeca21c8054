"""The compiled costs are what numpy says they are, and their gradients are their derivatives."""

import msgspec
import numpy as np
import pytest
from scipy.interpolate import BSpline

from gcs.planner.allocation import allocate
from gcs.planner.fleet_cost import (
    Problem,
    all_control_points,
    fleet_cost,
    no_others,
    plan_costs,
    set_context,
    swarm_cost,
)
from gcs.planner.obstacle_gradient import clearances, heights
from gcs.planner.problem import guides, pose
from missions import bspline, obstacles
from missions.mission import Mission, load_mission
from tests.unit.gcs.planner import reference
from tests.unit.gcs.planner.worlds import everything, room, round_trip, wall

UNCAPPED = msgspec.structs.replace(load_mission("terrain-1-5uav").planner, clearance_cap_m=None, height_cap_m=None)

NARROW = msgspec.structs.replace(load_mission("terrain-1-5uav").limits, turn_radius_m=900.0, climb_angle_deg=6.0)

LAUNCH = load_mission("terrain-1-5uav")
BULKY = msgspec.structs.replace(
    LAUNCH, limits=msgspec.structs.replace(LAUNCH.limits, body_radius_m=6.0), takeoff_height_m=40.0
)
"""Five vehicles from one launch point that touch on the way from their pads to their curves."""

MISSIONS = {
    "every kind of obstacle": everything(),
    "no caps": everything(planner=UNCAPPED),
    "time slack and a tight gap": room(wall(10.0, (6.5, 8.0))),
    "wide turns and gentle climbs": everything(limits=NARROW),
    "from pads around a launch point": BULKY,
    "one vehicle": load_mission("field"),
    "targets on the way": round_trip(),
    "routes of unequal length": msgspec.structs.replace(
        everything(), allocation={"alpha": ("target-3", "target-1"), "bravo": ("target-2",), "charlie": ()}
    ),
}


def posed(mission: Mission) -> Problem:
    routes = allocate(mission)
    return pose(mission, routes, guides(mission, routes))


def some_offsets(problem: Problem, seed: int, size: float = 0.1) -> np.ndarray:
    n_vehicles, n_control = problem.base_m.shape[:2]
    return np.random.default_rng(seed).normal(0.0, size, (n_vehicles, 2 * (n_control - 2)))


@pytest.fixture(params=MISSIONS.values(), ids=MISSIONS.keys())
def problem(request: pytest.FixtureRequest) -> Problem:
    return posed(request.param)


def points_in(mission: Mission, count: int) -> np.ndarray:
    bounds = mission.world.bounds
    return np.random.default_rng(3).uniform(bounds.low_enu_m, bounds.high_enu_m, (count, 3))


@pytest.mark.parametrize("cap_m", [1e6, 60.0])
def test_clearance_with_gradient_is_the_clearance_of_the_missions_package(cap_m: float):
    mission = everything()
    solid, points = obstacles.pack(mission.world), points_in(mission, 4000)
    found = np.empty((len(points), 4))
    clearances(points, solid, cap_m, found)
    np.testing.assert_allclose(found[:, 0], np.minimum(obstacles.clearance(points, solid), cap_m), atol=1e-6)


def test_the_gradient_of_clearance_is_its_derivative():
    mission = everything()
    solid, points, step = obstacles.pack(mission.world), points_in(mission, 4000), 1e-4
    found = np.empty((len(points), 4))
    clearances(points, solid, 1e6, found)
    for axis in range(3):
        moved = np.eye(3)[axis] * step
        ahead, behind = obstacles.clearance(points + moved, solid), obstacles.clearance(points - moved, solid)
        difference = (ahead - behind) / (2.0 * step)
        smooth = np.abs(ahead + behind - 2.0 * found[:, 0]) < step**2  # away from where the nearest thing changes
        assert smooth.mean() > 0.99
        np.testing.assert_allclose(found[smooth, 1 + axis], difference[smooth], atol=1e-5)


def test_heights_are_those_above_the_sum_of_all_peaks():
    mission = everything()
    solid, points, step = obstacles.pack(mission.world), points_in(mission, 500), 1e-3
    found, ahead = np.empty((len(points), 4)), np.empty((len(points), 4))
    heights(points, solid, found)
    np.testing.assert_allclose(found[:, 0], points[:, 2] - obstacles.terrain_height(points, solid), atol=1e-9)
    for axis in range(3):
        heights(points + np.eye(3)[axis] * step, solid, ahead)
        np.testing.assert_allclose((ahead[:, 0] - found[:, 0]) / step, found[:, 1 + axis], atol=1e-3)


@pytest.mark.parametrize("seed", range(3))
def test_the_cost_of_a_fleet_equals_its_numpy_reference(problem: Problem, seed: int):
    offsets = some_offsets(problem, seed)
    expected = reference.fleet_cost(problem, offsets)
    np.testing.assert_allclose(fleet_cost(problem, offsets, np.empty_like(offsets)), expected, rtol=1e-6)


def test_whatever_the_offsets_curves_pass_their_targets_on_the_way_at_a_knot():
    mission = round_trip()
    problem = posed(mission)
    controls_m = all_control_points(problem, some_offsets(problem, 4, 0.3))
    for control_m, route in zip(controls_m, allocate(mission), strict=True):
        spline = BSpline(bspline.clamped_knots(len(control_m)), control_m, 3)
        off_m = np.linalg.norm(spline(np.unique(spline.t)) - route.places_m[1], axis=1)
        assert off_m.min() < 1e-9


@pytest.mark.parametrize("seed", range(3))
def test_the_gradient_of_a_fleet_is_its_derivative(problem: Problem, seed: int):
    offsets, step = some_offsets(problem, seed), 1e-6
    gradient, unused, weight = np.empty_like(offsets), np.empty_like(offsets), problem.terms.penalty_weight
    fleet_cost(problem, offsets, gradient)
    differences = np.empty_like(offsets)
    for index in np.ndindex(*offsets.shape):
        moved = np.zeros_like(offsets)
        moved[index] = step
        ahead, behind = fleet_cost(problem, offsets + moved, unused), fleet_cost(problem, offsets - moved, unused)
        differences[index] = (ahead[0] - behind[0] + weight * (ahead[1] - behind[1])) / (2.0 * step)
    np.testing.assert_allclose(gradient, differences, atol=1e-4 * np.abs(differences).max())


def test_a_particle_costs_what_the_plan_changes_by_when_its_vehicle_flies_it(problem: Problem):
    """A swarm compares particles of one vehicle: differences of their costs are differences of the plan's cost."""
    offsets, n_vehicles = some_offsets(problem, 5, 0.05), len(problem.base_m)
    context = no_others(n_vehicles, len(problem.coupling.first))
    for _ in range(2):
        for vehicle in range(n_vehicles):
            set_context(problem, vehicle, offsets[vehicle], context)
    particles = some_offsets(problem, 6, 0.05)[:1].repeat(4, axis=0) * np.linspace(-1.0, 1.0, 4)[:, None]
    objective, violation = np.empty(4), np.empty(4)
    swarm_cost(problem, 0, particles, context, objective, violation)
    plans = [np.concatenate((particle[None], offsets[1:])) for particle in particles]
    whole = np.array([fleet_cost(problem, plan, np.empty_like(plan)) for plan in plans])
    np.testing.assert_allclose(np.diff(objective), np.diff(whole[:, 0]), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(np.diff(violation), np.diff(whole[:, 1]), rtol=1e-6, atol=1e-9)


def test_many_plans_at_once_cost_what_each_costs(problem: Problem):
    plans = [some_offsets(problem, seed) for seed in range(4)]
    controls = np.array([all_control_points(problem, offsets) for offsets in plans])
    objective, violation = np.empty(len(plans)), np.empty(len(plans))
    plan_costs(problem, controls, objective, violation)
    expected = [fleet_cost(problem, offsets, np.empty_like(offsets)) for offsets in plans]
    np.testing.assert_allclose(np.stack((objective, violation), axis=1), expected, rtol=1e-12)
