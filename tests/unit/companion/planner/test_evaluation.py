"""The compiled evaluation of candidates is what the documentation says, written in numpy."""

import numpy as np
import pytest

from companion.planner.evaluation import HARD, LENGTH, SOFT, evaluate
from tests.unit.companion.planner.problems import AROUND_THE_CRATE_M, problem_of, value_in_numpy

AT_REST = np.array([[1.0, 6.5, 1.5], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
MOVING = np.array([[1.0, 6.6, 1.4], [1.9, -0.5, 0.2], [0.4, 0.3, -0.1]])
TOO_FAST = np.array([[5.0, 5.1, 1.5], [2.6, -0.8, 0.0], [1.5, -1.8, 0.3]])
OUTSIDE_AND_NEAR = np.array([[6.0, 5.2, -0.2], [0.3, 0.0, 0.0], [0.0, 0.0, 0.0]])


@pytest.mark.parametrize("start", [AT_REST, MOVING, TOO_FAST, OUTSIDE_AND_NEAR])
@pytest.mark.parametrize("spread_m", [0.0, 0.1, 1.0])
def test_compiled_evaluation_equals_its_numpy_reference(start: np.ndarray, spread_m: float):
    problem = problem_of(start)
    rng = np.random.default_rng(5)
    for _ in range(10):
        x = np.concatenate(([rng.normal(0.0, 0.1)], rng.normal(0.0, spread_m, 18)))
        value = np.empty(5)
        knot_s = evaluate(x, problem, value)
        trajectory, expected = value_in_numpy(x, problem)
        assert knot_s == pytest.approx(trajectory.knot_interval_s)
        np.testing.assert_allclose(problem.control, trajectory.control_points_m, atol=1e-12)
        np.testing.assert_allclose(value, expected, rtol=1e-9, atol=1e-9)


def test_a_candidate_begins_exactly_in_the_given_state_and_ends_at_rest():
    problem = problem_of(MOVING)
    x = np.random.default_rng(6).normal(0.0, 0.2, 19)
    evaluate(x, problem, np.empty(5))
    trajectory, _ = value_in_numpy(x, problem)
    for part, given in zip(trajectory.at(0.0), MOVING, strict=True):
        np.testing.assert_allclose(part, given, atol=1e-9)
    end = trajectory.at(trajectory.end_s)
    np.testing.assert_allclose(end.position_m, problem.reference.samples[-1, :3], atol=1e-9)
    np.testing.assert_allclose([end.velocity_m_s, end.acceleration_m_s2], 0.0, atol=1e-9)


def test_through_the_crate_is_a_hard_violation_and_beside_the_corridor_a_soft_one():
    straight = problem_of(AT_REST, points_m=np.array([[1.0, 6.5, 1.5], [12.0, 6.5, 1.5]]))
    value = np.empty(5)
    evaluate(np.zeros(19), straight, value)
    assert value[HARD] > 0.5
    around = problem_of(AT_REST)
    bow = np.zeros(19)
    bow[7] = -0.6  # the smoothest mode, to the south
    evaluate(bow, around, value)
    assert value[SOFT] > 0.1


def test_rougher_and_later_candidates_cost_more_way():
    problem = problem_of(AT_REST, points_m=AROUND_THE_CRATE_M)
    plain, late, rough = np.empty(5), np.empty(5), np.empty(5)
    evaluate(np.zeros(19), problem, plain)
    evaluate(np.concatenate(([0.2], np.zeros(18))), problem, late)
    zigzag = np.zeros(19)
    zigzag[5] = 1.0
    evaluate(zigzag, problem, rough)
    assert late[LENGTH] > plain[LENGTH] + 0.5
    assert rough[LENGTH] > plain[LENGTH] + 0.05
