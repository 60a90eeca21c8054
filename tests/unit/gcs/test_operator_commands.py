"""What `gcs params` and `gcs links` are made of."""

import asyncio
from pathlib import Path

import pytest

from gcs.commands.links import aligned, link_rows
from gcs.dialect import mavlink
from gcs.errors import ParameterError
from gcs.link.url import parse_link_url
from gcs.microservices.kept_parameters import decode_kept, encode_kept
from gcs.microservices.parameter_fetch import Parameter, ParameterSet
from gcs.microservices.parameter_files import read_value, shown_value
from gcs.station import Station
from gcs.vehicle_parameters import fetch, set_all
from tests.simulation import virtual_time
from tests.unit.gcs import messages as mav

REAL, INT = mavlink.MAV_PARAM_TYPE_REAL32, mavlink.MAV_PARAM_TYPE_INT32
PARAMETERS = ParameterSet({"A": Parameter(-3, INT), "B": Parameter(0.25, REAL)}, 0xFFA00001)
PEER = ("127.0.0.1", 18570)
HEARTBEAT = mavlink.MAVLink_heartbeat_message(2, 12, 81, 0x03040000, 3, 3)


class Vehicle:
    """A connection with an autopilot behind it that has a few parameters, and never lets "STUBBORN" be set."""

    peer = None
    budget_bytes_s: float | None = None

    def __init__(self, station: Station) -> None:
        self.station, self.lists = station, 0
        self.values = {"A": 1.0, "STUBBORN": 2.0}
        self.say(HEARTBEAT)

    def say(self, message) -> None:
        self.station.receive(self, mav.frame_of(1, 1, message), PEER)

    def send(self, datagram: bytes, address: tuple[str, int]) -> None:
        message = mavlink.MAVLink(None).decode(bytearray(datagram))
        names = list(self.values)
        match message.get_type():
            case "PARAM_REQUEST_LIST":
                self.lists += 1
            case "PARAM_REQUEST_READ":
                names = [message.param_id] if message.param_id in self.values else []
            case "PARAM_SET":
                names = [message.param_id]
                if message.param_id != "STUBBORN":
                    self.values[message.param_id] = message.param_value
            case _:
                return
        for name in names:
            index = list(self.values).index(name)
            value = mavlink.MAVLink_param_value_message(name.encode(), self.values[name], REAL, len(self.values), index)
            asyncio.get_running_loop().call_later(0.01, self.say, value)


def test_what_is_kept_of_a_vehicle_is_read_again():
    data = encode_kept(PARAMETERS)
    assert data is not None
    assert decode_kept(data) == PARAMETERS
    assert encode_kept(ParameterSet(PARAMETERS.values, None)) is None


@pytest.mark.parametrize(
    "data", [b"", b"{}", b'{"hash_check":1,"values":{}}', b"\xff", b'{"hash_check":1,"values":{"A":[1e999,9]}}']
)
def test_a_kept_copy_that_cannot_be_read_is_none(data: bytes):
    assert decode_kept(data) is None


@pytest.mark.parametrize(("text", "value"), [("5", 5), ("-0.5", -0.5), ("5.0", 5.0), ("1e-3", 0.001)])
def test_values_are_read_as_an_operator_gives_them(text: str, value: float):
    assert read_value(text) == value
    assert isinstance(read_value(text), type(value))


@pytest.mark.parametrize("text", ["nan", "inf", "", "five", "1_0", "1e99", "9" * 30])
def test_what_is_no_number_is_refused(text: str):
    with pytest.raises(ParameterError, match="expected a number, found"):
        read_value(text)


def test_values_are_shown_as_they_are():
    assert [shown_value(value) for value in (None, 5, 0.25)] == ["none", "5", "0.25"]


def test_all_parameters_are_fetched_once_and_set_one_by_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    said: list[str] = []

    async def play() -> tuple[dict[str, float], dict[str, str], Vehicle]:
        station = Station()
        vehicle = Vehicle(station)
        found = await fetch(station, 1)
        failed = await set_all(station, 1, {"A": 4.5, "STUBBORN": 3.0}, said.append)
        return {name: parameter.value for name, parameter in found.items()}, failed, vehicle

    found, failed, vehicle = virtual_time.run(play())
    assert found == {"A": 1.0, "STUBBORN": 2.0}
    assert vehicle.values == {"A": 4.5, "STUBBORN": 2.0}
    assert said == ["vehicle 1: A is 4.5", failed["STUBBORN"]]
    assert "expected 3.0 to be stored, found 2.0" in failed["STUBBORN"]


def test_each_path_to_a_vehicle_is_a_row_and_the_best_one_comes_first():
    async def play() -> list[tuple[str, ...]]:
        station = Station()
        vehicle = Vehicle(station)
        station.connections.append(vehicle)
        return list(link_rows(station, (parse_link_url("udpin://127.0.0.1:14550"),), 2.0))

    (row,) = virtual_time.run(play())
    assert row == (
        "1", "UNSIGNED", "udpin://127.0.0.1:14550", "127.0.0.1:18570", "0.5", "0.0 %", "–", "0.0 s ago"
    )  # fmt: skip


def test_columns_are_aligned():
    assert aligned([("a", "b", "c", "d", "1"), ("aa", "b", "c", "d", "22")]) == ["a   b  c  d   1", "aa  b  c  d  22"]
