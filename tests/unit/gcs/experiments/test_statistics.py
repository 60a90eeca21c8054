"""Numbers of the summaries are what they say they are."""

import numpy as np
import pytest
from scipy.stats import ranksums

from gcs.experiments.markdown import table
from gcs.experiments.statistics import (
    numbers,
    quartiles,
    rank_sum_p,
    select,
    share,
    signed_rank_p,
    significance,
    spread,
)

ROWS = [
    {"algorithm": "pso", "seed": 1, "f": 3, "feasible": True},
    {"algorithm": "pso", "seed": 2, "f": 4.5, "feasible": False},
    {"algorithm": "aca", "seed": 1, "f": None, "feasible": True},
]


def test_rows_are_selected_by_their_values():
    assert select(ROWS, algorithm="pso", seed=2) == [ROWS[1]]
    assert numbers(ROWS, "f") == [3.0, 4.5]
    assert share(ROWS, "feasible") == pytest.approx(2.0 / 3.0)


def test_a_spread_is_the_median_between_its_quartiles():
    assert quartiles([1.0, 2.0, 3.0, 4.0, 5.0]) == (2.0, 3.0, 4.0)
    assert spread([1.0, 2.0, 3.0, 4.0, 5.0]) == "3.0 [2.0, 4.0]"
    assert spread([0.001], ".1e") == "1.0e-03 [1.0e-03, 1.0e-03]"
    assert spread([]) == "–"


def test_the_rank_sum_test_tells_samples_apart_that_are_different():
    rng = np.random.default_rng(1)
    one, other = rng.normal(0.0, 1.0, 60).tolist(), rng.normal(1.0, 1.0, 60).tolist()
    p = rank_sum_p(one, other)
    assert p == pytest.approx(float(ranksums(one, other).pvalue), rel=0.05)
    assert rank_sum_p(one, one) == pytest.approx(1.0)
    assert rank_sum_p([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]) == pytest.approx(0.1)  # two of twenty orders


def test_nothing_is_claimed_of_too_few_or_equal_values():
    assert rank_sum_p([1.0], [2.0, 3.0]) is None
    assert rank_sum_p([2.0, 2.0], [2.0, 2.0]) == 1.0
    assert [significance(p) for p in (None, 0.0001, 0.0312)] == ["–", "< 0.001", "0.031"]


def test_pairs_that_differ_in_one_direction_are_told_apart():
    one = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert signed_rank_p(one, [value + 0.1 * value for value in one]) == pytest.approx(2.0 / 64.0)
    assert signed_rank_p(one, one) is None


def test_a_table_is_markdown():
    assert table(["a", "b"], [["x", "1"]]) == "| a | b |\n|---|---:|\n| x | 1 |"
