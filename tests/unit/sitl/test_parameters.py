"""The parameter protocol: bytewise values, PX4's silences, and no value that could stop the simulator."""

import math
import struct

import numpy as np
import pytest

from sitl.autopilot.parameter_table import parameter_table
from sitl.autopilot.parameters import Parameters
from sitl.control.gains import GAINS
from sitl.dialect import mavlink
from sitl.dynamics.airframe import SIH, X500_LIKE
from sitl.microservices.outbox import Link
from tests.unit.sitl.flown import GCS, NAN, Flown

INT32, REAL32, UINT32 = 6, 9, 5


def set_parameter(flown: Flown, name: str, raw: bytes, kind: int, *, link: Link = Link.GROUND, target=(1, 1)) -> None:
    """A PARAM_SET whose value has exactly these four bytes."""
    frame = bytearray(
        mavlink.MAVLink_param_set_message(*target, name.encode(), 1.0, kind).pack(mavlink.MAVLink(None, *GCS))
    )
    frame[10:14] = raw
    crc = mavlink.x25crc(frame[1:-2])
    crc.accumulate(bytes([mavlink.MAVLink_param_set_message.crc_extra]))
    frame[-2:] = struct.pack("<H", crc.crc)
    flown.simulator.receive(1, link, bytes(frame))
    flown.run(0.02)


def values(flown: Flown, link: Link = Link.GROUND) -> list[tuple[str, float, int]]:
    return [(m.param_id, m.param_value, m.param_type) for m in flown.messages("PARAM_VALUE", link=link)]


def test_the_list_begins_with_the_hash_and_is_complete_on_the_asking_link():
    flown = Flown().boot()
    flown.send(mavlink.MAVLink_param_request_list_message(1, 1), link=Link.ONBOARD)
    flown.run(0.3)
    listed = flown.messages("PARAM_VALUE", link=Link.ONBOARD)
    names = [m.param_id for m in listed]
    assert (names[0], listed[0].param_index, listed[0].param_type) == ("_HASH_CHECK", 65535, UINT32)
    assert names[1:] == sorted(names[1:])
    assert [m.param_index for m in listed[1:]] == list(range(listed[1].param_count))
    assert not values(flown, Link.GROUND)


def test_a_new_value_comes_back_twice_and_once_on_the_other_link():
    flown = Flown().boot()
    set_parameter(flown, "MIS_TAKEOFF_ALT", struct.pack("<f", 5.0), REAL32)
    assert values(flown) == [("MIS_TAKEOFF_ALT", 5.0, REAL32)] * 2
    assert values(flown, Link.ONBOARD) == [("MIS_TAKEOFF_ALT", 5.0, REAL32)]
    flown.forget()
    set_parameter(flown, "MIS_TAKEOFF_ALT", struct.pack("<f", 5.0), REAL32)
    assert len(values(flown)) == 1
    assert not values(flown, Link.ONBOARD)


@pytest.mark.parametrize("value", [5, -1, 77, 2**31 - 1, 0x7F800001])
def test_integers_keep_every_bit(value):
    flown = Flown().boot()
    set_parameter(flown, "COM_OBL_RC_ACT", struct.pack("<i", value), INT32)
    assert flown.autopilot.parameters.stored("COM_OBL_RC_ACT") == value
    flown.forget()
    flown.send(mavlink.MAVLink_param_request_read_message(1, 1, b"COM_OBL_RC_ACT", -1))
    assert bytes(flown.last("PARAM_VALUE").get_msgbuf()[10:14]) == struct.pack("<i", value)


@pytest.mark.parametrize(
    ("name", "kind", "target"),
    [
        ("NO_SUCH_NAME", REAL32, (1, 1)),
        ("COM_OBL_RC_ACT", REAL32, (1, 1)),
        ("MIS_TAKEOFF_ALT", INT32, (1, 1)),
        ("_HASH_CHECK", UINT32, (1, 1)),
        ("MIS_TAKEOFF_ALT", REAL32, (2, 1)),
        ("MIS_TAKEOFF_ALT", REAL32, (0, 0)),
    ],
)
def test_what_px4_does_not_know_it_meets_with_silence(name, kind, target):
    flown = Flown().boot()
    set_parameter(flown, name, struct.pack("<f", 7.0), kind, target=target)
    assert values(flown) == []


@pytest.mark.parametrize("value", [NAN, math.inf, -math.inf])
def test_numbers_that_are_none_are_answered_with_the_old_value(value):
    flown = Flown().boot()
    set_parameter(flown, "MPC_XY_CRUISE", struct.pack("<f", value), REAL32)
    assert values(flown) == [("MPC_XY_CRUISE", 5.0, REAL32)]


def test_reading_by_index_by_name_and_past_the_end():
    flown = Flown().boot()
    flown.send(mavlink.MAVLink_param_request_read_message(1, 1, b"", 0))
    flown.send(mavlink.MAVLink_param_request_read_message(1, 1, b"_HASH_CHECK", -1))
    flown.send(mavlink.MAVLink_param_request_read_message(1, 1, b"", 30000))
    flown.send(mavlink.MAVLink_param_request_read_message(1, 1, b"NOPE", -1))
    assert [name for name, _, _ in values(flown)] == ["BAT_CRIT_THR", "_HASH_CHECK"]


def test_the_hash_changes_with_a_value_and_only_then():
    flown = Flown().boot()
    first = flown.autopilot.parameters.hash_check()
    assert Flown().boot().autopilot.parameters.hash_check() == first
    flown.set_parameter("MPC_XY_CRUISE", 3.0)
    assert flown.autopilot.parameters.hash_check() != first


def test_every_gain_of_the_control_is_a_parameter():
    for airframe in (X500_LIKE, SIH):
        assert set(GAINS.names) <= {parameter.name for parameter in parameter_table(airframe)}


def test_defaults_are_within_what_is_applied():
    for parameter in parameter_table(X500_LIKE):
        assert parameter.low <= parameter.default <= parameter.high, parameter.name


@pytest.mark.parametrize("extreme", [-3.4e38, -1.0, 0.0, 1e-30, 1e6, 3.4e38])
def test_no_value_stops_the_simulator(extreme):
    flown = Flown().take_off(4.0)
    flown.stream(position=(1.0, 1.0, -4.0)).offboard()
    for name in flown.autopilot.parameters.names:
        value = int(np.clip(extreme, -(2**31), 2**31 - 1)) if flown.autopilot.parameters.is_int(name) else extreme
        flown.autopilot.parameters.set(name, value)
    flown.run(2.0)
    flown.command(176, 1, 4, 3)
    flown.run(2.0)
    truth = flown.simulator.truth
    assert np.isfinite(truth.position_enu_m).all()
    assert np.isfinite(truth.attitude_ned_frd).all()


def test_loss_timeouts_are_shown_as_set_and_applied_in_simulated_time():
    applied = {}
    parameters = Parameters(parameter_table(X500_LIKE), 5.0, applied.__setitem__)
    assert parameters.stored("COM_OF_LOSS_T") == 1.0
    assert parameters["COM_OF_LOSS_T"] == applied["COM_OF_LOSS_T"] == 5.0
    assert parameters["COM_DISARM_LAND"] == 2.0
