"""Pareto and weighted dominance by their definitions (eqs. 15 to 17), and the order that decides what is flown."""

import numpy as np
import pytest

from companion.planner.dominance import (
    is_preferred,
    objective_weights,
    pareto_dominates,
    weighted_dominates,
    weighted_sum,
)

PHI = np.array([0.2, 0.5, 0.3])


def weighted_by_definition(a: np.ndarray, b: np.ndarray, phi: np.ndarray) -> bool:
    """Eq. 16 with rho_i = 1 - phi_i, and eq. 17."""
    margins = [(a[i] - b[i]) + (1.0 - phi[i]) * sum(a[j] - b[j] for j in range(3) if j != i) for i in range(3)]
    return all(margin <= 0.0 for margin in margins) and any(margin < 0.0 for margin in margins)


def pareto_by_definition(a: np.ndarray, b: np.ndarray) -> bool:
    return bool(np.all(a <= b) and np.any(a < b))


def pairs(n: int, seed: int):
    """Pairs of objective vectors on a coarse grid, so that equal components occur."""
    rng = np.random.default_rng(seed)
    for _ in range(n):
        yield rng.integers(0, 4, 3).astype(float), rng.integers(0, 4, 3).astype(float)


def test_both_dominances_are_their_definitions():
    for a, b in pairs(3000, 1):
        assert pareto_dominates(a, b) == pareto_by_definition(a, b)
        assert weighted_dominates(a, b, PHI) == weighted_by_definition(a, b, PHI)


def test_weighted_dominance_includes_pareto_dominance_and_more():
    pareto = weighted = 0
    for a, b in pairs(3000, 2):
        if pareto_dominates(a, b):
            assert weighted_dominates(a, b, PHI)
        pareto += pareto_dominates(a, b)
        weighted += weighted_dominates(a, b, PHI)
    assert weighted > 1.3 * pareto


def test_neither_dominates_itself():
    a = np.array([1.0, 2.0, 3.0])
    assert not pareto_dominates(a, a)
    assert not weighted_dominates(a, a, PHI)


def test_weighted_dominance_is_transitive():
    rng = np.random.default_rng(3)
    chains = 0
    for a, b, c in rng.normal(size=(4000, 3, 3)):
        if weighted_dominates(a, b, PHI) and weighted_dominates(b, c, PHI):
            assert weighted_dominates(a, c, PHI)
            chains += 1
    assert chains > 100


def test_the_heavier_an_objective_the_less_of_it_is_given_for_the_others():
    gains_little_length = np.array([0.4, -0.3, 0.0])
    worse_first = np.zeros(3)
    light, heavy = np.array([0.05, 0.9, 0.05]), np.array([0.9, 0.05, 0.05])
    assert weighted_sum(gains_little_length, light) < 0.0 < weighted_sum(gains_little_length, heavy)
    assert not weighted_dominates(gains_little_length, worse_first, heavy)


def test_weights_sum_to_one():
    assert objective_weights(0.2, 0.3, 0.1) == pytest.approx([1 / 3, 1 / 2, 1 / 6])
    assert objective_weights(0.0, 0.0, 0.0) == pytest.approx([1 / 3] * 3)


def test_constraints_come_before_objectives_and_hard_ones_first():
    good_but_colliding = np.array([1.0, -3.0, 0.0, 0.1, 0.0])
    safe_but_beside = np.array([9.0, 0.0, 1.0, 0.0, 5.0])
    long = np.array([9.0, 0.0, 1.0, 0.0, 0.0])
    assert is_preferred(safe_but_beside, good_but_colliding, PHI)
    assert is_preferred(long, safe_but_beside, PHI)
    assert is_preferred(np.array([8.0, 0.0, 1.0, 0.0, 0.0]), long, PHI)
    assert not is_preferred(long, long, PHI)
