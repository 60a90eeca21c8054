"""Where the vehicle was a moment ago, and how it was turned."""

import numpy as np
import pytest

from companion.sensing.pose_history import CAPACITY, LONGEST_GAP_S, Pose, PoseHistory
from tests.unit.companion.sensing.bench import LEVEL_NORTH, turned

DOWN, RIGHT = (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)


def test_positions_lie_on_the_line_between_two_estimates():
    history = PoseHistory()
    history.add(1.0, np.array([0.0, 10.0, -2.0]), LEVEL_NORTH)
    history.add(1.2, np.array([1.0, 10.0, -4.0]), LEVEL_NORTH)
    np.testing.assert_allclose(history.at(1.05).position_ned_m, [0.25, 10.0, -2.5])


def test_a_turn_is_half_done_at_half_time_whatever_the_sign_of_the_quaternions():
    for sign in (1.0, -1.0):
        history = PoseHistory()
        history.add(1.0, np.zeros(3), turned(DOWN, 10.0))
        history.add(1.1, np.zeros(3), sign * turned(DOWN, 30.0))
        ahead_enu = history.at(1.05).flu_to_enu[0]
        assert np.degrees(np.arctan2(ahead_enu[0], ahead_enu[1])) == pytest.approx(20.0, abs=0.01)


def test_the_body_looks_where_its_attitude_says():
    np.testing.assert_allclose(
        Pose(np.zeros(3), LEVEL_NORTH).flu_to_enu, [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], atol=1e-12
    )
    nose_up = Pose(np.zeros(3), turned(RIGHT, 30.0)).flu_to_enu
    np.testing.assert_allclose(nose_up[0], [0.0, np.cos(np.pi / 6), np.sin(np.pi / 6)], atol=1e-12)


@pytest.mark.parametrize("time_s", [0.9, 3.1, 1.5])
def test_nothing_is_known_before_the_first_after_the_last_and_within_a_gap(time_s: float):
    history = PoseHistory()
    history.add(1.0, np.zeros(3), LEVEL_NORTH)
    history.add(1.0 + 2.0 * LONGEST_GAP_S, np.zeros(3), LEVEL_NORTH)
    history.add(3.0, np.zeros(3), LEVEL_NORTH)
    assert history.at(time_s) is None


def test_estimates_out_of_order_and_attitudes_that_are_none_are_left_out():
    history = PoseHistory()
    history.add(2.0, np.zeros(3), LEVEL_NORTH)
    history.add(1.0, np.ones(3), LEVEL_NORTH)
    history.add(3.0, np.ones(3), np.zeros(4))
    assert history.newest_s == 2.0
    assert history.at(1.0) is None


def test_it_does_not_grow():
    history = PoseHistory()
    for tick in range(10 * CAPACITY):
        history.add(0.03 * tick, np.zeros(3), LEVEL_NORTH)
    assert history.at(0.03 * (9 * CAPACITY - 1)) is None
    assert history.at(0.03 * 9 * CAPACITY) is not None
