"""The parameter protocol, PX4's way: bytewise values, `_HASH_CHECK` first, silence on what it does not know."""

import struct
from collections import deque

from sitl.autopilot.parameters import Parameters
from sitl.dialect import Message
from sitl.microservices.outbox import Link, Outbox, Sender
from sitl.wire import LAYOUTS, payload_of

HASH_CHECK = "_HASH_CHECK"
HASH_INDEX = 0xFFFF
PER_TICK = 20
"""PARAM_VALUEs of a list that are sent per tick of 20 ms: 1000 a second, as PX4 does."""

_PAYLOAD = struct.Struct("<4sHH16sB")
_LAYOUT = LAYOUTS["PARAM_VALUE"]


class ParameterServer:
    """Lists, reads and sets the parameters of one vehicle."""

    def __init__(self, parameters: Parameters, outbox: Outbox) -> None:
        self._parameters = parameters
        self._outbox = outbox
        self._index = {name: index for index, name in enumerate(parameters.names)}
        self._queues: dict[Link, deque[str]] = {link: deque() for link in Link}

    def receive_list(self, message: Message, sender: Sender) -> None:
        """PARAM_REQUEST_LIST: everything, on the asking link, in the ticks to come."""
        self._queues[sender.link] = deque((HASH_CHECK, *self._parameters.names))

    def receive_read(self, message: Message, sender: Sender) -> None:
        """PARAM_REQUEST_READ by index, or by name where the index is -1."""
        index: int = message.param_index
        if index >= 0:
            names = self._parameters.names
            name = names[index] if index < len(names) else None
        else:
            name = message.param_id
        if name == HASH_CHECK or (name is not None and name in self._parameters):
            self._send(sender.link, name)

    def receive_set(self, message: Message, sender: Sender) -> None:
        """PARAM_SET: the value comes back; a new one once more, and on the other link."""
        name = message.param_id
        if name not in self._parameters:
            return
        raw = payload_of(message, 4)  # pymavlink's float would lose some integers' bits
        value = self._parameters.decoded(name, raw, message.param_type)
        if value is None:
            if message.param_type == self._parameters.encoded(name)[1]:
                self._send(sender.link, name)  # not finite: the old value stays
            return
        changed = self._parameters.set(name, value)
        self._send(sender.link, name)
        if changed:
            for link in Link:
                self._send(link, name)

    def tick(self) -> None:
        """Send on what has been asked for."""
        for link, queue in self._queues.items():
            for _ in range(min(PER_TICK, len(queue)) if queue else 0):
                self._send(link, queue.popleft())

    def _send(self, link: Link, name: str) -> None:
        if name == HASH_CHECK:
            raw, kind = self._parameters.hash_check()
        else:
            raw, kind = self._parameters.encoded(name)
        index = self._index.get(name, HASH_INDEX)
        payload = _PAYLOAD.pack(raw, len(self._index), index, name.encode(), kind)
        self._outbox.send_payload(link, _LAYOUT, payload)
