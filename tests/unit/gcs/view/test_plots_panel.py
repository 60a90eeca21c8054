"""The range of a plot."""

import numpy as np
import pytest

from gcs.view.plots_panel import value_range


@pytest.mark.parametrize(
    ("values", "least_span", "bounds"),
    [
        ([0.0, 9.0], 1.0, (0.0, 10.0)),
        ([3.0, 3.0], 1.0, (2.4, 3.6)),
        ([np.nan, 1.0, np.nan, 40.0], 2.0, (0.0, 40.0)),
        ([np.nan], 2.0, (-1.0, 1.0)),
        ([], 2.0, (-1.0, 1.0)),
    ],
)
def test_a_range_is_round_wide_enough_and_does_not_mind_what_is_missing(
    values: list[float], least_span: float, bounds: tuple[float, float]
):
    np.testing.assert_allclose(value_range(np.array(values), least_span), bounds)


def test_all_that_is_known_is_in_the_range_and_fills_most_of_it():
    rng = np.random.default_rng(5)
    for _ in range(200):
        values = rng.normal(rng.uniform(-100, 100), 10.0 ** rng.uniform(-1, 3), size=30)
        low, high = value_range(values, 1e-3)
        assert low <= values.min()
        assert values.max() <= high
        assert high - low < 3.0 * np.ptp(values)
