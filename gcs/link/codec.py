"""Datagrams <-> MAVLink messages: parsing that never raises, packing under our own identity, and counting."""

import struct
from collections.abc import Hashable
from dataclasses import dataclass, field

from gcs.dialect import GCS_COMPONENT, GCS_SYSTEM, Message, mavlink
from gcs.security.signing import Signing

MAVLINK_2 = 0xFD
MOST_SOURCES, MOST_LANES = 2048, 2048
"""What strangers can make the station remember."""


@dataclass
class SourceCount:
    """What was heard from one component, and what its sequence numbers say was lost on the way."""

    received: int = 0
    lost: int = 0
    _next_seq: int | None = None

    def count(self, seq: int) -> None:
        if self._next_seq is not None:
            gap = (seq - self._next_seq) % 256
            if gap < 128:  # a larger gap is an older packet that was overtaken
                self.lost += gap
            else:
                self.lost = max(0, self.lost - 1)
                self.received += 1
                return
        self.received += 1
        self._next_seq = (seq + 1) % 256


@dataclass
class Codec:
    """One end of MAVLink 2; the ground station's, unless said otherwise.

    Malformed, truncated and MAVLink 1 frames are counted and dropped, and so is what `signing` does not admit.
    """

    system: int = GCS_SYSTEM
    component: int = GCS_COMPONENT
    malformed: int = 0
    sources: dict[tuple[int, int], SourceCount] = field(default_factory=dict[tuple[int, int], SourceCount])
    signing: Signing = field(default_factory=Signing)

    def __post_init__(self) -> None:
        self._sender = mavlink.MAVLink(None, self.system, self.component)
        self._parser = _new_parser()
        self._sequences: dict[Hashable, int] = {}

    def parse(self, datagram: bytes) -> list[Message]:
        """All well-formed MAVLink 2 messages of one datagram."""
        try:
            messages = self._parser.parse_buffer(bytearray(datagram)) or []
        except (mavlink.MAVError, struct.error, ValueError, IndexError, TypeError):
            messages = []
            self.malformed += 1
            self._parser = _new_parser()
        if self._parser.buf_len():  # a frame never spans two datagrams: do not let a torn one eat the next
            self.malformed += 1
            self._parser = _new_parser()
        return [message for message in messages if self._accept(message)]

    def pack(self, message: Message, sysid: int = 0, lane: Hashable = None, link_id: int = 0) -> bytes:
        """The frame of a message of ours, signed if the vehicle `sysid` has a key.

        Each lane, which is a way to somebody, counts its own sequence numbers, from which its other end tells the loss.
        Frames of one `link_id` must arrive in order where they are signed: their timestamps rise.
        """
        signature, key = self._sender.signing, self.signing.key(sysid)
        signature.sign_outgoing, signature.secret_key = key is not None, key
        if key is not None:
            signature.timestamp, signature.link_id = self.signing.next_timestamp(sysid), link_id
        if len(self._sequences) > MOST_LANES:
            self._sequences.clear()
        self._sender.seq = self._sequences.get(lane, 0)
        self._sequences[lane] = (self._sender.seq + 1) % 256
        return bytes(message.pack(self._sender))

    def _accept(self, message: Message) -> bool:
        frame = message.get_msgbuf()
        if message.get_type() == "BAD_DATA" or frame[0] != MAVLINK_2:
            self.malformed += 1
            return False
        if not self.signing.admits(frame):
            return False
        seq, system, component = frame[4:7]  # from the frame: pymavlink leaves the header of unknown messages empty
        source = self.sources.get((system, component))
        if source is None and len(self.sources) < MOST_SOURCES:
            source = self.sources[system, component] = SourceCount()
        if source is not None:
            source.count(seq)
        return not message.get_type().startswith("UNKNOWN")


def _new_parser() -> mavlink.MAVLink:
    parser = mavlink.MAVLink(None)
    parser.robust_parsing = True
    return parser
