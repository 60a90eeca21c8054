"""The audit log: who ordered what, and what came of it."""

import json
import struct
from pathlib import Path
from typing import Any

import pytest

from gcs.dialect import mavlink
from gcs.security.audit import MOST_PENDING, Audit, AuditFile, Origin, acting_as


class Desk:
    """An audit log in memory, and vehicle 1 to be spoken to."""

    def __init__(self) -> None:
        self.lines: list[bytes] = []
        self.audit = Audit(self.lines.append, lambda: 1_000)

    @property
    def entries(self) -> list[dict[str, Any]]:
        return [json.loads(line) for line in self.lines]

    def order(self, number: int = 400, confirmation: int = 0, param1: float = 1.0) -> None:
        message = mavlink.MAVLink_command_long_message(1, 1, number, confirmation, param1, 0, 0, 0, 0, 0, 0)
        self.audit.sent(message, 1)

    def answer(self, message: Any, system: int = 1) -> None:
        sender = mavlink.MAVLink(None, system, 1)
        self.audit.received(mavlink.MAVLink(None).decode(bytearray(message.pack(sender))))

    def acknowledge(self, number: int = 400, result: int = 0, system: int = 1) -> None:
        self.answer(mavlink.MAVLink_command_ack_message(number, result), system)


@pytest.fixture
def desk() -> Desk:
    return Desk()


def test_an_order_is_written_before_its_answer(desk: Desk):
    desk.order()
    assert desk.entries == [
        {
            "type": "order", "unix_us": 1000, "id": 1, "origin": "sequence", "vehicle": 1, "component": 1,
            "order": "MAV_CMD_COMPONENT_ARM_DISARM", "content": {"params": [1.0, 0, 0, 0, 0, 0, 0]},
        }
    ]  # fmt: skip
    desk.acknowledge()
    assert desk.entries[1] == {
        "type": "result",
        "unix_us": 1000,
        "id": 1,
        "vehicle": 1,
        "result": "ACCEPTED",
        "sent": 1,
    }


def test_repeated_copies_are_one_order(desk: Desk):
    for confirmation in range(3):
        desk.order(confirmation=confirmation)
    desk.acknowledge(result=mavlink.MAV_RESULT_DENIED)
    desk.acknowledge()
    assert [(e["type"], e.get("result"), e.get("sent")) for e in desk.entries] == [
        ("order", None, None),
        ("result", "DENIED", 3),
    ]


def test_the_same_order_given_twice_is_two(desk: Desk):
    desk.order()
    desk.order()
    assert [entry["id"] for entry in desk.entries] == [1, 2]


def test_work_in_progress_is_no_end(desk: Desk):
    desk.order()
    desk.acknowledge(result=mavlink.MAV_RESULT_IN_PROGRESS)
    desk.acknowledge()
    assert [entry.get("result") for entry in desk.entries] == [None, "IN_PROGRESS", "ACCEPTED"]


def test_another_vehicles_answer_is_none(desk: Desk):
    desk.order()
    desk.acknowledge(system=2)
    desk.acknowledge(number=22)
    assert len(desk.entries) == 1


def test_parameters_and_uploads_are_orders(desk: Desk):
    desk.audit.sent(mavlink.MAVLink_param_set_message(1, 1, b"NAV_DLL_ACT", 2.0, 9), 1)
    desk.answer(mavlink.MAVLink_param_value_message(b"NAV_DLL_ACT", 2.0, 9, 1, 0))
    desk.audit.sent(mavlink.MAVLink_mission_count_message(1, 1, 7, 1), 1)
    desk.answer(mavlink.MAVLink_mission_ack_message(255, 190, 0, 1))
    told = [(e.get("order"), e.get("content"), e.get("result")) for e in desk.entries]
    assert told == [
        ("PARAM_SET", {"name": "NAV_DLL_ACT", "value": 2.0}, None),
        (None, None, "value 2"),
        ("upload of a fence", {"items": 7}, None),
        (None, None, "ACCEPTED"),
    ]


def test_an_integer_parameter_is_noted_as_the_integer_that_it_is(desk: Desk):
    carried = struct.unpack("<f", struct.pack("<i", 5))[0]
    desk.audit.sent(mavlink.MAVLink_param_set_message(1, 1, b"NAV_DLL_ACT", carried, 6), 1)
    desk.answer(mavlink.MAVLink_param_value_message(b"NAV_DLL_ACT", carried, 6, 1, 0))
    assert desk.entries[0]["content"] == {"name": "NAV_DLL_ACT", "value": 5}
    assert desk.entries[1]["result"] == "value 5"


def test_reading_is_no_order(desk: Desk):
    desk.audit.sent(mavlink.MAVLink_mission_request_list_message(1, 1, 0), 1)
    desk.answer(mavlink.MAVLink_param_value_message(b"NAV_DLL_ACT", 2.0, 9, 1, 0))
    assert desk.entries == []


def test_who_acts_is_told_and_ends_with_the_block(desk: Desk):
    with acting_as(Origin.OPERATOR):
        desk.order()
    with acting_as(Origin.REPLANNER):
        desk.order(22)
    desk.order(21)
    assert [entry["origin"] for entry in desk.entries] == ["operator", "replanner", "sequence"]


def test_keys_are_never_written(desk: Desk):
    key = list(range(1, 33))
    desk.audit.sent(mavlink.MAVLink_setup_signing_message(1, 1, key, 0), 1)
    assert (desk.entries[0]["order"], desk.entries[0]["content"]) == ("SETUP_SIGNING", {})
    assert bytes(key).hex().encode() not in desk.lines[0]


def test_unanswered_orders_do_not_pile_up(desk: Desk):
    for number in range(MOST_PENDING + 50):
        desk.order(number)
    assert len(desk.audit._pending) == MOST_PENDING


def test_the_file_is_appended_to_and_for_its_owner_alone(tmp_path: Path):
    for line in (b"one\n", b"two\n"):
        file = AuditFile(tmp_path / "audit.jsonl")
        file.write(line)
        file.close()
    assert (tmp_path / "audit.jsonl").read_bytes() == b"one\ntwo\n"
    assert (tmp_path / "audit.jsonl").stat().st_mode & 0o777 == 0o600
