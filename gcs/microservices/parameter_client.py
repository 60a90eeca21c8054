"""The parameter protocol, the ground station's side: read one, set one and see it set.

PX4 encodes bytewise: an INT32 parameter travels as the four bytes of a float.
"""

import math
import struct
from dataclasses import dataclass, field

from gcs.dialect import Message, mavlink
from gcs.errors import ParameterError
from gcs.microservices import Backoff, Microservice

FIRST_TIMEOUT_S = 0.5
ATTEMPTS = 8
TOLERANCE = 1e-6

Value = int | float


@dataclass
class ParameterExchange(Microservice):
    """Read a parameter, or, given a value, set it and wait for the echo that shows the value stored.

    PX4 answers a wrong name, type or index with silence, so a set is preceded by a read, which tells the type.

    Raises:
        ParameterError: no answer, or another value stored than was sent.
    """

    peer: tuple[int, int]
    name: str
    new_value: Value | None = None
    value: Value | None = None
    done: bool = False
    deadline_s: float = math.inf
    wants: frozenset[str] = frozenset({"PARAM_VALUE"})
    _type: int | None = None
    _backoff: Backoff = field(default_factory=lambda: Backoff(FIRST_TIMEOUT_S, ATTEMPTS))

    def start(self, now_s: float) -> list[Message]:
        self.deadline_s = now_s + self._backoff.take()
        if self._type is None or self.new_value is None:
            return [mavlink.MAVLink_param_request_read_message(*self.peer, self.name.encode(), -1)]
        encoded = _encode(self.new_value, self._type)
        return [mavlink.MAVLink_param_set_message(*self.peer, self.name.encode(), encoded, self._type)]

    def receive(self, message: Message, now_s: float) -> list[Message]:
        if message.param_id != self.name or self.done:
            return []
        first_answer, self._type = self._type is None, message.param_type
        self.value = _decode(message.param_value, message.param_type)
        if self.new_value is None or _equal(self.value, self.new_value):
            self.done = True
            return []
        return self.start(now_s) if first_answer else []

    def handle_timeout(self, now_s: float) -> list[Message]:
        if self._backoff.exhausted:
            self.done = True
            raise ParameterError(f"vehicle {self.peer[0]}: parameter {self.name}: {self._complaint()}")
        return self.start(now_s)

    def _complaint(self) -> str:
        if self.value is None:
            return "no answer (an autopilot without this parameter is silent)"
        return f"expected {self.new_value} to be stored, found {self.value}"


def _equal(one: Value, other: Value) -> bool:
    return abs(one - other) <= TOLERANCE * max(1.0, abs(other))


def _encode(value: Value, kind: int) -> float:
    if kind == mavlink.MAV_PARAM_TYPE_INT32:
        return struct.unpack("<f", struct.pack("<i", round(value)))[0]
    return float(value)


def _decode(value: float, kind: int) -> Value:
    if kind == mavlink.MAV_PARAM_TYPE_INT32:
        return struct.unpack("<i", struct.pack("<f", value))[0]
    return value
