"""The lidar's driver: whole scans out of datagrams that come as they please."""

import numpy as np
import pytest

from companion.sensing.intake import AHEAD_S, OLDEST_S, Dropped
from companion.sensing.lidar import MOST_PACKETS, LidarDriver
from companion.sensing.pose_history import PoseHistory
from missions.lidar_packets import MOUNT_FLU_M
from tests.unit.companion.sensing.bench import FRAME, NOW_S, datagram, poses, turned


def driver() -> LidarDriver:
    return LidarDriver(range_m=5.0, body_radius_m=0.2)


def heard(*datagrams: bytes, now_s: float = NOW_S) -> LidarDriver:
    lidar = driver()
    for raw in datagrams:
        lidar.receive(raw, now_s)
    return lidar


def taken(lidar: LidarDriver, history: PoseHistory | None = None, now_s: float = NOW_S + 0.02):
    return lidar.take(history or poses(), FRAME, now_s)


# ------------------------------------------------------------------- where points are
def test_points_are_placed_in_the_missions_frame():
    scan = taken(heard(datagram(1, [(2.0, 0.0, 0.0), (0.0, 1.0, 0.5)])))
    np.testing.assert_allclose(scan.points_enu_m, [[5.0, 8.0, 1.5], [4.0, 6.0, 2.0]], atol=2e-3)
    np.testing.assert_allclose(scan.sensor_enu_m, np.array([5.0, 6.0, 1.5]) + MOUNT_FLU_M, atol=2e-3)
    assert (scan.time_s, scan.range_m) == (NOW_S, 5.0)


def test_a_tilted_vehicle_sees_the_wall_where_it_stands():
    nose_down = poses(attitude=turned((0.0, 1.0, 0.0), -20.0))
    ray = 2.0 * np.array([np.cos(np.radians(20.0)), 0.0, np.sin(np.radians(20.0))])
    scan = taken(heard(datagram(1, [ray])), nose_down)
    np.testing.assert_allclose(scan.points_enu_m, [[5.0, 8.0, 1.5]], atol=2e-3)


def test_each_packet_is_placed_where_the_vehicle_was_at_its_own_time():
    """A lidar that scans while it moves at 3 m/s: the same wall, seen from two places."""
    moving = poses(velocity_enu_m_s=(0.0, 3.0, 0.0))
    early = datagram(1, [(2.15, 0.0, 0.0)], time_s=NOW_S - 0.05)
    scan = taken(heard(early, datagram(2, [(2.0, 0.0, 0.0)])), moving)
    np.testing.assert_allclose(scan.points_enu_m[:, 1], 8.0, atol=2e-3)


def test_the_vehicle_itself_and_what_lies_beyond_its_range_are_no_obstacles():
    scan = taken(heard(datagram(1, [(0.1, 0.1, 0.0), (2.0, 0.0, 0.0), (9.0, 0.0, 0.0), (2e6, 2e6, 2e6)])))
    assert len(scan.points_enu_m) == 1


def test_a_scan_without_hits_is_a_scan():
    scan = taken(heard(datagram(1, [])))
    assert scan.points_enu_m.shape == (0, 3)


# ---------------------------------------------------------------- what makes a scan
def test_the_packets_of_one_frame_are_one_scan_in_whatever_order_they_come():
    packets = [datagram(n, [(1.0 + n / 10, 0.0, 0.0)]) for n in range(6)]
    in_order, shuffled = taken(heard(*packets)), taken(heard(*(packets[n] for n in (3, 0, 5, 1, 4, 2))))
    assert len(in_order.points_enu_m) == 6
    np.testing.assert_allclose(np.sort(in_order.points_enu_m, axis=0), np.sort(shuffled.points_enu_m, axis=0))


def test_a_scan_is_handed_out_once_and_not_before_it_is_whole_and_its_pose_known():
    lidar = heard(datagram(1))
    assert taken(lidar, now_s=NOW_S) is None, "more packets may come"
    until_then = PoseHistory()
    until_then.add(NOW_S - 0.1, np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    assert taken(lidar, until_then) is None, "no pose reaches so far yet"
    assert taken(lidar) is not None
    assert taken(lidar) is None


def test_a_packet_of_the_next_frame_says_that_a_scan_is_whole():
    lidar = heard(datagram(1, time_s=NOW_S - 0.1), datagram(2, frame=8))
    scan = taken(lidar, now_s=NOW_S)
    assert scan.time_s == pytest.approx(NOW_S - 0.1)


def test_a_device_that_was_restarted_is_heard_at_once():
    lidar = heard(datagram(60_000, frame=200, time_s=NOW_S - 0.1), now_s=NOW_S - 0.1)
    assert taken(lidar, now_s=NOW_S - 0.05) is not None
    lidar.receive(datagram(0, frame=0), NOW_S)
    assert taken(lidar).time_s == NOW_S
    assert not lidar.dropped


def test_after_a_reboot_of_the_autopilot_the_new_clock_counts():
    lidar = heard(datagram(1))
    lidar.forget()
    lidar.receive(datagram(2, time_s=3.0), 3.0)
    rebooted = PoseHistory()
    for time_s in (2.95, 3.05):
        rebooted.add(time_s, np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    assert taken(lidar, rebooted, now_s=3.05).time_s == 3.0


# ----------------------------------------------------- what is dropped, and counted
def test_lost_packets_are_counted_until_they_come_late():
    lidar = heard(datagram(65_534), datagram(2))
    assert lidar.lost == 3
    lidar.receive(datagram(0), NOW_S)
    assert lidar.lost == 2


@pytest.mark.parametrize(
    ("raw", "why"),
    [
        (b"", Dropped.MALFORMED),
        (b"\0" * 36, Dropped.MALFORMED),
        (datagram(1)[:-1], Dropped.MALFORMED),
        (datagram(1)[:-1] + b"\1", Dropped.MALFORMED),
        (datagram(1, time_s=NOW_S - OLDEST_S - 0.1), Dropped.CLOCK),
        (datagram(1, time_s=NOW_S + AHEAD_S + 0.1), Dropped.CLOCK),
    ],
)
def test_what_is_no_packet_of_this_vehicle_and_time_is_counted_and_dropped(raw: bytes, why: Dropped):
    lidar = heard(raw)
    assert dict(lidar.dropped) == {why: 1}
    assert taken(lidar) is None
    assert lidar.heard_s == -np.inf


def test_a_packet_that_comes_twice_counts_once():
    lidar = heard(datagram(1), datagram(1))
    assert lidar.dropped[Dropped.TWICE] == 1
    assert len(taken(lidar).points_enu_m) == 1


def test_a_packet_of_a_scan_that_was_handed_out_is_late():
    lidar = heard(datagram(1))
    taken(lidar)
    lidar.receive(datagram(2), NOW_S + 0.03)
    assert lidar.dropped[Dropped.LATE] == 1
    assert taken(lidar, now_s=NOW_S + 0.06) is None


def test_a_flood_of_packets_does_not_grow_the_memory():
    lidar = driver()
    for number in range(MOST_PACKETS + 10):
        lidar.receive(datagram(number), NOW_S)
    assert lidar.dropped[Dropped.TOO_MANY] == 10
    assert len(taken(lidar).points_enu_m) == MOST_PACKETS


def test_without_poses_scans_are_dropped_when_they_are_old():
    lidar = heard(datagram(1))
    assert taken(lidar, PoseHistory()) is None
    assert taken(lidar, PoseHistory(), now_s=NOW_S + OLDEST_S + 0.1) is None
    assert lidar.dropped[Dropped.NO_POSE] == 1
    assert taken(lidar) is None
