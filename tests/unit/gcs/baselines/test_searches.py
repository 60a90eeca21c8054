"""Every compared algorithm plans missions in the shared frame, in both representations, and the judge agrees."""

import time

import msgspec
import numpy as np
import pytest

from gcs.planner.allocation import allocate
from gcs.planner.assembly import Candidate
from gcs.planner.baselines import COMPARED, BaselineSearch, Representation
from gcs.planner.baselines.absolute import Joint
from gcs.planner.baselines.offsets import OneVehicle
from gcs.planner.budget import new_budget
from gcs.planner.fleet_cost import all_control_points
from gcs.planner.limits import flight_box
from gcs.planner.problem import guides, pose
from missions.mission import Mission, load_mission

TERRAIN = load_mission("terrain-1-5uav")


def new_search(
    mission: Mission, algorithm: str, representation: Representation, evaluations: int | None, seed: int = 0
) -> BaselineSearch:
    budget = new_budget(evaluations, None, time.perf_counter, None)
    return BaselineSearch(mission, allocate(mission), seed, budget, lambda _: None, algorithm, representation)


def curves(candidate: Candidate) -> np.ndarray:
    return np.array([curve.curve_m for curve in candidate.curves])


@pytest.mark.parametrize("algorithm", COMPARED)
@pytest.mark.parametrize("mission", ["terrain-1-5uav", "indoor"])
def test_every_algorithm_plans_feasibly_with_offsets(algorithm: str, mission: str):
    found = new_search(load_mission(mission), algorithm, Representation.OFFSETS, 1500).run()
    assert found.violations == ()


@pytest.mark.parametrize("algorithm", COMPARED)
def test_every_algorithm_gets_better_from_a_random_start(algorithm: str):
    search = new_search(TERRAIN, algorithm, Representation.ABSOLUTE, 6000)
    search.run()
    costs = [progress.objective for progress in search.convergence]
    assert np.all(np.diff(costs) <= 0.0)
    assert costs[-1] < 0.95 * costs[0]


@pytest.mark.parametrize("representation", Representation)
@pytest.mark.parametrize("algorithm", COMPARED)
def test_no_algorithm_takes_more_evaluations_than_it_is_given(algorithm: str, representation: Representation):
    search = new_search(TERRAIN, algorithm, representation, 1000)
    search.run()
    assert 600 < search.evaluations <= 1000


@pytest.mark.parametrize("representation", Representation)
@pytest.mark.parametrize("algorithm", COMPARED)
def test_one_seed_makes_one_plan(algorithm: str, representation: Representation):
    one, same, other = (curves(new_search(TERRAIN, algorithm, representation, 700, seed).run()) for seed in (3, 3, 4))
    np.testing.assert_array_equal(one, same)
    assert not np.array_equal(one, other)


def test_without_a_limit_it_ends_with_a_feasible_plan():
    search = new_search(TERRAIN, "pso", Representation.OFFSETS, None)
    assert search.run().violations == ()
    assert search.evaluations <= 1500


def test_the_judge_has_the_last_word():
    search = new_search(TERRAIN, "pso", Representation.ABSOLUTE, 300)
    assert search.run().violations
    assert not search.convergence[-1].feasible


def test_a_position_of_the_papers_representation_is_the_coordinates_of_all_control_points():
    routes = allocate(TERRAIN)
    problem, box_m = pose(TERRAIN, routes, guides(TERRAIN, routes)), np.array(flight_box(TERRAIN))
    joint = Joint(problem, box_m)
    position = joint.space().fresh(np.random.default_rng(1), 2)
    controls_m = joint.controls(position)
    inner_m = box_m[0] + 0.5 * (position.reshape(2, 5, -1, 3) + 1.0) * (box_m[1] - box_m[0])
    np.testing.assert_allclose(controls_m[:, :, 1:-1], inner_m)
    np.testing.assert_array_equal(controls_m[1, :, 0], problem.base_m[:, 0])
    np.testing.assert_array_equal(controls_m[1, :, -1], problem.base_m[:, -1])


def test_both_representations_pass_the_targets_on_the_way():
    mission = msgspec.structs.replace(TERRAIN, vehicles=TERRAIN.vehicles[:2])  # two vehicles, five targets
    routes = allocate(mission)
    problem, box_m = pose(mission, routes, guides(mission, routes)), np.array(flight_box(mission))
    assert problem.pins.any()
    rng = np.random.default_rng(2)
    expected = all_control_points(problem, rng.normal(0.0, 0.02, (2, 2 * (problem.base_m.shape[1] - 2))))
    position = (expected[:, 1:-1] - box_m.mean(axis=0)) / (0.5 * (box_m[1] - box_m[0]))
    for vehicle, pins in enumerate(problem.pins):
        position[vehicle, pins[pins > 0] - 1] = 0.0  # of no account: these follow from their neighbours
    joint = Joint(problem, box_m)
    np.testing.assert_allclose(joint.controls(position.reshape(1, -1))[0], expected, atol=1e-6)


def test_nodes_of_the_lattices_are_where_their_positions_are():
    routes = allocate(TERRAIN)
    problem = pose(TERRAIN, routes, guides(TERRAIN, routes))
    joint = Joint(problem, np.array(flight_box(TERRAIN)))
    lattice = joint.space().lattice
    controls_m = joint.controls(lattice.values[:, :, 3, 7].reshape(1, -1))[0]
    np.testing.assert_allclose(controls_m[:, 1:-1], lattice.places_m[:, :, 3, 7], atol=1e-9)
    ours = OneVehicle(problem, 2).space().lattice
    offsets = np.zeros((5, ours.values.shape[1] * 2))
    offsets[2] = ours.values[0, :, 30, 12].ravel()
    np.testing.assert_allclose(all_control_points(problem, offsets)[2, 1:-1], ours.places_m[0, :, 30, 12], atol=1e-9)
