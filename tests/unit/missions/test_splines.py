"""B-splines, trajectories and time laws."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from missions import bspline
from missions.time_law import arc_length, resample, speeds_along, times_along
from missions.trajectory import Trajectory, at_rest


@given(n_control=st.integers(4, 16), u=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=20))
def test_the_basis_is_that_of_scipy(n_control: int, u: list[float]):
    ours = bspline.basis(n_control, np.array(u))
    inside = np.minimum(np.array(u), 1.0 - 1e-15)
    theirs = BSpline.design_matrix(inside, bspline.clamped_knots(n_control), 3).toarray()
    np.testing.assert_allclose(ours, theirs, atol=1e-9)


@given(seed=st.integers(0, 1000), n_control=st.integers(4, 12))
def test_a_clamped_curve_begins_and_ends_in_its_outer_control_points_and_stays_in_their_hull(seed: int, n_control: int):
    control = np.random.default_rng(seed).uniform(-5, 5, (n_control, 3))
    curve = bspline.evaluate(control, np.linspace(0, 1, 50))
    np.testing.assert_allclose(curve[[0, -1]], control[[0, -1]], atol=1e-12)
    assert np.all(curve >= control.min(axis=0) - 1e-12)
    assert np.all(curve <= control.max(axis=0) + 1e-12)


def test_too_few_control_points_are_refused():
    with pytest.raises(ValueError, match="needs 4 control points, got 3"):
        bspline.clamped_knots(3)


def test_the_uniform_segment_is_the_matrix_of_the_paper():
    control = np.array([[0.0, 0, 0], [1, 2, 0], [3, 1, 1], [4, 4, 2]])
    u = 0.3
    expected = np.array([u**3, u**2, u, 1]) @ bspline.SEGMENT @ control
    trajectory = Trajectory(control, start_s=10.0, knot_interval_s=2.0)
    np.testing.assert_allclose(trajectory.at(10.0 + 2.0 * u).position_m, expected)


def random_trajectory(seed: int) -> Trajectory:
    rng = np.random.default_rng(seed)
    control = np.cumsum(rng.normal(0, 1, (9, 3)), axis=0)
    return Trajectory(np.vstack((control, control[-1:], control[-1:])), start_s=5.0, knot_interval_s=0.4)


@given(seed=st.integers(0, 200))
@settings(max_examples=30)
def test_velocity_and_acceleration_are_derivatives_and_continuous(seed: int):
    trajectory = random_trajectory(seed)
    step = 1e-5
    times = np.linspace(trajectory.start_s + step, trajectory.end_s - step, 101)
    middle, before, after = (trajectory.sample(times + shift) for shift in (0.0, -step, step))
    velocity = (after.position_m - before.position_m) / (2 * step)
    acceleration = (after.velocity_m_s - before.velocity_m_s) / (2 * step)
    np.testing.assert_allclose(middle.velocity_m_s, velocity, atol=1e-4)
    np.testing.assert_allclose(middle.acceleration_m_s2, acceleration, atol=5e-3)


def test_a_trajectory_holds_its_first_state_before_and_rests_after():
    control = np.vstack((np.tile([0.0, 0, 1], (3, 1)), [[1, 0, 1]], np.tile([2.0, 0, 1], (3, 1))))
    trajectory = Trajectory(control, start_s=1.0, knot_interval_s=0.5)
    assert trajectory.duration_s == pytest.approx(2.0)
    np.testing.assert_allclose(trajectory.at(0.0).position_m, [0.0, 0.0, 1.0])
    after = trajectory.at(50.0)
    np.testing.assert_allclose(after.position_m, [2.0, 0.0, 1.0])
    assert after.velocity_m_s.tolist() == [0.0, 0.0, 0.0]
    np.testing.assert_allclose(trajectory.end_m, trajectory.at(trajectory.end_s).position_m)


def test_trajectories_that_cannot_be_are_refused():
    with pytest.raises(ValueError, match=r"\(n >= 4, 3\) control points, got \(3, 3\)"):
        Trajectory(np.zeros((3, 3)), 0.0, 1.0)
    with pytest.raises(ValueError, match="positive knot interval"):
        Trajectory(np.zeros((4, 3)), 0.0, 0.0)


def test_standing_still_is_a_trajectory():
    motion = at_rest(np.array([1.0, 2.0, 3.0]), start_s=7.0).at(7.5)
    assert motion.position_m.tolist() == pytest.approx([1.0, 2.0, 3.0])
    np.testing.assert_allclose(motion.velocity_m_s, 0.0, atol=1e-12)


def test_a_grid_covers_the_rest_of_a_trajectory():
    trajectory = random_trajectory(1)
    grid = trajectory.grid(0.05, from_s=trajectory.start_s + 1.0)
    assert grid[0] == pytest.approx(trajectory.start_s + 1.0)
    assert grid[-1] == pytest.approx(trajectory.end_s)
    assert np.diff(grid).max() <= 0.05 + 1e-12


LINE = np.stack((np.linspace(0, 20, 201), np.zeros(201), np.ones(201)), axis=-1)


def test_a_time_law_reaches_cruise_speed_and_stops_at_the_end():
    speeds = speeds_along(LINE, np.full(201, 3.0), acceleration_m_s2=2.0)
    times = times_along(LINE, speeds)
    assert speeds[0] == speeds[-1] == 0.0
    assert speeds.max() == pytest.approx(3.0)
    # trapezoid: 20 m at 3 m/s, with 1.5 s of ramp at each end that cost half of their time
    assert times[-1] == pytest.approx(20 / 3 + 1.5, rel=0.02)


def test_a_time_law_keeps_slow_zones_and_the_acceleration():
    limits = np.where((LINE[:, 0] > 8) & (LINE[:, 0] < 12), 1.0, 3.0)
    speeds = speeds_along(LINE, limits, acceleration_m_s2=2.0, start_m_s=1.0)
    assert np.all(speeds <= limits + 1e-12)
    change = np.abs(np.diff(speeds**2)) / (2 * np.diff(LINE[:, 0]))
    assert change.max() <= 2.0 + 1e-9
    assert speeds[0] == pytest.approx(1.0)


def test_times_stay_finite_where_a_path_stands_still():
    assert np.all(np.isfinite(times_along(LINE[:3], np.zeros(3))))


def test_resampling_a_polyline_by_arc_length():
    corner = np.array([[0.0, 0, 0], [3, 0, 0], [3, 4, 0]])
    length = arc_length(corner)
    assert length.tolist() == [0.0, 3.0, 7.0]
    np.testing.assert_allclose(resample(corner, length, np.array([1.5, 5.0])), [[1.5, 0, 0], [3, 2, 0]])
