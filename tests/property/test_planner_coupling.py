"""Separation as the compiled costs see it is what comparing every pair of places finds."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from gcs.planner.coupling import Coupling, at_fractions, too_close
from tests.unit.gcs.planner import reference

FRACTIONS = 24


def places_along(rng: np.random.Generator, size_m: float) -> tuple[np.ndarray, float]:
    """(k, 3) places on a random walk, and how far apart they are along it."""
    points = np.cumsum(rng.normal(0.0, size_m / 20.0, (40, 3)), axis=0) + rng.uniform(0.0, size_m / 3.0, 3)
    chords, places = np.linalg.norm(np.diff(points, axis=0), axis=1), np.empty((FRACTIONS, 3))
    step_m = at_fractions(points, chords, places, np.empty(FRACTIONS, np.int64), np.empty(FRACTIONS))
    return places, step_m


def limits(separation_m: float, zone_m: float, window: int) -> Coupling:
    k = np.arange(FRACTIONS)
    return Coupling(
        separation_m=separation_m,
        zone_radius_m=zone_m,
        contact_m=0.3 * separation_m,
        join_m=0.2 * zone_m,
        mean_low_m=0.0,
        mean_high_m=1e6,
        mean_unit_m=1.0,
        first=np.maximum(k - window, 0),
        last=np.minimum(k + window, FRACTIONS - 1),
    )


@settings(max_examples=40)
@given(
    seed=st.integers(0, 10_000),
    separation_m=st.floats(0.5, 8.0),
    zone_m=st.sampled_from([0.0, 5.0]),
    window=st.integers(0, 6),
)
def test_nothing_that_is_too_close_is_skipped(seed: int, separation_m: float, zone_m: float, window: int):
    rng = np.random.default_rng(seed)
    (a, a_step_m), (b, b_step_m) = places_along(rng, 20.0), places_along(rng, 20.0)
    coupling = limits(separation_m, zone_m, window)
    found = too_close(a, b, a_step_m + b_step_m, b_step_m, coupling, 0.0, a, b)
    expected = reference.separation(coupling, a, b)
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-9)
