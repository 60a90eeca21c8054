"""The audit log: every order that goes out to a vehicle, who gave it, and what came back.

It is written where frames go out and come in, so that nothing that is sent can be left out of it. One JSON object a
line: an order when it is first sent, and a result when the other side has answered; an order without result was not
answered. Files are appended to, never rewritten.
"""

import os
import struct
from collections.abc import Callable, Generator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any

import msgspec

from gcs.dialect import Message, enum_name, mavlink
from gcs.unwritten import Unwritten, unheard

AUDIT_FILE = "audit.jsonl"
_PAYLOAD_AT = 10
"""In a MAVLink 2 frame; a parameter's value comes first in it."""
MOST_PENDING = 1000
"""Orders that wait for an answer; of more, the oldest are taken for unanswered."""


class Origin(Enum):
    """Who gives an order."""

    OPERATOR = "operator"
    """A person at the page."""
    SEQUENCE = "sequence"
    """The flight's own steps, after a person or a script has begun it."""
    MONITOR = "monitor"
    """The watch over a flight, when something has gone wrong."""
    REPLANNER = "replanner"
    """The cloud's planner, in flight."""


_acting: ContextVar[Origin] = ContextVar("acting", default=Origin.SEQUENCE)


@contextmanager
def acting_as(origin: Origin) -> Generator[None]:
    """Whatever is sent inside of the block, and by tasks that are begun in it, is this one's order."""
    before = _acting.set(origin)
    try:
        yield
    finally:
        _acting.reset(before)


class Order(msgspec.Struct, frozen=True, kw_only=True, tag="order"):
    """One order, when it is sent for the first time."""

    unix_us: int
    id: int
    origin: Origin
    vehicle: int
    component: int
    order: str
    content: dict[str, Any]


class Result(msgspec.Struct, frozen=True, kw_only=True, tag="result"):
    """What the other side answered to an order."""

    unix_us: int
    id: int
    vehicle: int
    result: str
    sent: int
    """How often the order was sent until then."""


Key = tuple[int, int, str, Any]


@dataclass
class _Pending:
    id: int
    content: dict[str, Any]
    sent: int = 1


@dataclass
class Audit:
    """Follows orders and their answers.

    Args:
        write: takes each entry, as one line of JSON.
        unix_us: the wall clock.
    """

    write: Callable[[bytes], None]
    unix_us: Callable[[], int]
    _next_id: int = 1
    _pending: dict[Key, _Pending] = field(default_factory=dict[Key, _Pending])

    def sent(self, message: Message, sysid: int) -> None:
        """A message goes out; if it is an order, it is noted before it does."""
        describe = _ORDERS.get(message.get_type())
        if describe is None:
            return
        subject, order, content = describe(message)
        key = (sysid, getattr(message, "target_component", 0), message.get_type(), subject)
        earlier = self._pending.pop(key, None)
        if earlier is not None and getattr(message, "confirmation", 1) and repr(earlier.content) == repr(content):
            earlier.sent += 1
            self._pending[key] = earlier
            return
        while len(self._pending) >= MOST_PENDING:
            self._pending.pop(next(iter(self._pending)))
        self._pending[key] = _Pending(self._next_id, content)
        entry = Order(
            unix_us=self.unix_us(),
            id=self._next_id,
            origin=_acting.get(),
            vehicle=sysid,
            component=key[1],
            order=order,
            content=content,
        )
        self._next_id += 1
        self.write(msgspec.json.encode(entry) + b"\n")

    def received(self, message: Message) -> None:
        """A message has come in; if it answers an order, the result is noted."""
        answer = _ANSWERS.get(message.get_type())
        if answer is None:
            return
        kinds, subject, result, final = answer(message)
        sender = message.get_srcSystem(), message.get_srcComponent()
        for kind in kinds:
            pending = self._pending.get((*sender, kind, subject))
            if pending is not None:
                entry = Result(
                    unix_us=self.unix_us(), id=pending.id, vehicle=sender[0], result=result, sent=pending.sent
                )
                self.write(msgspec.json.encode(entry) + b"\n")
                if final:
                    del self._pending[*sender, kind, subject]


class AuditFile:
    """An audit log in a file, which is appended to; each entry is on its way to the disk before its frame is sent.

    Args:
        path: the file.
        say: takes a sentence if it can be written no longer; orders go out all the same, since one of them may be Hold.
    """

    def __init__(self, path: Path, say: Callable[[str], None] = unheard) -> None:
        self._descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
        self._unwritten = Unwritten("the audit log", say)

    def write(self, line: bytes) -> None:
        with self._unwritten:
            os.write(self._descriptor, line)

    def close(self) -> None:
        os.close(self._descriptor)


Described = tuple[Any, str, dict[str, Any]]
Answered = tuple[tuple[str, ...], Any, str, bool]


def _command(message: Message) -> Described:
    name = enum_name("MAV_CMD", message.command)
    if message.get_type() == "COMMAND_INT":
        place = {"frame": message.frame, "x": message.x, "y": message.y, "z": message.z}
        return message.command, name, {"params": [getattr(message, f"param{n}") for n in range(1, 5)]} | place
    return message.command, name, {"params": [getattr(message, f"param{n}") for n in range(1, 8)]}


def _parameter(message: Message) -> Described:
    name = message.param_id if isinstance(message.param_id, str) else message.param_id.decode()
    return name, "PARAM_SET", {"name": name, "value": _carried(struct.pack("<f", message.param_value), message)}


def _carried(four_bytes: bytes, message: Message) -> float | int:
    """A parameter's value: PX4 puts the bytes of an integer where the message has a float."""
    layout = {mavlink.MAV_PARAM_TYPE_INT32: "<i", mavlink.MAV_PARAM_TYPE_UINT32: "<I"}.get(message.param_type, "<f")
    return struct.unpack(layout, four_bytes)[0]


def _plan(message: Message) -> Described:
    kind = enum_name("MAV_MISSION_TYPE", message.mission_type).removeprefix("MAV_MISSION_TYPE_").lower()
    count = getattr(message, "count", 0)
    return message.mission_type, f"upload of a {kind}" if count else f"clearing of a {kind}", {"items": count}


def _current(message: Message) -> Described:
    return message.seq, "MISSION_SET_CURRENT", {"seq": message.seq}


def _signing(message: Message) -> Described:
    return "key", "SETUP_SIGNING", {}  # what is in it is secret


_ORDERS: dict[str, Callable[[Message], Described]] = {
    "COMMAND_LONG": _command,
    "COMMAND_INT": _command,
    "PARAM_SET": _parameter,
    "MISSION_COUNT": _plan,
    "MISSION_CLEAR_ALL": _plan,
    "MISSION_SET_CURRENT": _current,
    "SETUP_SIGNING": _signing,
}


def _acknowledged(message: Message) -> Answered:
    result = enum_name("MAV_RESULT", message.result).removeprefix("MAV_RESULT_")
    return ("COMMAND_LONG", "COMMAND_INT"), message.command, result, result != "IN_PROGRESS"


def _stored(message: Message) -> Answered:
    result = enum_name("MAV_MISSION_RESULT", message.type).removeprefix("MAV_MISSION_")
    return ("MISSION_COUNT", "MISSION_CLEAR_ALL"), message.mission_type, result, True


def _set(message: Message) -> Answered:
    value = _carried(bytes(message.get_msgbuf()[_PAYLOAD_AT : _PAYLOAD_AT + 4]), message)
    return ("PARAM_SET",), message.param_id, f"value {value:g}" if isinstance(value, float) else f"value {value}", True


_ANSWERS: dict[str, Callable[[Message], Answered]] = {
    "COMMAND_ACK": _acknowledged,
    "MISSION_ACK": _stored,
    "PARAM_VALUE": _set,
}
