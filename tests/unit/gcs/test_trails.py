"""Where vehicles have been, in little memory."""

import sys

import numpy as np

from gcs.flight.trails import Trail


def test_a_trail_that_grows_is_the_one_that_is_made_at_once():
    times_s, positions_m = np.arange(5.0), np.arange(15.0).reshape(5, 3)
    grown, made = Trail(), Trail.of(times_s, positions_m, -positions_m)
    for time_s, position_m in zip(times_s, positions_m, strict=True):
        grown.append(time_s, position_m, -position_m)
    assert grown == made
    np.testing.assert_array_equal(grown.newest_m, positions_m[-1])
    np.testing.assert_array_equal(grown.positions_m(2), positions_m[2:])
    np.testing.assert_array_equal(grown.velocities_m_s(), -positions_m)
    assert Trail().positions_m().shape == (0, 3)


def test_a_sample_takes_less_than_a_hundred_bytes():
    trail, count = Trail(), 10_000
    for number in range(count):
        trail.append(0.1 * number, np.ones(3), np.ones(3))
    assert sum(sys.getsizeof(numbers) for numbers in vars(trail).values()) < 100 * count
