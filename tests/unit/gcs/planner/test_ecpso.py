"""The swarm: equations 7 to 12, adaptive size and topology, ask and tell."""

from dataclasses import replace

import numpy as np
import pytest

from gcs.planner.ecpso import SEARCH_RANGE, Ecpso, EcpsoSettings, adapted

PAPER = EcpsoSettings()
PLAIN = EcpsoSettings(
    adapt_inertia=False, adapt_learning=False, adapt_speed=False, adapt_population=False, adapt_topology=False
)
DIMENSIONS = 6


def fresh(rng: np.random.Generator, count: int) -> np.ndarray:
    return rng.uniform(-1.0, 1.0, (count, DIMENSIONS))


def bowl(positions: np.ndarray) -> np.ndarray:
    return np.sum((positions - 0.3) ** 2, axis=1)


def ackley(positions: np.ndarray) -> np.ndarray:
    """The paper's test function (figure 5), its optimum of 0 at 0.1; positions in [-1, 1] stand for [-5, 5]."""
    x = 5.0 * (positions - 0.1)
    roots = -20.0 * np.exp(-0.2 * np.sqrt(np.mean(x**2, axis=1)))
    return roots - np.exp(np.mean(np.cos(2.0 * np.pi * x), axis=1)) + 20.0 + np.e


def new_swarm(settings: EcpsoSettings = PAPER, seed: int = 1, first: np.ndarray | None = None) -> Ecpso:
    start = np.zeros((0, DIMENSIONS)) if first is None else first
    return Ecpso(start, fresh, settings, np.random.default_rng(seed))


def run(swarm: Ecpso, iterations: int, cost=bowl) -> list[float]:
    best = []
    for _ in range(iterations):
        swarm.tell(cost(swarm.ask()))
        best.append(swarm.best()[1])
    return best


def test_it_finds_the_bottom_of_a_bowl():
    swarm = new_swarm()
    run(swarm, 300)
    np.testing.assert_allclose(swarm.best()[0], 0.3, atol=0.02)


def test_it_finds_the_optimum_of_the_papers_ackley_function():
    swarm = new_swarm()
    assert run(swarm, 400, ackley)[-1] < 0.5


def test_the_best_never_gets_worse():
    assert np.all(np.diff(run(new_swarm(), 100, ackley)) <= 0.0)


def test_one_seed_gives_one_search_to_the_bit():
    assert run(new_swarm(seed=7), 60) == run(new_swarm(seed=7), 60)
    assert run(new_swarm(seed=7), 60) != run(new_swarm(seed=8), 60)


def test_the_first_particles_are_those_given_filled_up_with_fresh_ones():
    first = np.full((3, DIMENSIONS), 0.25)
    asked = new_swarm(first=first).ask()
    assert asked.shape == (PAPER.population, DIMENSIONS)
    np.testing.assert_array_equal(asked[:3], first)


def test_positions_stay_in_the_search_range_and_steps_below_the_greatest_speed():
    swarm = new_swarm(replace(PAPER, adapt_population=False))
    before = swarm.ask().copy()
    for _ in range(40):
        swarm.tell(-np.sum(np.abs(before), axis=1))  # everything pulls outwards
        after = swarm.ask().copy()
        assert np.all(np.abs(after) <= 1.0)
        assert np.all(np.abs(after - before) <= PAPER.speed[1] * SEARCH_RANGE + 1e-12)
        before = after


def test_the_update_is_equations_7_and_8():
    settings, start, best = replace(PLAIN, population=1), np.zeros((1, DIMENSIONS)), np.full(DIMENSIONS, 0.004)
    swarm, dice = new_swarm(settings, seed=5, first=start), np.random.default_rng(5)
    swarm.tell(np.array([1.0]))
    swarm.ask()
    swarm.offer(best, 0.5)  # pBest and gBest of the only particle lie elsewhere now
    dice.random((2, 1, DIMENSIONS))  # spent on the step before, which led nowhere
    position, velocity = start, np.zeros_like(start)
    for _ in range(3):
        swarm.tell(np.array([9.0]))
        own, social = dice.random((1, DIMENSIONS)), dice.random((1, DIMENSIONS))
        velocity = 0.6 * velocity + 2.0 * own * (best - position) + 2.0 * social * (best - position)  # (eq. 7)
        position = position + velocity  # (eq. 8)
        np.testing.assert_allclose(swarm.ask(), position, rtol=1e-12)


@pytest.mark.parametrize(("mobility", "inertia"), [(0.05, 0.9), (0.1, 0.9), (0.2, 0.65), (0.3, 0.4), (0.8, 0.4)])
def test_inertia_falls_with_mobility(mobility: float, inertia: float):
    """Equation 9, linear between its two thresholds."""
    assert adapted(mobility, True, PAPER).inertia == pytest.approx(inertia)


@pytest.mark.parametrize(("mobility", "own", "social"), [(0.05, 0.5, 3.5), (0.2, 2.0, 2.0), (0.5, 3.5, 0.5)])
def test_a_mobile_swarm_learns_from_itself_and_a_settled_one_from_its_best(mobility: float, own: float, social: float):
    """Equations 10 and 11."""
    parameters = adapted(mobility, True, PAPER)
    assert (parameters.own_learning, parameters.social_learning) == (pytest.approx(own), pytest.approx(social))


def test_a_mobile_swarm_may_fly_faster():
    """Equation 12."""
    assert adapted(0.5, True, PAPER).speed == 0.03
    assert adapted(0.05, True, PAPER).speed == 0.015


def test_without_improvement_particles_learn_from_their_neighbours_only():
    assert adapted(0.2, True, PAPER).is_global
    assert not adapted(0.2, False, PAPER).is_global


def test_every_mechanism_can_be_switched_off():
    parameters = adapted(0.05, False, PLAIN)
    assert (parameters.inertia, parameters.own_learning, parameters.social_learning) == (0.6, 2.0, 2.0)
    assert (parameters.speed, parameters.is_global) == (0.02, True)
    swarm = new_swarm(PLAIN)
    run(swarm, 50)
    assert len(swarm.memory) == PLAIN.population


def test_particles_leave_while_it_improves_and_join_when_it_is_stuck():
    swarm = new_swarm()
    run(swarm, 40)
    improving = len(swarm.memory)
    assert improving < PAPER.population
    run(swarm, 60, lambda positions: np.full(len(positions), 9.0))  # nothing is ever better
    assert len(swarm.memory) == PAPER.population


def test_it_never_gets_smaller_than_its_least_population():
    swarm = new_swarm()
    for step in range(200):
        swarm.tell(np.full(len(swarm.ask()), 1000.0 - step))  # better every time
    assert len(swarm.memory) == PAPER.least_population


def test_an_offered_position_replaces_the_worst_memory_if_it_is_better():
    swarm = new_swarm()
    run(swarm, 1)
    good, bad = np.full(DIMENSIONS, 0.3), np.full(DIMENSIONS, -1.0)
    swarm.offer(good, 0.0)
    assert swarm.best()[1] == 0.0
    swarm.offer(bad, 1e9)
    assert not np.any(np.all(swarm.memory == bad, axis=1))


def test_memories_are_valued_anew_when_costs_have_changed():
    swarm = new_swarm()
    run(swarm, 10)
    swarm.remember(np.sum((swarm.memory + 0.3) ** 2, axis=1))
    expected = np.min(np.sum((swarm.memory + 0.3) ** 2, axis=1))
    assert swarm.best()[1] == pytest.approx(expected)
