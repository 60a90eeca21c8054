"""Trails and what lies ahead, as lines."""

import numpy as np
import pytest

from gcs.fleet.vehicle_state import CompanionView
from gcs.flight.trails import Trail
from gcs.view.lines import (
    AHEAD,
    BATCH,
    CHUNK,
    MERGE,
    MOST_OF_ALL,
    Array,
    FleetTrails,
    SealedLine,
    SealedLines,
    WaysAhead,
    joined_where,
    thinned,
)
from gcs.view.shapes import polyline
from missions.trajectory import Trajectory
from missions.tunnel import CompanionState, CompanionStatus


def flown(metres: float, step_m: float = 0.1) -> Trail:
    """A flight eastwards."""
    trail = Trail()
    for index, east_m in enumerate(np.arange(0.0, metres, step_m)):
        trail.append(index * 0.1, np.array([east_m, 2.0, 1.5]), np.zeros(3))
    return trail


def go_on(trail: Trail, step_m: float = 0.1) -> None:
    trail.append(trail.times_s[-1] + 0.1, trail.newest_m + np.array([step_m, 0.0, 0.0]), np.zeros(3))


def drawn(chunks: list[tuple[int, Array]], tail: Array) -> Array:
    return np.concatenate([*(polyline(points_m) for _, points_m in chunks), tail])


@pytest.mark.parametrize("live", [True, False])
def test_a_trail_is_drawn_whole_and_without_gaps_whether_it_is_seen_growing_or_late(live: bool):
    trail, lines, chunks = flown(0.05), FleetTrails(1, spacing_m=0.05), []
    for _ in range(200):
        go_on(trail)
        chunks += lines.take([trail]) if live else []
    chunks += lines.take([trail])
    now_m = np.array([[20.0, 2.0, 1.5]])
    segments = drawn(chunks, lines.segments(now_m))
    np.testing.assert_allclose(segments[0, 0], [0.0, 2.0, 1.5], atol=0.11)
    np.testing.assert_allclose(segments[-1, 1], now_m[0])
    np.testing.assert_allclose(segments[:-1, 1], segments[1:, 0])
    assert np.all(np.diff(segments[:, 0, 0]) < 0.1 + 1e-5)
    assert all(points_m.shape == (CHUNK + 1, 3) for _, points_m in chunks)
    assert len(chunks) in {19, 20}


def test_sealed_chunks_are_handed_out_once_and_the_tail_keeps_its_size():
    lines, trail, now_m = FleetTrails(1, spacing_m=0.05), flown(4.0), np.zeros((1, 3))
    assert len(lines.take([trail])) == 3
    assert lines.take([trail]) == []
    for _ in range(3 * CHUNK):
        go_on(trail)
        lines.take([trail])
        assert lines.segments(now_m).shape == (CHUNK, 2, 3)


def test_a_hovering_vehicle_leaves_no_trail():
    lines, trail = FleetTrails(1, spacing_m=0.5), flown(0.05)
    for step in range(50):
        go_on(trail, 0.1 * (-1) ** step)
        assert lines.take([trail]) == []
    tail = lines.segments(np.array([[0.4, 2.0, 1.5]]))
    np.testing.assert_allclose(tail[1:], np.tile([0.4, 2.0, 1.5], (CHUNK - 1, 2, 1)))


def test_before_anything_is_known_the_tail_is_a_point():
    lines = FleetTrails(1, 0.1)
    assert lines.take([None]) == []
    np.testing.assert_array_equal(lines.segments(np.array([[1.0, 2.0, 3.0]])), np.tile([1.0, 2.0, 3.0], (CHUNK, 2, 1)))


def test_every_vehicle_has_its_own_part_of_the_fleets_lines():
    ends_m = np.array([[0.7, 2.0, 1.5], [0.9, 2.0, 1.5]])
    fleet = FleetTrails(2, 0.05)
    fleet.take([flown(0.7), flown(0.9)])
    together = fleet.segments(ends_m)
    for index, metres in enumerate((0.7, 0.9)):
        alone = FleetTrails(1, 0.05)
        alone.take([flown(metres)])
        own = together[index * CHUNK : (index + 1) * CHUNK]
        np.testing.assert_array_equal(own, alone.segments(ends_m[index : index + 1]))


def test_a_straight_line_is_thinned_to_its_ends_and_a_bend_is_kept():
    straight = np.column_stack((np.arange(11.0), np.zeros(11), np.zeros(11)))
    angles = np.linspace(0.0, np.pi, 11)
    bend = 5.0 * np.stack((np.cos(angles), np.sin(angles), np.zeros(11)), axis=1)
    both = np.array([straight, bend])
    needed = thinned(both, 0.01)
    assert needed[0].sum() <= 4
    assert needed[1].all()
    assert thinned(both, 10.0)[:, [0, -1]].all()
    segments, of_line = joined_where(both, needed)
    np.testing.assert_array_equal(segments[of_line == 1], polyline(bend))
    np.testing.assert_array_equal(segments[of_line == 0][[0, -1], [0, 1]], straight[[0, -1]])


def test_a_corner_between_straight_ways_stays_where_it_is():
    for corner in range(1, 10):
        way = np.zeros((1, 11, 3))
        way[0, :, 0], way[0, :, 1] = np.minimum(np.arange(11), corner), np.maximum(np.arange(11) - corner, 0)
        segments, _ = joined_where(way, thinned(way, 0.05))
        along = np.linspace(0.0, 1.0, 201)[:, None, None]
        drawn = (segments[:, 0] + along * (segments[:, 1] - segments[:, 0])).reshape(-1, 3)
        for point in way[0]:
            assert np.linalg.norm(drawn - point, axis=1).min() < 0.1


def seal(sealed: SealedLines, count: int) -> dict[str, SealedLine]:
    """Seal so many chunks of ten segments; the lines that stand then."""
    standing: dict[str, SealedLine] = {}
    for number in range(count):
        points_m = np.column_stack((10.0 * number + np.arange(11.0), np.zeros(11), np.zeros(11)))
        new, gone = sealed.add(polyline(points_m), np.full((10, 3), (number % 256, 0, 0), np.uint8))
        for line in gone:
            del standing[line.name]
        standing |= {line.name: line for line in new}
    return standing


def test_a_long_flight_is_few_lines_and_none_of_it_is_lost():
    sealed, chunks = SealedLines(), 24 * BATCH // 10
    standing = seal(sealed, chunks)
    assert len(standing) < 2 * MERGE
    everything = np.concatenate([*(line.segments for line in standing.values()), sealed.batch])
    lengths = np.linalg.norm(everything[:, 1] - everything[:, 0], axis=1)
    begins = np.sort(everything[lengths > 0.0][:, 0, 0])
    np.testing.assert_array_equal(begins, np.arange(10.0 * chunks))
    for line in standing.values():
        np.testing.assert_array_equal(line.colours[:, 0, 0], (line.segments[:, 0, 0] // 10) % 256)


def test_of_the_longest_flights_the_oldest_part_is_taken_away():
    standing = seal(SealedLines(), 2 * MOST_OF_ALL // 10)
    segments = np.concatenate([line.segments for line in standing.values()])
    assert MOST_OF_ALL - MERGE * BATCH < len(segments) <= MOST_OF_ALL
    newest_m = 2.0 * MOST_OF_ALL - BATCH
    np.testing.assert_array_equal(np.sort(segments[:, 0, 0]), np.arange(newest_m - len(segments), newest_m))


def test_a_page_that_comes_late_takes_in_the_oldest_of_all_vehicles_first():
    chunks = FleetTrails(2, 0.05).take([flown(20.0), flown(10.0)])
    owners = [index for index, _ in chunks]
    assert owners.count(0) > owners.count(1) > 1
    assert owners[0] == 0
    assert owners[-2:] == [0, 1]
    last_m = {index: points_m[-1, 0] for index, points_m in chunks}
    assert last_m[0] == pytest.approx(20.0, abs=1.1)
    assert last_m[1] == pytest.approx(10.0, abs=1.1)


def companion(state: CompanionState = CompanionState.FLYING, revision: int = 1, end_m: float = 8.0) -> CompanionView:
    east = np.concatenate(([0.0, 0.0], np.linspace(0.0, end_m, 6), [end_m, end_m]))
    points_m = np.stack((east, np.zeros(10), np.full(10, 1.5)), axis=1)
    status = CompanionStatus(state=state)
    trajectory = Trajectory(points_m, 1.7e9, 0.5)
    return CompanionView(heard_s=0.0, status=status, trajectory=trajectory, trajectory_revision=revision)


def ahead(companion: CompanionView, vehicle_m: Array, *, now_s: float = 1.0, ways: WaysAhead | None = None) -> Array:
    ways = ways or WaysAhead(1)
    ways.take([companion], now_s)
    return ways.segments(vehicle_m[None])


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
    ways, vehicle_m = WaysAhead(1), np.array([1.0, 0.0, 1.5])
    ahead(companion(), vehicle_m, ways=ways)
    segments = ahead(companion(revision=2, end_m=4.0), vehicle_m, ways=ways)
    np.testing.assert_allclose(segments[-1, 1], [4.0, 0.0, 1.5])


def test_a_companion_that_does_not_steer_or_is_silent_has_nothing_ahead():
    vehicle_m = np.array([3.0, 0.0, 1.5])
    nothing = np.tile(vehicle_m, (AHEAD, 2, 1))
    for state in (CompanionState.READY, CompanionState.HOLDING, CompanionState.RELEASED):
        np.testing.assert_array_equal(ahead(companion(state), vehicle_m), nothing)
    np.testing.assert_array_equal(ahead(companion(), vehicle_m, now_s=10.0), nothing)
    np.testing.assert_array_equal(ahead(CompanionView(), vehicle_m), nothing)
