"""Commands, parameters and mission transfer from the ground station's side, message by message."""

import math
import struct

import pytest

from gcs.dialect import mavlink
from gcs.errors import CommandRefused, LinkLost, ParameterError
from gcs.flight import actions
from gcs.microservices import parameter_client
from gcs.microservices.command_client import ATTEMPTS, PROGRESS_TIMEOUT_S, CommandClient
from gcs.microservices.parameter_client import ParameterExchange
from missions.frames import GeodeticPoint
from tests.unit.gcs.messages import command_ack, from_autopilot

PEER = (1, 1)
ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM


def sent(messages: list) -> list[str]:
    return [message.get_type() for message in messages]


def time_out(service, times: int = 30) -> None:
    """Let deadline after deadline pass."""
    for _ in range(times):
        service.handle_timeout(service.deadline_s)


# ------------------------------------------------------------------ commands


def test_a_command_is_repeated_with_rising_confirmation_until_it_is_acknowledged():
    client = CommandClient(actions.arm(), PEER)
    confirmations = [client.start(0.0)[0].confirmation]
    for _ in range(3):
        confirmations += [message.confirmation for message in client.handle_timeout(client.deadline_s)]
    assert confirmations == [0, 1, 2, 3]
    client.receive(command_ack(ARM, mavlink.MAV_RESULT_ACCEPTED), 5.0)
    assert client.done


def test_the_pauses_between_repetitions_grow():
    client = CommandClient(actions.arm(), PEER)
    client.start(0.0)
    pauses = []
    for _ in range(4):
        now_s = client.deadline_s
        client.handle_timeout(now_s)
        pauses.append(client.deadline_s - now_s)
    assert pauses == sorted(pauses)
    assert pauses[0] > 0.5


def test_an_unanswered_command_gives_up_with_a_sentence():
    client = CommandClient(actions.arm(), PEER)
    client.start(0.0)
    with pytest.raises(LinkLost, match=f"vehicle 1: arm: no answer to {ATTEMPTS} requests"):
        time_out(client, ATTEMPTS)


def test_a_refusal_is_named():
    client = CommandClient(actions.arm(), PEER)
    client.start(0.0)
    with pytest.raises(CommandRefused, match="vehicle 1: arm: TEMPORARILY_REJECTED"):
        client.receive(command_ack(ARM, mavlink.MAV_RESULT_TEMPORARILY_REJECTED), 0.1)


def test_acknowledgements_of_other_commands_are_not_mine():
    client = CommandClient(actions.arm(), PEER)
    client.start(0.0)
    client.receive(command_ack(mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_RESULT_DENIED), 0.1)
    assert not client.done


def test_a_command_in_progress_is_waited_for():
    client = CommandClient(actions.arm(), PEER)
    client.start(0.0)
    client.receive(command_ack(ARM, mavlink.MAV_RESULT_IN_PROGRESS), 1.0)
    assert client.deadline_s == 1.0 + PROGRESS_TIMEOUT_S


def test_modes_are_commanded_by_px4s_main_and_sub_numbers():
    from gcs.dialect import Mode

    assert actions.set_mode(Mode.HOLD).params == (1.0, 4.0, 3.0)
    assert actions.set_mode(Mode.LAND).params == (1.0, 4.0, 6.0)
    assert actions.take_off(500.0).params[6] == 500.0
    assert all(math.isnan(param) for param in actions.take_off(500.0).params[:6])


# ------------------------------------------------------------------ parameters


def value(name: str, number: float, kind: int = mavlink.MAV_PARAM_TYPE_REAL32):
    return from_autopilot(mavlink.MAVLink_param_value_message(name.encode(), number, kind, 900, 5))


def integer(name: str, number: int):
    as_float = struct.unpack("<f", struct.pack("<i", number))[0]
    return value(name, as_float, mavlink.MAV_PARAM_TYPE_INT32)


def test_an_integer_parameter_is_read_bytewise():
    exchange = ParameterExchange(PEER, "NAV_DLL_ACT")
    assert sent(exchange.start(0.0)) == ["PARAM_REQUEST_READ"]
    exchange.receive(integer("NAV_DLL_ACT", 2), 0.1)
    assert (exchange.done, exchange.value) == (True, 2)


def test_setting_reads_the_type_first_then_sets_and_waits_for_the_echo():
    exchange = ParameterExchange(PEER, "COM_OBL_RC_ACT", new_value=5)
    assert sent(exchange.start(0.0)) == ["PARAM_REQUEST_READ"]
    (setting,) = exchange.receive(integer("COM_OBL_RC_ACT", 0), 0.1)
    assert setting.get_type() == "PARAM_SET"
    assert struct.pack("<f", setting.param_value) == struct.pack("<i", 5)
    assert not exchange.done
    exchange.receive(integer("COM_OBL_RC_ACT", 5), 0.2)
    assert exchange.done


def test_a_type_that_came_late_leaves_setting_its_whole_patience():
    exchange = ParameterExchange(PEER, "NAV_DLL_ACT", new_value=0)
    exchange.start(0.0)
    time_out(exchange, parameter_client.ATTEMPTS - 1)
    exchange.receive(integer("NAV_DLL_ACT", 2), 30.0)
    time_out(exchange, parameter_client.ATTEMPTS - 1)
    exchange.receive(integer("NAV_DLL_ACT", 0), 60.0)
    assert exchange.done


def test_a_parameter_that_already_has_the_value_is_not_set():
    exchange = ParameterExchange(PEER, "COM_OF_LOSS_T", new_value=1.0)
    exchange.start(0.0)
    assert exchange.receive(value("COM_OF_LOSS_T", 1.0), 0.1) == []
    assert exchange.done


def test_silence_names_the_parameter():
    exchange = ParameterExchange(PEER, "NO_SUCH_PARAM")
    exchange.start(0.0)
    with pytest.raises(ParameterError, match="NO_SUCH_PARAM: no answer"):
        time_out(exchange)


def test_a_parameter_that_does_not_take_the_value_is_an_error_that_shows_both():
    exchange = ParameterExchange(PEER, "NAV_DLL_ACT", new_value=0)
    exchange.start(0.0)
    exchange.receive(integer("NAV_DLL_ACT", 2), 0.1)
    with pytest.raises(ParameterError, match="expected 0 to be stored, found 2"):
        time_out(exchange)


def test_a_place_travels_as_integers_and_its_altitude_amsl():
    place = GeodeticPoint(latitude_deg=47.3977432, longitude_deg=8.5455942, altitude_amsl_m=491.5)
    (message,) = CommandClient(actions.go_to(place), PEER).start(0.0)
    assert message.get_type() == "COMMAND_INT"
    assert (message.command, message.x, message.y) == (mavlink.MAV_CMD_DO_REPOSITION, 473977432, 85455942)
    assert (message.frame, message.z, message.param1) == (mavlink.MAV_FRAME_GLOBAL, 491.5, -1.0)
    assert int(message.param2) == mavlink.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE
    assert math.isnan(message.param4)
