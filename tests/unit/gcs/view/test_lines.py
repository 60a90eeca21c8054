"""Trails and what lies ahead, as lines."""

import numpy as np

from gcs.fleet.vehicle_state import CompanionView
from gcs.flight.trails import Trail
from gcs.view.lines import AHEAD, CHUNK, AheadLine, Array, TrailLine, tails, ways_ahead
from missions.trajectory import Trajectory
from missions.tunnel import CompanionState, CompanionStatus


def flown(metres: float, step_m: float = 0.1) -> Trail:
    """A flight eastwards."""
    trail = Trail()
    for index, east_m in enumerate(np.arange(0.0, metres, step_m)):
        trail.append(index * 0.1, np.array([east_m, 2.0, 1.5]), np.zeros(3))
    return trail


def test_a_trail_is_drawn_whole_and_without_gaps():
    line, trail = TrailLine(spacing_m=0.05), flown(20.0)
    chunks = line.take(trail)
    now_m = np.array([20.0, 2.0, 1.5])
    tail = tails([line], now_m[None])
    drawn = np.concatenate([*chunks, tail])
    np.testing.assert_allclose(drawn[0, 0], [0.0, 2.0, 1.5])
    np.testing.assert_allclose(drawn[-1, 1], now_m)
    np.testing.assert_allclose(drawn[:-1, 1], drawn[1:, 0])
    np.testing.assert_allclose(np.diff(drawn[:, 0, 0]).clip(0.0, 0.1 + 1e-9), np.diff(drawn[:, 0, 0]))


def test_sealed_chunks_are_handed_out_once_and_the_tail_keeps_its_size():
    line, trail, now_m = TrailLine(spacing_m=0.05), flown(20.0), np.zeros((1, 3))
    sealed = line.take(trail)
    assert len(sealed) == line.sealed == 4
    assert all(chunk.shape == (CHUNK, 2, 3) for chunk in sealed)
    assert line.take(trail) == []
    for _ in range(3 * CHUNK):
        trail.append(trail.times_s[-1] + 0.1, trail.positions_m()[-1] + np.array([0.1, 0.0, 0.0]), np.zeros(3))
        line.take(trail)
        assert tails([line], now_m).shape == (CHUNK, 2, 3)
    assert line.sealed == 7


def test_a_hovering_vehicle_leaves_no_trail():
    line, trail = TrailLine(spacing_m=0.5), flown(0.4)
    assert line.take(trail) == []
    tail = tails([line], np.array([[0.4, 2.0, 1.5]]))
    np.testing.assert_allclose(tail[0, 0], [0.0, 2.0, 1.5])
    np.testing.assert_allclose(tail[0, 1:], [[0.4, 2.0, 1.5]])
    np.testing.assert_allclose(tail[1:], np.tile([0.4, 2.0, 1.5], (CHUNK - 1, 2, 1)))


def test_before_anything_is_known_the_tail_is_a_point():
    tail = tails([TrailLine(0.1)], np.array([[1.0, 2.0, 3.0]]))
    np.testing.assert_array_equal(tail, np.tile([1.0, 2.0, 3.0], (CHUNK, 2, 1)))


def test_every_vehicle_has_its_own_part_of_the_fleets_lines():
    fleet, ends_m = [TrailLine(0.05), TrailLine(0.05)], np.array([[1.0, 2.0, 1.5], [2.0, 2.0, 1.5]])
    for line, metres in zip(fleet, (1.0, 2.0), strict=True):
        line.take(flown(metres))
    together = tails(fleet, ends_m)
    for index, line in enumerate(fleet):
        own = together[index * CHUNK : (index + 1) * CHUNK]
        np.testing.assert_array_equal(own, tails([line], ends_m[index : index + 1]))


def companion(state: CompanionState = CompanionState.FLYING, revision: int = 1, end_m: float = 8.0) -> CompanionView:
    east = np.concatenate(([0.0, 0.0], np.linspace(0.0, end_m, 6), [end_m, end_m]))
    points_m = np.stack((east, np.zeros(10), np.full(10, 1.5)), axis=1)
    status = CompanionStatus(state=state)
    return CompanionView(0.0, status, Trajectory(points_m, 1.7e9, 0.5), revision)


def ahead(companion: CompanionView, vehicle_m: Array, *, alive: bool = True, line: AheadLine | None = None) -> Array:
    line = line or AheadLine()
    line.take(companion, alive=alive)
    return ways_ahead([line], vehicle_m[None])


def test_what_lies_ahead_begins_at_the_vehicle_and_ends_where_its_trajectory_does():
    vehicle_m = np.array([3.0, 0.1, 1.5])
    segments = ahead(companion(), vehicle_m)
    assert segments.shape == (AHEAD, 2, 3)
    np.testing.assert_allclose(segments[0, 0], vehicle_m)
    np.testing.assert_allclose(segments[-1, 1], [8.0, 0.0, 1.5])
    np.testing.assert_allclose(segments[:-1, 1], segments[1:, 0])
    assert np.all(segments[:, 1, 0] > 3.0)  # nothing of what it has flown already


def test_at_the_end_of_its_trajectory_nothing_lies_ahead():
    segments = ahead(companion(), np.array([8.0, 0.0, 1.5]))
    np.testing.assert_allclose(segments.reshape(-1, 3), np.tile([8.0, 0.0, 1.5], (2 * AHEAD, 1)), atol=1e-9)


def test_a_new_trajectory_replaces_the_old_one():
    line, vehicle_m = AheadLine(), np.array([1.0, 0.0, 1.5])
    ahead(companion(), vehicle_m, line=line)
    segments = ahead(companion(revision=2, end_m=4.0), vehicle_m, line=line)
    np.testing.assert_allclose(segments[-1, 1], [4.0, 0.0, 1.5])


def test_a_companion_that_does_not_steer_or_is_silent_has_nothing_ahead():
    vehicle_m = np.array([3.0, 0.0, 1.5])
    nothing = np.tile(vehicle_m, (AHEAD, 2, 1))
    for state in (CompanionState.READY, CompanionState.HOLDING, CompanionState.RELEASED):
        np.testing.assert_array_equal(ahead(companion(state), vehicle_m), nothing)
    np.testing.assert_array_equal(ahead(companion(), vehicle_m, alive=False), nothing)
    np.testing.assert_array_equal(ahead(CompanionView(), vehicle_m), nothing)
