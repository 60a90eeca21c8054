"""Datagrams in and out: pymavlink reads, a packer of our own writes.

A vehicle sends some 260 messages a second; building each through pymavlink's objects would cost more than its physics.
The packer takes layouts, CRC_EXTRA and field order from the dialect, and a test holds it equal to pymavlink's.
"""

import operator
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from fastcrc.crc16 import mcrf4xx

from sitl.dialect import Message, mavlink

_CRC = struct.Struct("<H")
_MAGIC = 0xFD
_MAGIC_BYTE = bytes([_MAGIC])
HEADER_BYTES, OLD_HEADER_BYTES = 10, 6
"""Of MAVLink 2 and 1."""

FieldValues = tuple[float | bytes | tuple[float, ...], ...]
"""A message's fields in the order of its definition."""


@dataclass(frozen=True)
class Layout:
    """How one message travels."""

    name: str
    message_id: int
    id_bytes: bytes
    """The id in three bytes, lowest first."""
    crc_extra: bytes
    pack: Callable[..., bytes]
    to_wire: Callable[[Sequence[Any]], Sequence[Any]] | None
    """Documented field order -> wire order; None where they are the same."""
    has_arrays: bool

    @classmethod
    def of_own(cls, name: str, message_id: int, crc_extra: int, payload: struct.Struct) -> "Layout":
        """The layout of a message that the dialect lacks; its values come in wire order, arrays opened up."""
        id_bytes = message_id.to_bytes(3, "little")
        return cls(name, message_id, id_bytes, bytes([crc_extra]), payload.pack, None, has_arrays=False)


def _wire_types(kind: Any) -> list[str]:
    """Field types in wire order, in which `array_lengths` stand."""
    types = dict(zip(kind.fieldnames, kind.fieldtypes, strict=True))
    return [types[name] for name in kind.ordered_fieldnames]


def layout_of(message_class: type) -> Layout:
    """The layout of a pymavlink message class."""
    kind: Any = message_class
    order = [kind.fieldnames.index(name) for name in kind.ordered_fieldnames]
    has_arrays = any(
        length > 0 and field != "char" for length, field in zip(kind.array_lengths, _wire_types(kind), strict=True)
    )
    return Layout(
        name=kind.msgname,
        message_id=kind.id,
        id_bytes=kind.id.to_bytes(3, "little"),
        crc_extra=bytes([kind.crc_extra]),
        pack=kind.unpacker.pack,
        to_wire=None if order == sorted(order) else operator.itemgetter(*order),
        has_arrays=has_arrays,
    )


LAYOUTS: dict[str, Layout] = {kind.msgname: layout_of(kind) for kind in mavlink.mavlink_map.values()}
"""Message name -> layout, for all messages of the dialect."""


class FrameWriter:
    """Frames of one sender on one link, numbered in sequence.

    Args:
        sysid: of the sender.
        compid: of the sender.
    """

    def __init__(self, sysid: int, compid: int) -> None:
        self._sysid, self._compid = sysid, compid
        self._seq = 0

    def frame(self, layout: Layout, values: Sequence[Any]) -> bytes:
        """One MAVLink 2 frame.

        Args:
            layout: of the message.
            values: its fields in the order of its definition; arrays as sequences, texts as bytes.
        """
        if layout.to_wire is not None:
            values = layout.to_wire(values)
        if layout.has_arrays:
            values = _flat(values)
        return self.wrap(layout, layout.pack(*values))

    def encode(self, message: Message) -> bytes:
        """One frame from a pymavlink message object."""
        values = [getattr(message, name) for name in message.fieldnames]
        texts = [v.encode() if isinstance(v, str) else v for v in values]
        return self.frame(LAYOUTS[message.msgname], texts)

    def wrap(self, layout: Layout, payload: bytes) -> bytes:
        """One frame around a payload in wire order; its trailing zeros are not sent."""
        payload = payload.rstrip(b"\0") or b"\0"
        seq, self._seq = self._seq, (self._seq + 1) & 0xFF
        low, middle, high = layout.id_bytes
        body = bytes((len(payload), 0, 0, seq, self._sysid, self._compid, low, middle, high)) + payload
        return _MAGIC_BYTE + body + _CRC.pack(mcrf4xx(body + layout.crc_extra, 0xFFFF))


def payload_of(message: Message, n_bytes: int) -> bytes:
    """The first bytes of a received message's payload; the zeros that were not sent are put back."""
    frame = message.get_msgbuf()
    start = HEADER_BYTES if frame[0] == _MAGIC else OLD_HEADER_BYTES
    return bytes(frame[start : start + min(frame[1], n_bytes)]).ljust(n_bytes, b"\0")


def _flat(values: Sequence[float | bytes | tuple[float, ...] | list[float]]) -> list[Any]:
    """Arrays among the values opened up."""
    flat: list[Any] = []
    for value in values:
        if type(value) is tuple or type(value) is list:
            flat.extend(value)
        else:
            flat.append(value)
    return flat


class FrameReader:
    """Whole datagrams into messages; whatever is no MAVLink is counted and dropped."""

    def __init__(self) -> None:
        self._parser: Any = mavlink.MAVLink(None)
        self._parser.robust_parsing = True
        self.dropped = 0
        """Frames that could not be read."""

    def read(self, datagram: bytes) -> list[Message]:
        """The messages in a datagram, in order; never raises."""
        messages: list[Message] = self._parser.parse_buffer(datagram) or []
        if self._parser.buf_len():  # a frame that its datagram cut off must not eat the next one
            self.dropped += 1
            self._parser.buf = bytearray()
            self._parser.buf_index = 0
        known = [message for message in messages if message.get_msgId() in mavlink.mavlink_map]
        self.dropped += len(messages) - len(known)
        return known
