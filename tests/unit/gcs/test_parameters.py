"""All parameters of a vehicle: fetched, kept, compared with a file."""

import struct

import pytest

from gcs.dialect import mavlink
from gcs.errors import ParameterError
from gcs.microservices.parameter_client import ParameterExchange
from gcs.microservices.parameter_fetch import HASH_CHECK, Parameter, ParameterFetch, ParameterSet
from gcs.microservices.parameter_files import parameter_differences, read_parameters, write_parameters
from sitl.microservices.outbox import Link
from sitl.simulator import Simulator
from tests.unit.gcs.messages import from_autopilot

PEER = (1, 1)
REAL, INT = mavlink.MAV_PARAM_TYPE_REAL32, mavlink.MAV_PARAM_TYPE_INT32
VALUES = {"A_INT": Parameter(-6_000_000, INT), "B_REAL": Parameter(0.5, REAL), "C_INT": Parameter(7, INT)}
HASH = 0xFFA00001
"""The bytes of a float that is no number, and not a quiet one."""


def frame_value(name: str, raw: bytes, kind: int, index: int):
    message = from_autopilot(mavlink.MAVLink_param_value_message(name.encode(), 1.0, kind, len(VALUES), index))
    message.get_msgbuf()[10:14] = raw
    message.param_value = struct.unpack("<f", raw)[0]
    return message


def value(name: str):
    parameter = VALUES[name]
    raw = struct.pack("<i" if parameter.kind == INT else "<f", parameter.value)
    return frame_value(name, raw, parameter.kind, list(VALUES).index(name))


def hash_check(number: int = HASH):
    return frame_value(HASH_CHECK, struct.pack("<I", number), mavlink.MAV_PARAM_TYPE_UINT32, 65535)


def sent(messages: list) -> list[str]:
    return [message.get_type() for message in messages]


def wait_for_ever(fetch: ParameterFetch) -> None:
    for _ in range(100):
        fetch.handle_timeout(fetch.deadline_s)


def test_all_parameters_come_and_missing_ones_are_asked_for_by_index():
    fetch = ParameterFetch(PEER)
    assert sent(fetch.start(0.0)) == ["PARAM_REQUEST_LIST"]
    for message in (hash_check(), value("A_INT"), value("C_INT")):
        fetch.receive(message, 0.1)
    assert [m.param_index for m in fetch.handle_timeout(fetch.deadline_s)] == [1]
    fetch.receive(value("B_REAL"), 1.0)
    assert fetch.done
    assert fetch.result == ParameterSet(VALUES, HASH)


def test_what_is_kept_is_not_fetched_again_while_its_hash_is_the_vehicles():
    fetch = ParameterFetch(PEER, kept=ParameterSet(VALUES, HASH))
    (question,) = fetch.start(0.0)
    assert (question.get_type(), question.param_id) == ("PARAM_REQUEST_READ", HASH_CHECK)
    fetch.receive(hash_check(), 0.1)
    assert fetch.done
    assert fetch.result == ParameterSet(VALUES, HASH)


def test_another_hash_fetches_everything():
    fetch = ParameterFetch(PEER, kept=ParameterSet(VALUES, 1))
    fetch.start(0.0)
    assert sent(fetch.receive(hash_check(), 0.1)) == ["PARAM_REQUEST_LIST"]
    assert not fetch.done


def test_a_vehicle_without_a_hash_is_fetched_whole_and_a_silent_one_is_an_error():
    fetch = ParameterFetch(PEER, kept=ParameterSet(VALUES, HASH))
    asked = fetch.start(0.0)
    for _ in range(5):
        asked = fetch.handle_timeout(fetch.deadline_s)
    assert sent(asked) == ["PARAM_REQUEST_LIST"]
    with pytest.raises(ParameterError, match=r"vehicle 1: 0 of \? parameters came"):
        wait_for_ever(fetch)


def test_echoes_absurd_counts_and_values_that_are_no_numbers_change_nothing():
    fetch = ParameterFetch(PEER)
    fetch.start(0.0)
    fetch.receive(frame_value("A_INT", bytes(4), INT, 65535), 0.1)
    fetch.receive(from_autopilot(mavlink.MAVLink_param_value_message(b"X", 1.0, REAL, 60000, 5)), 0.1)
    fetch.receive(frame_value("B_REAL", struct.pack("<f", float("nan")), REAL, 1), 0.1)
    assert sent(fetch.handle_timeout(fetch.deadline_s)) == ["PARAM_REQUEST_LIST"]


def test_the_simulators_parameters_are_fetched_as_they_are():
    simulator, fetch = Simulator(1, seed=1), ParameterFetch(PEER)
    parser = mavlink.MAVLink(None)
    sender = mavlink.MAVLink(None, 255, 190)

    def send(messages: list) -> None:
        for message in messages:
            simulator.receive(1, Link.GROUND, bytes(message.pack(sender)))

    send(fetch.start(0.0))
    while not fetch.done and simulator.time_s < 10.0:
        simulator.step()
        for _, link, frame in simulator.transmissions():
            message = parser.decode(bytearray(frame)) if link is Link.GROUND else None
            if message is not None and message.get_type() == "PARAM_VALUE":
                send(fetch.receive(message, simulator.time_s))
    assert fetch.result is not None
    assert fetch.result.values["COM_OBL_RC_ACT"].kind == INT
    assert fetch.result.values["MPC_XY_VEL_MAX"].value == pytest.approx(12.0)
    assert fetch.result.hash_check is not None


def test_a_file_reads_back_as_it_was_written_and_says_what_differs():
    text = write_parameters(VALUES, 1)
    assert read_parameters(text) == VALUES
    changed = {**VALUES, "B_REAL": Parameter(0.6, REAL)}
    del changed["C_INT"]
    assert [str(difference) for difference in parameter_differences(VALUES, changed)] == [
        "B_REAL: 0.5 in the file, 0.6 on the vehicle",
        "C_INT: 7 in the file, none on the vehicle",
    ]


def test_other_components_are_left_out_and_bad_lines_named():
    text = "# Onboard parameters\n1\t1\tA_INT\t5\t6\n1\t154\tGIMBAL\t1\t6\n"
    assert read_parameters(text) == {"A_INT": Parameter(5, INT)}
    with pytest.raises(ParameterError, match=r"vehicle.params:2: expected system, component, name, value, type"):
        read_parameters("# x\n1\t1\tA_INT\tnan\t9\n", "vehicle.params")


def test_files_of_mavproxy_and_mission_planner_are_read():
    assert read_parameters("A_INT 5\nB_REAL,0.5\n") == {"A_INT": Parameter(5, INT), "B_REAL": Parameter(0.5, REAL)}


@pytest.mark.parametrize(
    "row",
    [
        "A 1e39",
        f"A {'9' * 5000}",
        "A 1_000",
        "A \u0663",
        "1 1 A 1.5 6",
        "1 1 A 256 1",
        "1 1 A 1 11",
        "1 x A 1 6",
        "A-B 1",
    ],
)
def test_values_that_their_type_does_not_hold_are_refused(row: str):
    with pytest.raises(ParameterError, match="x.params:1: expected system, component, name, value, type"):
        read_parameters(row, "x.params")


def test_a_parameter_that_stands_twice_in_a_file_is_refused():
    with pytest.raises(ParameterError, match="x.params:2: A a second time"):
        read_parameters("A 1\nA 2\n", "x.params")


@pytest.mark.parametrize(("value", "kind"), [(0.5, INT), (2**31, INT), (2139095041, INT), (1e39, REAL)])
def test_what_a_parameter_cannot_have_is_not_sent(value: float, kind: int):
    exchange = ParameterExchange((1, 1), "A", new_value=value)
    exchange.start(0.0)
    with pytest.raises(ParameterError, match="vehicle 1: parameter A: .*; nothing was set"):
        exchange.receive(frame_value("A", bytes(4), kind, 0), 0.1)
    assert exchange.done
