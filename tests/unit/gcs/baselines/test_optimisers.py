"""The compared algorithms find what there is to be found, and do what their sources say."""

import numpy as np
import pytest

from gcs.planner.baselines.algorithms import COMPARED
from gcs.planner.baselines.ant_colony import HEURISTIC_WEIGHT, TINY_M, WINDOW, AntColony, Nodes, choose
from gcs.planner.baselines.brain_storm import clustered
from gcs.planner.baselines.gapso import Gapso
from gcs.planner.baselines.ipso import Ipso
from gcs.planner.baselines.optimiser import Lattice, Optimiser, SearchSpace
from gcs.planner.baselines.pso import Pso
from tests.unit.gcs.baselines.spaces import NODES, OPTIMUM, ackley, plane

ITERATIONS = 200
CONTINUOUS = [name for name in COMPARED if name != "aca"]


def run(optimiser: Optimiser, iterations: int = ITERATIONS) -> Optimiser:
    for iteration in range(iterations):
        optimiser.tell(ackley(optimiser.ask(iteration / iterations)))
    return optimiser


def new(name: str, seed: int = 1, population: int = 30) -> Optimiser:
    return COMPARED[name](plane(), population, np.random.default_rng(seed))


@pytest.mark.parametrize("name", CONTINUOUS)
def test_it_finds_the_minimum_of_the_ackley_function(name: str):
    position, cost = run(new(name)).best()
    assert cost < 0.1
    np.testing.assert_allclose(position, OPTIMUM, atol=0.001)


def test_ants_that_start_in_a_corner_go_to_the_best_node_they_can_reach():
    colony = run(AntColony(plane(), 30, np.random.default_rng(1)))
    position, cost = colony.best()
    steps = np.linspace(-1.0, 1.0, NODES)[: WINDOW + 1]
    reachable = np.array([[x, y] for x in steps for y in steps])
    assert cost == pytest.approx(ackley(reachable).min())
    assert ackley(position[None])[0] == pytest.approx(cost)


@pytest.mark.parametrize("name", COMPARED)
def test_one_seed_makes_one_search(name: str):
    first, again, other = (run(new(name, seed), 2).ask(0.1).copy() for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


@pytest.mark.parametrize("name", COMPARED)
def test_positions_stay_in_range(name: str):
    optimiser = new(name)
    for iteration in range(50):
        asked = optimiser.ask(iteration / 50)
        assert np.abs(asked).max() <= 1.0
        optimiser.tell(asked.sum(axis=1))  # drives everything into a corner


@pytest.mark.parametrize("name", COMPARED)
def test_the_best_never_gets_worse(name: str):
    optimiser, best = new(name), np.inf
    for iteration in range(30):
        costs = ackley(optimiser.ask(iteration / 30))
        optimiser.tell(costs)
        best = min(best, costs.min())
        assert optimiser.best()[1] == best


@pytest.mark.parametrize("name", COMPARED)
def test_memories_are_valued_anew_when_costs_have_changed(name: str):
    optimiser = run(new(name), 10)
    changed = np.abs(optimiser.memory).sum(axis=1)
    optimiser.remember(changed)
    position, cost = optimiser.best()
    assert cost == changed.min()
    np.testing.assert_array_equal(position, optimiser.memory[np.argmin(changed)])


def test_the_swarm_flies_by_equations_7_and_8():
    swarm = Pso(plane(), 5, np.random.default_rng(3))
    dice = np.random.default_rng(3)
    position, velocity = dice.uniform(-1.0, 1.0, (5, 2)), dice.uniform(-0.04, 0.04, (5, 2))
    np.testing.assert_array_equal(swarm.ask(0.0), position)
    swarm.tell(ackley(position))
    best = position[np.argmin(ackley(position))]
    dice.random((5, 2))  # towards the own best, which is where each particle is
    velocity = 0.6 * velocity + 2.0 * dice.random((5, 2)) * (best - position)
    expected = position + np.clip(velocity, -0.04, 0.04)
    np.testing.assert_allclose(swarm.ask(0.5), np.clip(expected, -1.0, 1.0), rtol=1e-12)


def test_ipso_explores_first_and_exploits_later():
    swarm = Ipso(plane(), 5, np.random.default_rng(3))
    first, middle, last = (swarm.pull(share) for share in (0.0, 0.5, 1.0))
    assert (first.inertia, first.own_learning, first.social_learning) == (0.9, 3.5, 0.5)
    assert (middle.inertia, middle.own_learning, middle.social_learning) == pytest.approx((0.65, 2.0, 2.0))
    assert (last.inertia, last.own_learning, last.social_learning) == pytest.approx((0.4, 0.5, 3.5))


class NeverMutates(Gapso):
    def _mutate(self) -> None:
        """Leave positions as breeding has left them."""


def test_children_lie_between_their_parents_and_keep_their_sum():
    swarm, plain = (kind(plane(), 100, np.random.default_rng(4)) for kind in (NeverMutates, Pso))
    for each in (swarm, plain):
        each.tell(ackley(each.ask(0.0)))
    bred, flown = swarm.ask(0.5), plain.ask(0.5)  # breeding begins after the same flight
    changed = np.any(bred != flown, axis=1)
    assert 10 < changed.sum() < 60  # three in ten are bred
    np.testing.assert_allclose(bred.sum(axis=0), flown.sum(axis=0), rtol=1e-12)
    assert np.all(bred.min(axis=0) >= flown.min(axis=0))
    assert np.all(bred.max(axis=0) <= flown.max(axis=0))


def test_a_mutation_changes_one_dimension_of_one_particle_in_ten():
    swarm = Gapso(plane(), 1000, np.random.default_rng(4))
    before = swarm.position.copy()
    swarm._mutate()
    changed = swarm.position != before
    assert np.all(changed.sum(axis=1) <= 1)
    assert 60 < changed.sum() < 140


def test_clusters_are_what_lies_together():
    rng = np.random.default_rng(5)
    heaps = np.concatenate([rng.normal(centre, 0.01, (20, 3)) for centre in (-0.5, 0.5)])
    labels = clustered(heaps, 2, rng)
    assert set(labels[:20]).isdisjoint(labels[20:])
    assert sorted(set(labels)) == list(range(len(set(labels))))


def chosen_by_numpy(nodes: Nodes, before: np.ndarray, place: np.ndarray, shortest_m: float, dice: float) -> np.ndarray:
    """The rule of transition for one ant, written out."""
    steps = np.arange(-WINDOW, WINDOW + 1)
    moves = np.array([(i, j) for i in steps for j in steps])
    offered = before + moves
    exists = np.all((offered >= 0) & (offered < len(nodes.ahead_m)), axis=1)
    offered = offered[exists]
    i, j = offered.T
    way_m = np.linalg.norm(nodes.places_m[i, j] - place, axis=1) + nodes.ahead_m[i, j]
    attraction = nodes.trail[i, j] * ((shortest_m + TINY_M) / (way_m + TINY_M)) ** HEURISTIC_WEIGHT
    shares = np.cumsum(attraction) / attraction.sum()
    return offered[np.searchsorted(shares, dice, "right")]


def test_the_compiled_choice_of_nodes_equals_its_numpy_reference():
    rng, side, target = np.random.default_rng(6), 9, np.array([10.0, 3.0, 2.0])
    places = rng.uniform(0.0, 8.0, (side, side, 3))
    nodes = Nodes(places, np.linalg.norm(places - target, axis=-1), rng.uniform(0.01, 3.0, (side, side)))
    before, place = rng.integers(0, side, (200, 2)), rng.uniform(0.0, 8.0, (200, 3))
    shortest_m, dice = np.linalg.norm(place - target, axis=1), rng.random(200)
    chosen = np.empty_like(before)
    choose(nodes, before, place, shortest_m, dice, chosen)
    expected = [chosen_by_numpy(nodes, *ant) for ant in zip(before, place, shortest_m, dice, strict=True)]
    np.testing.assert_array_equal(chosen, expected)


def test_ants_go_straight_without_pheromone_and_where_pheromone_is_with_it():
    steps = np.linspace(-1.0, 1.0, 5)
    values = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1)[None, None]
    places = np.concatenate((np.full((1, 1, 5, 5, 1), 5.0), 5.0 * values), axis=-1)
    lattice = Lattice(np.zeros((1, 3)), np.array([[10.0, 0.0, 0.0]]), places, values)
    colony = AntColony(
        SearchSpace(np.empty((0, 2)), lambda _, n: np.empty((n, 2)), lattice), 200, np.random.default_rng(7)
    )
    first = colony.ask(0.0)
    straight, sideways = (np.mean(np.all(first == place, axis=1)) for place in ([0.0, 0.0], [1.0, 1.0]))
    assert straight > 2.0 * sideways
    for _ in range(30):
        positions = colony.ask(0.0)
        colony.tell(np.abs(positions - np.array([0.5, 0.0])).sum(axis=1))
    assert np.mean(np.all(colony.ask(0.0) == [0.5, 0.0], axis=1)) > 0.8
