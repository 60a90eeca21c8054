"""Plans and positions as MAVLink frames; and what becomes of frames that are none."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common as mavlink

from companion.fleet.reports import PlanReport, PositionReport
from companion.link.fleet_frames import FleetFrames
from missions.tunnel import PayloadType, TrajectoryKind, TrajectoryMessage, encode_trajectory
from tests.unit.companion.fleet.talk import BEGIN_S, ROOM, line

PLACE = PositionReport(
    3, BEGIN_S + 0.25, np.array([5.0, 7.0, 1.5]), np.array([1.0, -2.0, 0.5]), error_m=0.1, on_ground=False
)
PLAN = PlanReport(
    3,
    TrajectoryMessage(
        kind=TrajectoryKind.WANTED,
        plan_id=7,
        revision=4,
        radius_m=0.2,
        trajectory=line((5, 5, 1.5), (9, 5, 1.5), BEGIN_S),
        announced_s=BEGIN_S,
        rank=2,
    ),
)


def frames(sysid: int = 3) -> FleetFrames:
    return FleetFrames(sysid, ROOM.frame)


def packed(report: PlanReport | PositionReport) -> bytes:
    datagram = frames().pack(report)
    assert datagram is not None
    return datagram


def test_a_position_survives_as_utm_global_position():
    (back,) = frames(9).read(packed(PLACE))
    assert isinstance(back, PositionReport)
    assert (back.sysid, back.utc_s, back.error_m, back.on_ground) == (3, BEGIN_S + 0.25, 0.1, False)
    np.testing.assert_allclose(back.position_m, PLACE.position_m, atol=0.012)
    np.testing.assert_allclose(back.velocity_m_s, PLACE.velocity_m_s, atol=0.006)


def test_a_vehicle_that_does_not_know_the_time_says_so():
    (back,) = frames(9).read(packed(replace(PLACE, utc_s=None, on_ground=True)))
    assert isinstance(back, PositionReport)
    assert (back.utc_s, back.on_ground) == (None, True)


def test_a_plan_survives_in_a_tunnel():
    (back,) = frames(9).read(packed(PLAN))
    assert isinstance(back, PlanReport)
    assert (back.sysid, back.message.kind, back.message.rank) == (3, TrajectoryKind.WANTED, 2)
    np.testing.assert_allclose(back.message.trajectory.end_m, (9, 5, 1.5), atol=0.006)


def test_a_plan_that_does_not_fit_is_not_told_and_counted():
    far = msgspec.structs.replace(PLAN.message, trajectory=line((0, 0, 0), (900, 0, 0), BEGIN_S))
    writer = frames()
    assert writer.pack(PlanReport(3, far)) is None
    assert writer.dropped == {"too large to be told": 1}


SENDER = mavlink.MAVLink(None, 3, 191)
STRANGER = mavlink.MAVLink(None, 3, 1)


def tunnel(payload: bytes, kind: int = PayloadType.TRAJECTORY, sender: object = SENDER, length: int | None = None):
    padded = list(payload.ljust(128, b"\0"))
    return mavlink.MAVLink_tunnel_message(0, 0, kind, length or len(payload), padded).pack(sender)


@pytest.mark.parametrize(
    ("datagram", "reason"),
    [
        (b"", "no frame"),
        (b"\xfe" + b"\0" * 30, "no frame"),
        (b"\xfd" * 5000, "no frame"),
        (packed(PLACE)[:-1] + b"\0\0", "no frame"),
        (tunnel(b"\x02" * 60), "no plan"),
        (tunnel(encode_trajectory(PLAN.message), sender=STRANGER), "no plan"),
        (tunnel(encode_trajectory(PLAN.message), length=200), "no plan"),
        (tunnel(b"x", kind=PayloadType.COMPANION_STATUS), "not for the fleet"),
        (mavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 4, 3).pack(SENDER), "not for the fleet"),
        (mavlink.MAVLink_utm_global_position_message(0, [0] * 18, *[0] * 14, 3, 0).pack(SENDER), "no position"),
    ],
)
def test_what_is_no_report_is_counted_and_dropped(datagram: bytes, reason: str):
    reader = frames(9)
    assert list(reader.read(datagram)) == []
    assert reader.dropped[reason] >= 1


@given(datagrams=st.lists(st.binary(max_size=300).map(lambda rest: b"\xfd" + rest), max_size=5))
def test_after_any_garbage_the_next_frame_is_read(datagrams: list[bytes]):
    reader = frames(9)
    for datagram in datagrams:
        list(reader.read(datagram))
    assert [type(report) for report in reader.read(packed(PLACE))] == [PositionReport]
