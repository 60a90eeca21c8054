"""Messages as MAVSDK hands them over become the pilot's events; what cannot be read is an error, never an event."""

import msgspec
import numpy as np
import pytest

from companion.events import (
    ArmingReported,
    FlightMode,
    HomeReported,
    LandedReported,
    MissionReported,
    ModeReported,
    OriginReported,
    ReceiptHeard,
    Sender,
    UtcReported,
)
from companion.link.messages import EVENTS_OF, CommandLong, OdometryMessage, TunnelMessage, mode_of
from missions.frames import GeodeticPoint
from missions.tunnel import PayloadType, Receipt, encode_receipt

ODOMETRY = {
    "time_usec": 5136000,
    "frame_id": 1,
    "child_frame_id": 1,
    "x": -0.2,
    "y": 0.1,
    "z": 0.04,
    "vx": 1.0,
    "vy": 2.0,
    "vz": 3.0,
    "q": [0.7071068, 0.0, 0.0, 0.7071068],
    "pose_covariance": [0.05, None],
    "reset_counter": 11,
}


def read(name: str, **fields) -> list:
    return EVENTS_OF[name](msgspec.json.encode(fields))


def odometry(**changes) -> OdometryMessage:
    return msgspec.json.decode(msgspec.json.encode(ODOMETRY | changes), type=OdometryMessage)


def test_odometry_has_boot_time_ned_and_heading():
    event = odometry().event()
    assert event.time_s == pytest.approx(5.136)
    np.testing.assert_allclose(event.position_m, [-0.2, 0.1, 0.04])
    np.testing.assert_allclose(event.velocity_m_s, [1.0, 2.0, 3.0])
    assert event.yaw_rad == pytest.approx(np.pi / 2.0, abs=1e-6)


def test_odometry_in_another_frame_is_refused():
    with pytest.raises(ValueError, match="expected position and velocity in frame 1, found 1 and 12"):
        odometry(child_frame_id=12).event()


def test_odometry_without_a_position_is_refused():
    with pytest.raises(msgspec.ValidationError):
        odometry(x=None)


def test_a_heartbeat_tells_mode_and_arming():
    found = read("HEARTBEAT", type=2, autopilot=12, base_mode=157, custom_mode=0x03040000)
    assert found == [ModeReported(FlightMode.HOLD), ArmingReported(True)]
    assert read("HEARTBEAT", base_mode=29, custom_mode=0x00060000)[1] == ArmingReported(False)


@pytest.mark.parametrize(
    ("custom_mode", "mode"),
    [
        (0x00060000, FlightMode.OFFBOARD),
        (0x03040000, FlightMode.HOLD),
        (0x06040000, FlightMode.LAND),
        (0x05040000, FlightMode.RTL),
        (0x02040000, FlightMode.TAKEOFF),
        (0x04040000, FlightMode.MISSION),
        (0x00030000, FlightMode.OTHER),
        (0x0B040000, FlightMode.OTHER),
        (0, FlightMode.OTHER),
    ],
)
def test_px4s_modes_are_told_apart(custom_mode: int, mode: FlightMode):
    assert mode_of(custom_mode) is mode
    assert read("CURRENT_MODE", custom_mode=custom_mode) == [ModeReported(mode)]


def test_landed_states():
    assert read("EXTENDED_SYS_STATE", landed_state=1, vtol_state=0) == [LandedReported(True)]
    assert read("EXTENDED_SYS_STATE", landed_state=4, vtol_state=0) == [LandedReported(False)]
    assert read("EXTENDED_SYS_STATE", landed_state=0, vtol_state=0) == []


def test_a_stored_mission_is_named_by_its_id_or_else_by_its_size():
    assert read("MISSION_CURRENT", seq=3, total=8, mission_id=77) == [MissionReported(77, 3)]
    assert read("MISSION_CURRENT", seq=3, total=8, mission_id=0) == [MissionReported(8, 3)]
    assert read("MISSION_CURRENT", seq=0, total=65535, mission_id=0) == [MissionReported(0, 0)]
    assert read("MISSION_CURRENT", seq=0, total=0, mission_id=5) == [MissionReported(0, 0)]


def test_places_come_in_degrees_and_metres():
    place = GeodeticPoint(latitude_deg=47.3977433, longitude_deg=8.5455924, altitude_amsl_m=489.682)
    fields = {"latitude": 473977433, "longitude": 85455924, "altitude": 489682}
    assert read("GPS_GLOBAL_ORIGIN", **fields) == [OriginReported(place)]
    assert read("HOME_POSITION", **fields, x=0.0, q=[1.0, None, None, None]) == [HomeReported(place)]


def test_utc_is_known_only_when_the_autopilot_knows_it():
    assert read("SYSTEM_TIME", time_unix_usec=1_700_000_010_000_000, time_boot_ms=10_000) == [UtcReported(1.7e9)]
    assert read("SYSTEM_TIME", time_unix_usec=0, time_boot_ms=10_000) == []


@pytest.mark.parametrize("name", sorted(EVENTS_OF))
@pytest.mark.parametrize("fields", [b"", b"{}", b"[]", b'{"custom_mode": "x"}', b"\xff"])
def test_what_cannot_be_read_is_an_error_that_the_link_knows(name: str, fields: bytes):
    with pytest.raises((msgspec.DecodeError, ValueError)):
        EVENTS_OF[name](fields)


def test_a_command_says_whom_it_is_for():
    fields = {"command": 300, "target_system": 2, "target_component": 191, "param1": None, "confirmation": 3}
    command = msgspec.json.decode(msgspec.json.encode(fields), type=CommandLong)
    assert (command.command, command.target_system, command.target_component) == (300, 2, 191)


GROUND = Sender(255, 190)


def tunnel(kind: int, payload: bytes) -> TunnelMessage:
    fields = {"target_system": 1, "target_component": 191, "payload_type": kind, "payload_length": len(payload)}
    padded = list(payload.ljust(128, b"\0"))
    return msgspec.json.decode(msgspec.json.encode({**fields, "payload": padded}), type=TunnelMessage)


def test_a_receipt_in_a_tunnel_is_an_event_and_other_payloads_are_none():
    receipt = Receipt(heard=7, time_boot_ms=4200, age_s=0.125)
    assert tunnel(PayloadType.RECEIPT, encode_receipt(receipt)).receipt(GROUND) == [ReceiptHeard(GROUND, receipt)]
    assert tunnel(PayloadType.OCCUPANCY, encode_receipt(receipt)).receipt(GROUND) == []


def test_a_receipt_that_cannot_be_read_is_an_error():
    with pytest.raises(ValueError, match="expected at least"):
        tunnel(PayloadType.RECEIPT, b"\1").receipt(GROUND)
    damaged = msgspec.json.encode(
        {"target_system": 1, "target_component": 191, "payload_type": 0x8054, "payload_length": 1, "payload": [300]}
    )
    with pytest.raises(ValueError, match="range"):
        msgspec.json.decode(damaged, type=TunnelMessage).receipt(GROUND)
