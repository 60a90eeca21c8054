"""The swarm and the tabu search: against a brute-force front, against themselves uncompiled, and by their rules."""

import itertools

import numpy as np
import pytest

from companion.planner import mopso, tabu
from companion.planner.dominance import is_preferred, weighted_sum
from companion.planner.evaluation import HARD, SOFT, LocalProblem, evaluate
from companion.planner.mopso import SearchPlan, chosen, new_swarm, search, search_plan, takes_over
from companion.planner.tabu import FREE_SLOT, TENURE, is_tabu, new_memory, put_on_list, release, tabu_step
from companion.settings import SearchSettings
from tests.unit.companion.planner.problems import WEIGHTS, local_planner, problem_of

BESIDE_THE_CRATE_M = np.array([[5.0, 4.75, 1.5], [8.0, 4.6, 1.5]])
AT_REST = np.array([BESIDE_THE_CRATE_M[0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
PLAN = search_plan(SearchSettings(iterations=30, stall_generations=100), WEIGHTS)
SPREAD = np.array([0.05, 0.15, 0.15, 0.15])


def small_problem() -> LocalProblem:
    """One free control point and the time scale, beside the crate: four numbers, three conflicting objectives."""
    return problem_of(AT_REST, local_planner(n_control=7), BESIDE_THE_CRATE_M, 0.9)


def brute_force_front(problem: LocalProblem) -> np.ndarray:
    """(m, 3) objectives of the feasible points of a fine grid that no other one dominates."""
    scales = np.linspace(np.log(0.9), np.log(1.6), 25)
    offsets = np.linspace(-0.4, 0.4, 13)
    values, value = [], np.empty(5)
    for scale, east, north, up in itertools.product(scales, offsets, offsets, offsets):
        evaluate(np.array([scale, east, north, up]), problem, value)
        if value[HARD] == 0.0 and value[SOFT] == 0.0:
            values.append(value[:3].copy())
    points = np.array(values)
    best = np.argsort(points @ WEIGHTS)
    front: list[np.ndarray] = []
    for point in points[best]:
        if not any(np.all(other <= point) for other in front):
            front.append(point)
    return np.array(front)


def searched(problem: LocalProblem, plan: SearchPlan = PLAN, seed: int = 0, **changes):
    """A swarm that has searched the small problem."""
    settings = SearchSettings(**{"archive_size": 60, **changes})
    rng = np.random.default_rng(seed)
    first = SPREAD * rng.standard_normal((settings.particles, 4))
    first[:, 0] += rng.uniform(0.0, 0.4, settings.particles)
    swarm = new_swarm(first, settings.archive_size, settings.tabu_neighbours, settings.tabu_length)
    search(problem, swarm, SPREAD, plan, rng)
    return swarm


def test_the_swarm_finds_what_a_brute_force_grid_finds():
    problem = small_problem()
    front = brute_force_front(problem)
    assert len(front) > 10
    grid_best = (front @ WEIGHTS).min()
    for seed in range(5):
        swarm = searched(problem, seed=seed)
        _, value = chosen(swarm, WEIGHTS)
        assert (value[HARD], value[SOFT]) == (0.0, 0.0)
        assert weighted_sum(value, WEIGHTS) <= grid_best + 0.01
        held = swarm.archive.values[: swarm.archive.n[0], :3]
        dominated_by_m = max((entry - front).min(axis=1).max() for entry in held)
        missed_by_m = max((held - point).max(axis=1).min() for point in front)
        assert dominated_by_m < 0.1, "its archive lies behind the front"
        assert missed_by_m < 0.15, "its archive leaves a part of the front out"


@pytest.mark.parametrize("changes", [{}, {"tabu_neighbours": 0}, {"particles": 12}])
def test_every_switch_of_the_method_still_finds_a_feasible_trajectory(changes: dict):
    problem = small_problem()
    for weighted, adaptive in itertools.product((True, False), repeat=2):
        plan = PLAN._replace(iterations=20, weighted_dominance=weighted, adaptive_leader=adaptive)
        _, value = chosen(searched(problem, plan, **changes), WEIGHTS)
        assert (value[HARD], value[SOFT]) == (0.0, 0.0)


def test_one_seed_is_one_search():
    problem = small_problem()
    first, again, other = (chosen(searched(problem, seed=seed), WEIGHTS)[0] for seed in (3, 3, 4))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


def test_compiled_search_equals_its_own_source_run_by_python(monkeypatch: pytest.MonkeyPatch):
    problem, plan = small_problem(), PLAN._replace(iterations=3)
    compiled = searched(problem, plan, seed=2, particles=6)
    for module in (mopso, tabu):
        for name, function in list(vars(module).items()):
            if hasattr(function, "py_func"):
                monkeypatch.setattr(module, name, function.py_func)
    rng = np.random.default_rng(2)
    first = SPREAD * rng.standard_normal((6, 4))
    first[:, 0] += rng.uniform(0.0, 0.4, 6)
    settings = SearchSettings()
    swarm = new_swarm(first, 60, settings.tabu_neighbours, settings.tabu_length)
    mopso.search(problem, swarm, SPREAD, plan, rng)
    np.testing.assert_allclose(swarm.x, compiled.x, rtol=1e-9)
    np.testing.assert_allclose(swarm.best_value, compiled.best_value, rtol=1e-9)


def test_nothing_feasible_gives_the_least_violating_candidate():
    through_the_crate = np.array([[5.5, 7.0, 1.5], [8.5, 7.0, 1.5]])
    start = np.array([[5.5, 7.0, 1.5], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    problem = problem_of(start, local_planner(n_control=7), through_the_crate)
    swarm = searched(problem)
    x, value = chosen(swarm, WEIGHTS)
    assert swarm.archive.n[0] == 0
    assert value[HARD] > 0.0
    centre = np.empty(5)
    evaluate(np.zeros(4), problem, centre)
    assert value[HARD] <= centre[HARD]
    np.testing.assert_array_equal(x, swarm.best_x)


# --------------------------------------------------------------------- personal bests


def objectives(*three: float, hard: float = 0.0) -> np.ndarray:
    return np.array([*three, hard, 0.0])


def test_a_search_goes_on_while_it_betters_its_best_and_ends_where_there_is_no_hope():
    unknown = np.full(5, np.inf)
    assert mopso.is_onto_something(objectives(9.0, 0.0, 0.0, hard=2.0), unknown, WEIGHTS)
    assert mopso.is_onto_something(objectives(9.0, 0.0, 0.0, hard=1.8), objectives(1.0, 0.0, 0.0, hard=2.0), WEIGHTS)
    assert not mopso.is_onto_something(
        objectives(1.0, 0.0, 0.0, hard=1.99), objectives(9.0, 0.0, 0.0, hard=2.0), WEIGHTS
    )
    assert mopso.is_onto_something(objectives(9.0, 0.0, 0.0), objectives(1.0, 0.0, 0.0, hard=0.1), WEIGHTS)
    assert mopso.is_onto_something(objectives(8.9, 0.0, 0.0), objectives(9.0, 0.0, 0.0), WEIGHTS)
    assert not mopso.is_onto_something(objectives(9.0, 0.0, 0.0), objectives(9.0, 0.0, 0.0), WEIGHTS)


def test_the_personal_best_rule():
    """The dominating one stays or comes; a coin decides when neither dominates; constraints come first."""
    rng = np.random.default_rng(0)
    old = objectives(1.0, 1.0, 1.0)
    assert takes_over(objectives(0.5, 1.0, 1.0), old, WEIGHTS, True, rng)
    assert not takes_over(objectives(1.5, 1.0, 1.0), old, WEIGHTS, True, rng)
    mixed = [takes_over(objectives(1.6, 0.5, 1.0), old, WEIGHTS, True, rng) for _ in range(400)]
    assert 140 < sum(mixed) < 260
    assert takes_over(old, objectives(0.0, 0.0, 0.0, hard=0.1), WEIGHTS, True, rng)
    assert not takes_over(objectives(0.0, 0.0, 0.0, hard=0.1), old, WEIGHTS, True, rng)


# ------------------------------------------------------------------------ tabu search


def memory_at(x: np.ndarray, problem: LocalProblem):
    memory = new_memory(4, len(x))
    memory.x[:] = x
    evaluate(x, problem, memory.value)
    return memory


def step_of(memory, problem: LocalProblem, iteration: int, rng: np.random.Generator, n: int = 6):
    neighbours, values = np.zeros((n, 4)), np.full((n, 5), np.inf)
    count = tabu_step(memory, iteration, problem, SPREAD, neighbours, values, WEIGHTS, rng)
    return neighbours[:count], values[:count]


def test_the_neighbourhood_is_a_random_subset_of_moves_in_one_number_each():
    problem, rng = small_problem(), np.random.default_rng(1)
    at = np.array([0.05, 0.0, 0.1, 0.0])
    neighbours, _ = step_of(memory_at(at, problem), problem, 0, rng)
    moves = (neighbours - at) / SPREAD
    assert len(neighbours) == 6
    np.testing.assert_allclose(np.abs(moves).max(axis=1), 1.0)
    assert np.all(np.count_nonzero(np.abs(moves) > 1e-9, axis=1) == 1)


def test_it_moves_to_the_best_of_the_subset_also_when_that_is_worse_and_lists_what_it_left():
    problem, rng = small_problem(), np.random.default_rng(2)
    optimum, _ = chosen(searched(problem), WEIGHTS)
    memory = memory_at(optimum.copy(), problem)
    left = memory.value.copy()
    _, values = step_of(memory, problem, 0, rng)
    assert not any(is_preferred(value, memory.value, WEIGHTS) for value in values)
    assert is_preferred(left, memory.value, WEIGHTS)
    listed = int(np.argmax(memory.listed_at))
    np.testing.assert_array_equal(memory.listed_x[listed], optimum)


def test_what_is_on_the_list_is_not_entered_again():
    problem, rng = small_problem(), np.random.default_rng(3)
    optimum, _ = chosen(searched(problem), WEIGHTS)
    memory = memory_at(optimum.copy(), problem)
    for iteration in range(TENURE):
        neighbours, _ = step_of(memory, problem, iteration, rng)
        assert not any(np.allclose(neighbour, optimum) for neighbour in neighbours)
    assert is_tabu(optimum + 0.4 * SPREAD * np.array([1.0, 0.0, 0.0, 0.0]), memory, SPREAD)
    assert not is_tabu(optimum + 0.6 * SPREAD * np.array([1.0, 0.0, 0.0, 0.0]), memory, SPREAD)


def test_a_listed_optimum_better_than_all_of_a_subset_is_released_after_some_iterations():
    memory = new_memory(4, 4)
    memory.value[:] = objectives(1.0, 1.0, 1.0)
    put_on_list(memory, 5)
    better, worse = objectives(0.5, 0.5, 0.5), objectives(2.0, 2.0, 2.0)
    release(memory, 5 + TENURE - 1, worse, WEIGHTS)
    assert memory.listed_at.max() == 5, "too early"
    release(memory, 5 + TENURE, better, WEIGHTS)
    assert memory.listed_at.max() == 5, "the subset holds something better"
    release(memory, 5 + TENURE, worse, WEIGHTS)
    assert memory.listed_at.max() == FREE_SLOT


def test_a_full_list_forgets_its_oldest_entry():
    memory = new_memory(3, 4)
    for iteration in range(5):
        memory.x[:] = iteration
        put_on_list(memory, iteration)
    assert sorted(memory.listed_at.tolist()) == [2, 3, 4]
    assert sorted(memory.listed_x[:, 0].tolist()) == [2.0, 3.0, 4.0]
