"""The descent that polishes plans."""

import numpy as np
import pytest
from scipy.optimize import minimize, rosen, rosen_der

from gcs.planner.allocation import allocate
from gcs.planner.fleet_cost import fleet_cost
from gcs.planner.lbfgs import CORRECTIONS, Descent, downhill, line_search, minimise
from gcs.planner.lone_descent import alone, descend_alone
from gcs.planner.problem import guides, pose
from gcs.planner.representation import bows
from missions.mission import load_mission


def never() -> bool:
    return False


def rosenbrock(x: np.ndarray) -> tuple[float, np.ndarray]:
    return float(rosen(x)), rosen_der(x)


def valley_of_kinks(x: np.ndarray) -> tuple[float, np.ndarray]:
    """Steep absolute values, as distances and caps make them: the optimum lies on a kink."""
    weights = np.arange(1.0, len(x) + 1.0)
    return float(weights @ np.abs(x - 0.5) + x @ x), weights * np.sign(x - 0.5) + 2.0 * x


def reference_direction(gradient: np.ndarray, steps: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """-H g with the inverse Hessian H built up by BFGS updates, oldest first (Nocedal and Wright, eq. 6.17)."""
    inverse = np.eye(len(gradient)) * (steps[-1] @ turns[-1]) / (turns[-1] @ turns[-1])
    for step, turn in zip(steps, turns, strict=True):
        left = np.eye(len(gradient)) - np.outer(step, turn) / (step @ turn)
        inverse = left @ inverse @ left.T + np.outer(step, step) / (step @ turn)
    return -inverse @ gradient


@pytest.mark.parametrize("known", [1, 7, CORRECTIONS, CORRECTIONS + 13])
def test_the_compiled_direction_is_that_of_bfgs_with_the_kept_changes(known: int):
    rng = np.random.default_rng(known)
    hessian = rng.normal(size=(30, 30))
    hessian = hessian @ hessian.T + np.eye(30)
    steps = rng.normal(size=(known, 30))
    turns = steps @ hessian
    ring = np.zeros((2, CORRECTIONS, 30))
    for i in range(known):
        ring[:, i % CORRECTIONS] = steps[i], turns[i]
    gradient, found = rng.normal(size=30), np.empty(30)
    downhill(gradient, ring[0], ring[1], known, found)
    np.testing.assert_allclose(
        found, reference_direction(gradient, steps[-CORRECTIONS:], turns[-CORRECTIONS:]), rtol=1e-6
    )


def test_it_finds_the_minimum_of_rosenbrocks_valley_as_scipy_does():
    start = np.full(10, -0.5)
    descent = minimise(rosenbrock, start, 2000, never)
    theirs = minimize(rosenbrock, start, jac=True, method="L-BFGS-B", options={"maxcor": CORRECTIONS, "ftol": 1e-12})
    assert descent.cost < 1e-8
    assert descent.evaluations < 2 * theirs.nfev
    np.testing.assert_allclose(descent.position, 1.0, atol=1e-3)


def test_it_gets_to_an_optimum_on_a_kink():
    descent = minimise(valley_of_kinks, np.full(6, 3.0), 500, never)
    assert descent.cost == pytest.approx(6 * 0.25, abs=0.02)


def test_it_makes_no_more_evaluations_than_it_may():
    count = 0

    def counted(x: np.ndarray) -> tuple[float, np.ndarray]:
        nonlocal count
        count += 1
        return rosenbrock(x)

    for most in (1, 2, 17):
        count = 0
        assert minimise(counted, np.full(10, -0.5), most, never).evaluations == count <= most


def test_it_stops_when_asked_to():
    assert minimise(rosenbrock, np.full(10, -0.5), 500, lambda: True).evaluations == 1


def test_a_line_search_that_finds_nothing_lower_stays_where_it_is():
    here = Descent(np.zeros(2), *valley_of_kinks(np.zeros(2)), evaluations=3)
    found = line_search(valley_of_kinks, here, here.gradient, 10)  # uphill
    np.testing.assert_array_equal(found.position, here.position)
    assert (found.cost, found.evaluations) == (here.cost, 13)


@pytest.mark.parametrize("mission", ["terrain-2-5uav", "indoor"])
@pytest.mark.parametrize("most", [1, 2, 30, 400])
def test_the_compiled_descent_of_a_single_vehicle_takes_the_same_steps(mission: str, most: int):
    loaded = load_mission(mission)
    routes = allocate(loaded)
    problem = alone(pose(loaded, routes, guides(loaded, routes)), 1)
    weight = problem.terms.penalty_weight
    first = bows(problem.base_m.shape[1])[9:10]

    def cost(offsets: np.ndarray) -> tuple[float, np.ndarray]:
        gradient = np.empty_like(first)
        objective, violation = fleet_cost(problem, offsets.reshape(first.shape), gradient)
        return objective + weight * violation, gradient.ravel()

    expected = minimise(cost, first.ravel(), most, lambda: False)
    found = first.copy()
    assert descend_alone(problem, found, most) == expected.evaluations
    np.testing.assert_allclose(found.ravel(), expected.position, rtol=1e-9)
