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
ATTEMPTS = 16
"""Of reading, and again of setting: where half of the messages are lost each way, one in a hundred fails."""
TOLERANCE = 1e-6

Value = int | float


@dataclass
class ParameterExchange(Microservice):
    """Read a parameter, or, given a value, set it and wait for the echo that shows the value stored.

    PX4 answers a wrong name, type or index with silence, so a set is preceded by a read, which tells the type.

    Raises:
        ParameterError: no answer, another value stored than was sent, or one that the parameter cannot have.
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
        try:
            encoded = encode(self.new_value, self._type)
        except ValueError as wrong:
            self.done = True
            raise ParameterError(f"vehicle {self.peer[0]}: parameter {self.name}: {wrong}; nothing was set") from None
        return [mavlink.MAVLink_param_set_message(*self.peer, self.name.encode(), encoded, self._type)]

    def receive(self, message: Message, now_s: float) -> list[Message]:
        if message.param_id != self.name or self.done:
            return []
        first_answer, self._type = self._type is None, message.param_type
        self.value = decode(message)
        if self.new_value is None or _equal(self.value, self.new_value):
            self.done = True
            return []
        if not first_answer:
            return []
        self._backoff = Backoff(FIRST_TIMEOUT_S, ATTEMPTS)
        return self.start(now_s)

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


_VALUE_AT = 10
"""Where the payload, whose first field is the value, begins in a MAVLink 2 frame."""
_INTEGER_FORMATS = {
    mavlink.MAV_PARAM_TYPE_INT32: "<i",
    mavlink.MAV_PARAM_TYPE_UINT32: "<I",
}


def encode(value: Value, kind: int) -> float:
    """A value as it travels, the bytes of an integer in those of a float32.

    Raises:
        ValueError: the type does not hold the value.
    """
    layout = _INTEGER_FORMATS.get(kind)
    if layout is not None and not float(value).is_integer():
        raise ValueError(f"expected an integer, found {value:g}")
    try:
        packed = struct.pack(layout, int(value)) if layout is not None else struct.pack("<f", value)
    except (struct.error, OverflowError):
        raise ValueError(f"expected a value that fits into 32 bits, found {value:g}") from None
    if layout is None:
        return float(value)
    (carried,) = struct.unpack("<f", packed)
    if struct.pack("<f", carried) != packed:  # a signalling NaN, which loses its nature on the way through a float
        raise ValueError(f"{value:g} cannot be carried by this protocol")
    return carried


def decode(message: Message, kind: int | None = None) -> Value:
    """The value of a PARAM_VALUE; integers from the frame itself, since some are no float that Python would keep."""
    layout = _INTEGER_FORMATS.get(message.param_type if kind is None else kind)
    if layout is None:
        return message.param_value
    return struct.unpack_from(layout, message.get_msgbuf(), _VALUE_AT)[0]
