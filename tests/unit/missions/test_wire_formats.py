"""Mission items, TUNNEL payloads, fault specifications and MAVLink's extension fields."""

import importlib
import math
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from missions.errors import MissionError, WireFormatError
from missions.faults import EXAMPLES, CompanionHang, CompanionKill, format_fault, parse_fault
from missions.frames import GeodeticPoint, LocalFrame
from missions.mavlink_extensions import EXTENSIONS, add_extension_fields
from missions.mission_items import Command, MissionItem, Track, decode_track, encode_track, plan_id
from missions.trajectory import Trajectory
from missions.tunnel import (
    MAX_PAYLOAD_BYTES,
    RECEIPT_COUNTS,
    CompanionState,
    CompanionStatus,
    Reason,
    Receipt,
    TrajectoryKind,
    TrajectoryMessage,
    decode_receipt,
    decode_status,
    decode_trajectory,
    encode_receipt,
    encode_status,
    encode_trajectory,
)

FRAME = LocalFrame(GeodeticPoint(latitude_deg=47.4, longitude_deg=8.5, altitude_amsl_m=489.4))
TRACK = Track(np.array([[1, 6.5, 1.5], [7, 4, 1.5], [13, 5, 2.0], [19, 8.5, 1.5]]), np.array([3.0, 3.0, 1.0, 1.0]))


def items(**options: float) -> tuple[MissionItem, ...]:
    return encode_track(TRACK, FRAME, acceptance_radius_m=0.3, **options)


def test_a_track_survives_the_wire_to_a_centimetre():
    track = decode_track(items(ground_offset_m=0.7), FRAME, ground_offset_m=0.7)
    np.testing.assert_allclose(track.points_m, TRACK.points_m, atol=0.012)  # latitude travels in units of 1.1 cm
    assert track.speeds_m_s.tolist() == TRACK.speeds_m_s.tolist()


def test_speeds_travel_only_where_they_change():
    commands = [item.command for item in items()]
    change, waypoint = Command.DO_CHANGE_SPEED, Command.NAV_WAYPOINT
    assert commands == [change, waypoint, waypoint, change, waypoint, waypoint]
    assert decode_track(items(), FRAME).item_seq == (1, 2, 4, 5)


def test_the_ground_offset_is_added_for_the_autopilot_which_will_read_too_high():
    assert items(ground_offset_m=0.7)[1].z - items()[1].z == pytest.approx(0.7)


def test_no_mission_begins_with_a_take_off_and_landing_comes_last():
    landing = encode_track(TRACK, FRAME, acceptance_radius_m=0.3, ending=Command.NAV_LAND)
    assert landing[-1].command == Command.NAV_LAND
    assert landing[-1].z == pytest.approx(489.4, abs=1e-3)
    assert 22 not in {item.command for item in landing}


def test_the_plan_id_is_that_of_what_is_flown_and_of_nothing_else():
    moved = Track(TRACK.points_m + [0.0, 0.0, 0.01], TRACK.speeds_m_s)
    assert plan_id(items()) == plan_id(items()) != plan_id(encode_track(moved, FRAME, acceptance_radius_m=0.3))
    turned = [msgspec.structs.replace(item, param4=0.0) for item in items()]
    assert plan_id(turned) == plan_id(items()), "yaw NaN comes back from autopilots in many ways"
    assert plan_id(()) == 0


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"command": 99}, "command 99 is not understood"),
        ({"frame": 3}, "expected frame 5"),
        ({"x": 2_000_000_000}, "is no place"),
        ({"z": math.nan}, "is no place"),
        ({"command": 178, "param2": -5.0}, "expected a speed"),
        ({"command": 178, "param2": math.nan}, "expected a speed"),
        ({"command": 21}, "to be the last item"),
    ],
)
def test_items_that_cannot_be_flown_are_refused_with_their_number(changes: dict[str, float], problem: str):
    broken = list(items())
    broken[2] = msgspec.structs.replace(broken[2], **changes)
    with pytest.raises(WireFormatError, match="mission item 2") as caught:
        decode_track(broken, FRAME)
    assert problem in str(caught.value)


def test_a_mission_without_a_waypoint_is_no_track():
    with pytest.raises(WireFormatError, match="no waypoint"):
        decode_track([], FRAME)


def test_the_current_item_names_a_track_point():
    track = decode_track(items(), FRAME)
    assert [track.index_of(seq) for seq in (0, 1, 2, 3, 4, 5, 99)] == [0, 0, 1, 2, 2, 3, 3]


STATUS = CompanionStatus(
    state=CompanionState.HOLDING,
    reason=Reason.NO_PATH,
    mission_digest=0xDEADBEEF,
    plan_id=0xFFFFFFFF,
    track_index=3,
    replans=41,
    replan_p50_ms=1.25,
    replan_p99_ms=7.5,
    tracking_error_p99_m=0.123,
    tick_lateness_max_ms=3.2,
    time_boot_ms=123456,
)


def test_a_status_survives_the_wire():
    assert decode_status(encode_status(STATUS)) == STATUS


def test_figures_that_are_too_large_are_sent_as_the_largest():
    absurd = msgspec.structs.replace(STATUS, replans=10**9, replan_p99_ms=1e9)
    assert decode_status(encode_status(absurd)).replans == 0xFFFF


def test_a_receipt_survives_the_wire_and_its_count_wraps():
    receipt = Receipt(heard=41, time_boot_ms=123456, age_s=0.25)
    assert decode_receipt(encode_receipt(receipt)) == receipt
    wrapped = Receipt(heard=41 + RECEIPT_COUNTS, time_boot_ms=123456 + 2**32, age_s=0.25)
    assert decode_receipt(encode_receipt(wrapped)) == receipt
    assert decode_receipt(encode_receipt(Receipt(heard=0, time_boot_ms=0, age_s=1e6))).age_s == pytest.approx(65.535)


def trajectory_message(n_points: int = 12) -> TrajectoryMessage:
    points = np.cumsum(np.full((n_points, 3), 0.25), axis=0)
    trajectory = Trajectory(points, start_s=1_700_000_000.25, knot_interval_s=0.4)
    return TrajectoryMessage(
        kind=TrajectoryKind.COMMITTED,
        plan_id=7,
        revision=3,
        radius_m=0.2,
        trajectory=trajectory,
        announced_s=1_700_000_000.125,
        age_s=0.5,
        rank=9,
    )


def test_a_trajectory_of_twelve_points_takes_116_bytes_and_survives_the_wire():
    payload = encode_trajectory(trajectory_message())
    back = decode_trajectory(payload)
    assert len(payload) == 116
    np.testing.assert_allclose(back.trajectory.control_points_m, trajectory_message().trajectory.control_points_m)
    assert back.trajectory.start_s == pytest.approx(1_700_000_000.25, abs=1e-6)
    assert back.announced_s == pytest.approx(1_700_000_000.125, abs=1e-4)
    assert (back.kind, back.plan_id, back.revision) == (TrajectoryKind.COMMITTED, 7, 3)
    assert (back.radius_m, back.age_s, back.rank) == (0.2, 0.5, 9)


def test_a_slow_climb_over_minutes_survives_the_wire():
    slow = trajectory_message()
    slow = msgspec.structs.replace(slow, trajectory=replace(slow.trajectory, knot_interval_s=65.5361))
    assert decode_trajectory(encode_trajectory(slow)).trajectory.knot_interval_s == pytest.approx(65.5361)


def test_a_trajectory_that_does_not_fit_is_refused():
    with pytest.raises(ValueError, match="do not fit"):
        encode_trajectory(trajectory_message(n_points=15))
    assert len(encode_trajectory(trajectory_message(n_points=14))) <= MAX_PAYLOAD_BYTES


@given(payload=st.binary(max_size=128))
def test_random_payloads_decode_or_are_refused_and_nothing_else(payload: bytes):
    for decode in (decode_status, decode_trajectory, decode_receipt):
        try:
            decode(payload)
        except WireFormatError:
            continue


@given(cut=st.integers(0, 115))
def test_truncated_trajectories_are_refused(cut: int):
    with pytest.raises(WireFormatError):
        decode_trajectory(encode_trajectory(trajectory_message())[:cut])


def test_faults_are_written_as_they_are_read():
    assert [format_fault(parse_fault(text)) for text in EXAMPLES] == list(EXAMPLES)
    assert parse_fault("companion-kill:vehicle=2,at_s=1.5") == CompanionKill(vehicle=2, at_s=1.5)
    assert isinstance(parse_fault("companion-hang:vehicle=1,at_s=0"), CompanionHang)


@pytest.mark.parametrize(
    "text", ["", "flood", "companion-kill", "companion-kill:vehicle=0,at_s=1", "companion-kill:vehicle=1,at_s=nan"]
)
def test_faults_that_are_none_are_refused_with_an_example(text: str):
    with pytest.raises(MissionError, match="companion-kill:vehicle=1"):
        parse_fault(text)


def test_extension_fields_are_added_once_and_travel():
    dialect = importlib.import_module("pymavlink.dialects.v20.common")
    add_extension_fields(dialect)
    add_extension_fields(dialect)
    sender = dialect.MAVLink(None, 1, 1)
    frame = dialect.MAVLink_mission_current_message(3, 10, mission_id=77, rally_points_id=5).pack(sender)
    received = dialect.MAVLink(None).parse_buffer(bytearray(frame))[0]
    assert (received.seq, received.total, received.mission_id, received.rally_points_id) == (3, 10, 77, 5)
    for name, fields in EXTENSIONS.items():
        known = next(kind for kind in dialect.mavlink_map.values() if kind.msgname == name).fieldnames
        assert known.count(fields[0][0]) == 1


def test_a_frame_without_the_extension_reads_as_zero():
    dialect = importlib.import_module("pymavlink.dialects.v20.common")
    add_extension_fields(dialect)
    ack = dialect.MAVLink_mission_ack_message(255, 190, 0, 0)
    received = dialect.MAVLink(None).parse_buffer(bytearray(ack.pack(dialect.MAVLink(None, 1, 1))))[0]
    assert received.opaque_id == 0
