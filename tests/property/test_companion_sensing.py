"""Whatever comes in on a sensor's port: nothing is raised, nothing grows, and no point comes from nowhere."""

import json

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from companion.sensing.intake import AHEAD_S, OLDEST_S
from companion.sensing.lidar import MOST_PACKETS, LidarDriver
from companion.sensing.obstacle_distance import ObstacleDistanceDriver
from missions.lidar_packets import LidarPacket, LidarPacketError, pack, unpack
from tests.unit.companion.sensing.bench import FRAME, NOW_S, datagram, poses

HISTORY = poses()

coordinates = st.floats(-100.0, 100.0, allow_nan=False)
packets = st.builds(
    lambda time_s, frame, number, points: pack(LidarPacket(time_s, frame, number, np.array(points).reshape(-1, 3))),
    st.floats(NOW_S - 1.0, NOW_S + 0.5),
    st.integers(0, 255),
    st.integers(0, 65535),
    st.lists(st.tuples(coordinates, coordinates, coordinates), max_size=5),
)
damaged = st.builds(
    lambda raw, at, bit: raw[: at % len(raw)] + bytes([raw[at % len(raw)] ^ 1 << bit]) + raw[at % len(raw) + 1 :],
    packets,
    st.integers(0, 10_000),
    st.integers(0, 7),
)


@given(st.lists(st.one_of(st.binary(max_size=200), packets, damaged), max_size=30))
def test_no_datagram_upsets_the_lidar_driver(datagrams: list[bytes]):
    lidar = LidarDriver(range_m=5.0, body_radius_m=0.2)
    for step, raw in enumerate(datagrams):
        now_s = NOW_S - 0.1 + 0.005 * step
        lidar.receive(raw, now_s)
        scan = lidar.take(HISTORY, FRAME, now_s)
        if scan is not None:
            away_m = np.linalg.norm(scan.points_enu_m - [5.0, 6.0, 1.5], axis=1)
            assert np.all((away_m > 0.19) & (away_m < 5.6))
            assert now_s - OLDEST_S - 1e-6 <= scan.time_s <= now_s + AHEAD_S + 1e-6


@given(st.integers(0, 2**16 - 1), st.permutations(range(12)), st.sets(st.integers(0, 11), max_size=6))
def test_whatever_order_packets_come_in_what_has_come_is_seen_once(first: int, order: list[int], lost: set[int]):
    lidar = LidarDriver(range_m=50.0, body_radius_m=0.2)
    arriving = [number for number in order if number not in lost]
    for number in arriving + arriving[:3]:
        lidar.receive(datagram((first + number) & 0xFFFF, [(1.0 + number, 0.0, 0.0)]), NOW_S)
    scan = lidar.take(HISTORY, FRAME, NOW_S + 0.02)
    north_m = np.sort(scan.points_enu_m[:, 1]) - 6.0
    np.testing.assert_allclose(north_m, [1.0 + number for number in sorted(arriving)], atol=5e-3)
    assert lidar.lost <= len(lost)


@given(packets)
def test_a_packet_says_what_was_put_in_and_damage_is_noticed(raw: bytes):
    packet = unpack(raw)
    assert pack(packet) == raw
    damaged_raw = bytearray(raw)
    damaged_raw[-1] ^= 0x10
    try:
        unpack(bytes(damaged_raw))
    except LidarPacketError:
        return
    raise AssertionError("a damaged packet was read")


@given(st.lists(st.integers(0, 2**32), max_size=MOST_PACKETS // 8), st.integers(0, 3))
def test_a_stream_of_new_frames_is_not_kept(times_us: list[int], repeats: int):
    lidar = LidarDriver(range_m=5.0, body_radius_m=0.2)
    for frame, offset_us in enumerate(times_us * repeats):
        lidar.receive(datagram(frame & 0xFFFF, frame=frame & 0xFF, time_s=NOW_S + offset_us % 100_000 / 1e6), NOW_S)
    kept = [gathering for gathering in (lidar._gathering, lidar._whole) if gathering is not None]
    assert sum(len(gathering.packets) for gathering in kept) <= 2 * MOST_PACKETS


numbers = st.integers(-(2**40), 2**40)
json_values = st.one_of(
    st.none(), st.booleans(), numbers, st.floats(), st.text("a0 -.\x00é", max_size=5), st.lists(numbers, max_size=80)
)
NAMES = ("time_usec", "distances", "max_distance", "increment", "increment_f", "angle_offset", "frame")


@given(st.one_of(st.binary(max_size=100), st.dictionaries(st.sampled_from(NAMES), json_values)))
def test_no_message_upsets_the_ring_driver(content: bytes | dict):
    ring = ObstacleDistanceDriver(0.1, 0.5, lambda points: np.zeros(len(points)))
    usual = {"time_usec": round(NOW_S * 1e6), "distances": [100] * 72, "max_distance": 500, "increment": 5, "frame": 12}
    raw = content if isinstance(content, bytes) else json.dumps(usual | content).encode()
    ring.receive(raw, NOW_S)
    scan = ring.take(HISTORY, FRAME, NOW_S + 0.02)
    assert scan is None or np.all(np.isfinite(scan.points_enu_m))
