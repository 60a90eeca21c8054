"""Jerk-limited ramps: they arrive, they keep their limits, and they are the sum of their parts."""

import numpy as np
import pytest

from sitl.control.smoothing import along, fastest_ramp, slower_ramp, speed_to_stop_within

JERK, MOST = 4.0, 3.0
CASES = [(0.0, 0.0, 5.0), (2.0, -1.0, -3.0), (5.0, 3.0, 4.5), (-1.0, 2.5, -1.0), (0.0, 0.0, 0.0), (1.0, -3.0, 1.0)]


def integrated(ramp, velocity: float, acceleration: float, duration_s: float) -> tuple[float, float, float]:
    """Position, velocity, acceleration by small steps of the jerk's own definition."""
    n = 200_000
    t = (np.arange(n) + 0.5) * duration_s / n
    t1, t2, t3 = ramp[1:]
    jerk = np.where(t < t1, ramp[0], np.where(t < t1 + t2, 0.0, np.where(t < t1 + t2 + t3, -ramp[0], 0.0)))
    step = duration_s / n
    accelerations = acceleration + np.cumsum(jerk) * step
    velocities = velocity + np.cumsum(accelerations) * step
    return velocities.sum() * step, velocities[-1], accelerations[-1]


@pytest.mark.parametrize(("velocity", "acceleration", "wanted"), CASES)
def test_the_fastest_ramp_ends_at_the_wanted_velocity_without_acceleration(velocity, acceleration, wanted):
    ramp = fastest_ramp(velocity, acceleration, wanted, JERK, MOST)
    _, v, a = along(ramp, 0.0, velocity, acceleration, sum(ramp[1:]))
    assert v == pytest.approx(wanted, abs=1e-9)
    assert a == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("velocity", "acceleration", "wanted"), CASES)
def test_limits_hold_along_the_way(velocity, acceleration, wanted):
    ramp = fastest_ramp(velocity, acceleration, wanted, JERK, MOST)
    for t in np.linspace(0.0, sum(ramp[1:]), 50):
        _, _, a = along(ramp, 0.0, velocity, acceleration, float(t))
        assert abs(a) <= MOST + 1e-9
    assert abs(ramp[0]) in (0.0, JERK)


@pytest.mark.parametrize(("velocity", "acceleration", "wanted"), CASES)
def test_moving_along_a_ramp_is_integrating_its_jerk(velocity, acceleration, wanted):
    ramp = fastest_ramp(velocity, acceleration, wanted, JERK, MOST)
    for duration_s in (0.3, 1.0, sum(ramp[1:]) + 0.5):
        expected = integrated(ramp, velocity, acceleration, duration_s)
        assert np.allclose(along(ramp, 0.0, velocity, acceleration, duration_s), expected, atol=1e-3)


@pytest.mark.parametrize("longer_s", [0.2, 1.0, 4.0])
def test_a_slower_ramp_takes_the_time_that_it_is_given(longer_s):
    fastest = fastest_ramp(0.5, 0.2, 2.0, JERK, MOST)
    total_s = sum(fastest[1:]) + longer_s
    ramp = slower_ramp(0.5, 0.2, 2.0, JERK, MOST, total_s)
    _, v, a = along(ramp, 0.0, 0.5, 0.2, total_s)
    assert sum(ramp[1:]) == pytest.approx(total_s)
    assert v == pytest.approx(2.0, abs=1e-9)
    assert a == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("distance_m", "used"), [(0.5, 0.15), (5.0, 0.4), (100.0, 0.75)])
def test_a_vehicle_at_the_braking_speed_stops_within_its_distance(distance_m, used):
    speed = speed_to_stop_within(distance_m, 0.0, JERK, MOST)
    ramp = fastest_ramp(speed, 0.0, 0.0, JERK, MOST)
    x, _, _ = along(ramp, 0.0, speed, 0.0, sum(ramp[1:]))
    assert x <= distance_m
    assert x >= used * distance_m  # careful over short ways, where the jerk takes most of the time


def test_no_speed_is_needed_at_the_end_of_the_way_but_the_one_to_leave_with():
    assert speed_to_stop_within(0.0, 0.0, JERK, MOST) == pytest.approx(0.0, abs=1e-9)
    assert speed_to_stop_within(0.0, 2.0, JERK, MOST) == pytest.approx(2.0)
