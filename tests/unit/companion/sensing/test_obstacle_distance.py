"""OBSTACLE_DISTANCE becomes walls around the vehicle."""

import json

import numpy as np
import pytest

from companion.sensing.intake import Dropped
from companion.sensing.obstacle_distance import UNKNOWN_CM, ObstacleDistanceDriver
from companion.sensing.pose_history import PoseHistory
from tests.unit.companion.sensing.bench import FRAME, NOW_S, poses, turned

FREE = 501
DOWN, RIGHT = (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)


def driver() -> ObstacleDistanceDriver:
    return ObstacleDistanceDriver(spacing_m=0.1, half_height_m=0.5, ground_up_m=lambda points: np.zeros(len(points)))


def ring(*, time_s: float = NOW_S, hits: dict[int, int] | None = None, **fields) -> bytes:
    distances = [FREE] * 72
    for sector, distance_cm in (hits or {}).items():
        distances[sector] = distance_cm
    usual = {"distances": distances, "increment": 5, "max_distance": 500, "frame": 12, "angle_offset": 0.0}
    return json.dumps({"time_usec": round(time_s * 1e6), "increment_f": 0.0, **usual, **fields}).encode()


def seen(raw: bytes, history: PoseHistory | None = None) -> np.ndarray:
    sensor = driver()
    sensor.receive(raw, NOW_S)
    return sensor.take(history or poses(), FRAME, NOW_S + 0.02).points_enu_m


def test_a_hit_is_a_wall_across_its_sector_above_and_below_the_vehicle():
    points = seen(ring(hits={0: 300}))
    np.testing.assert_allclose(np.hypot(*(points[:, :2] - [5.0, 6.0]).T), 3.0, atol=2e-3)
    assert np.ptp(points[:, 0]) == pytest.approx(2.0 * 3.0 * np.sin(np.radians(2.5)), abs=1e-3)
    assert (points[:, 2].min(), points[:, 2].max()) == pytest.approx((1.0, 2.0), abs=2e-3)
    apart = np.diff(np.unique(points[:, 2].round(4)))
    assert apart.max() <= 0.1 + 1e-3


@pytest.mark.parametrize(
    ("fields", "heading_deg", "towards_deg"),
    [
        ({}, 0.0, 90.0),
        ({}, 60.0, 150.0),
        ({"frame": 0}, 60.0, 90.0),
        ({"frame": 1}, 60.0, 90.0),
        ({"angle_offset": 10.0}, 0.0, 100.0),
        ({"increment_f": 2.5}, 0.0, 45.0),
        ({"angle_offset": None, "increment_f": None}, 0.0, 90.0),
    ],
)
def test_sectors_are_counted_clockwise_from_the_nose_or_from_north(fields, heading_deg: float, towards_deg: float):
    points = seen(ring(hits={18: 200}, **fields), poses(attitude=turned(DOWN, heading_deg)))
    east, north = points[:, :2].mean(axis=0) - [5.0, 6.0]
    assert np.degrees(np.arctan2(east, north)) == pytest.approx(towards_deg, abs=0.1)


def test_free_and_unknown_sectors_are_no_walls():
    assert len(seen(ring(hits={3: UNKNOWN_CM, 9: FREE}))) == 0
    assert len(seen(ring(hits={3: UNKNOWN_CM, 9: 500}))) > 0


def test_what_a_tilted_vehicle_sees_below_itself_may_be_the_ground():
    nose_down = poses(attitude=turned(RIGHT, -20.0))
    assert len(seen(ring(hits={0: 400}), nose_down)) == 0
    assert len(seen(ring(hits={0: 150}), nose_down)) > 0
    assert len(seen(ring(hits={36: 400}), nose_down)) > 0, "behind it, it looks up"


@pytest.mark.parametrize(
    ("raw", "why"),
    [
        (b"", Dropped.MALFORMED),
        (b"{}", Dropped.MALFORMED),
        (ring(frame=8), Dropped.MALFORMED),
        (ring(increment=0), Dropped.MALFORMED),
        (ring(increment=181), Dropped.MALFORMED),
        (ring(distances=[100] * 73), Dropped.MALFORMED),
        (ring(distances=["near"]), Dropped.MALFORMED),
        (ring(max_distance=0), Dropped.MALFORMED),
        (ring(time_s=NOW_S - 1.0), Dropped.CLOCK),
        (ring(time_s=NOW_S + 1.0), Dropped.CLOCK),
    ],
)
def test_what_makes_no_sense_is_counted_and_dropped(raw: bytes, why: Dropped):
    sensor = driver()
    sensor.receive(raw, NOW_S)
    assert dict(sensor.dropped) == {why: 1}
    assert sensor.take(poses(), FRAME, NOW_S) is None
    assert sensor.heard_s == -np.inf


def test_each_ring_is_seen_once_and_never_in_the_wrong_order():
    sensor = driver()
    sensor.receive(ring(hits={0: 100}), NOW_S)
    sensor.receive(ring(time_s=NOW_S - 0.1), NOW_S)
    assert sensor.dropped[Dropped.LATE] == 1
    assert len(sensor.take(poses(), FRAME, NOW_S).points_enu_m) > 0
    assert sensor.take(poses(), FRAME, NOW_S) is None


def test_without_a_pose_a_ring_is_dropped_when_it_is_old():
    sensor = driver()
    sensor.receive(ring(), NOW_S)
    assert sensor.take(PoseHistory(), FRAME, NOW_S + 0.1) is None
    assert sensor.take(PoseHistory(), FRAME, NOW_S + 1.0) is None
    assert sensor.dropped[Dropped.NO_POSE] == 1
