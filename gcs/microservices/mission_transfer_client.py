"""The mission protocol, the ground station's side: upload and download of missions and fences.

The vehicle pulls: it asks for one item after the other. What an upload's end means is uncertain on a lossy link (the
final acknowledgement may be lost), so whoever uploads reads back and compares: `gcs.flight.upload`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from gcs.dialect import Message, enum_name, mavlink
from gcs.errors import MissionTransferError
from gcs.microservices import Backoff
from missions.mission_items import MissionItem

FIRST_TIMEOUT_S = 0.7
LONGEST_TIMEOUT_S = 1.0
ATTEMPTS = 20
BEGIN_AGAIN_AFTER = 6
"""Unanswered attempts, 5.7 s, after which a transfer is begun anew: a PX4 forgets one after 5 s of silence, and then
says nothing to what belongs to it.
"""
BEGINNINGS = 5
FINAL_ACK_TIMEOUT_S = 1.5
BUSY_PAUSE_S = 1.0
MAX_ITEMS = 10_000

_NOT_FINAL = {mavlink.MAV_MISSION_ACCEPTED, mavlink.MAV_MISSION_ERROR}
"""Acknowledgements that may be about something else: a PX4 answers a straggling item, or a repeated MISSION_COUNT,
with ERROR, also while the present transfer is going well. What counts is whether the transfer goes on.
"""

MISSION = mavlink.MAV_MISSION_TYPE_MISSION
FENCE = mavlink.MAV_MISSION_TYPE_FENCE
_KIND_NAMES = {MISSION: "mission", FENCE: "fence", mavlink.MAV_MISSION_TYPE_RALLY: "rally point"}


def _patience() -> Backoff:
    return Backoff(FIRST_TIMEOUT_S, ATTEMPTS, LONGEST_TIMEOUT_S)


def item_message(item: MissionItem, seq: int, peer: tuple[int, int], mission_type: int) -> Message:
    """MISSION_ITEM_INT number `seq` to a component."""
    current, autocontinue = int(seq == 0 and mission_type == MISSION), 1
    where = (item.frame, item.command, current, autocontinue)
    params = (item.param1, item.param2, item.param3, item.param4, item.x, item.y, item.z)
    return mavlink.MAVLink_mission_item_int_message(*peer, seq, *where, *params, mission_type)


def item_content(message: Message) -> MissionItem:
    """What a received MISSION_ITEM_INT says."""
    return MissionItem(
        command=message.command,
        frame=message.frame,
        param1=message.param1,
        param2=message.param2,
        param3=message.param3,
        param4=message.param4,
        x=message.x,
        y=message.y,
        z=message.z,
    )


@dataclass
class MissionUpload:
    """Offer items until the vehicle has taken them all.

    `acknowledged` tells a clean end from one where the final acknowledgement did not arrive.

    Raises:
        MissionTransferError: refused, or no answer.
    """

    items: Sequence[MissionItem]
    peer: tuple[int, int]
    mission_type: int = MISSION
    done: bool = False
    acknowledged: bool = False
    deadline_s: float = math.inf
    wants: frozenset[str] = frozenset({"MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK"})
    _sent: set[int] = field(default_factory=set)
    _backoff: Backoff = field(default_factory=_patience)

    def start(self, now_s: float) -> list[Message]:
        self.deadline_s = now_s + self._backoff.take()
        return [mavlink.MAVLink_mission_count_message(*self.peer, len(self.items), self.mission_type)]

    def receive(self, message: Message, now_s: float) -> list[Message]:
        if message.mission_type != self.mission_type or self.done:
            return []
        if message.get_type() == "MISSION_ACK":
            return self._acknowledged(message, now_s)
        if message.seq >= len(self.items):
            return []  # a straggler of somebody's other transfer
        self._sent.add(message.seq)
        self._backoff = _patience()
        self.deadline_s = now_s + FINAL_ACK_TIMEOUT_S
        return [item_message(self.items[message.seq], message.seq, self.peer, self.mission_type)]

    def handle_timeout(self, now_s: float) -> list[Message]:
        if len(self._sent) == len(self.items) > 0:
            self.done = True  # the acknowledgement may have been lost: reading back will tell
            return []
        if self._backoff.exhausted:
            self.done = True
            raise MissionTransferError(f"{self}: no answer after {len(self._sent)} of {len(self.items)} items")
        if not self._sent or self._backoff.taken >= BEGIN_AGAIN_AFTER:
            return self.start(now_s)
        last = max(self._sent)  # the vehicle repeats its request by itself; this keeps its own timeout from running out
        self.deadline_s = now_s + self._backoff.take()
        return [item_message(self.items[last], last, self.peer, self.mission_type)]

    def _acknowledged(self, message: Message, now_s: float) -> list[Message]:
        if message.type == mavlink.MAV_MISSION_ACCEPTED:
            if len(self._sent) == len(self.items):  # else: an old one
                self.done = self.acknowledged = True
            return []
        if message.type == mavlink.MAV_MISSION_ERROR:
            if not self._sent:
                self.deadline_s = now_s + BUSY_PAUSE_S  # busy with another transfer, which will end or time out
            return []
        self.done = True
        raise MissionTransferError(f"{self}: refused: {enum_name('MAV_MISSION_RESULT', message.type)}")

    def __str__(self) -> str:
        return f"vehicle {self.peer[0]}: {_KIND_NAMES[self.mission_type]} upload"


@dataclass
class MissionDownload:
    """Ask for all items, one after the other; they end up in `items`.

    Raises:
        MissionTransferError: refused, no answer, or a count that cannot be.
    """

    peer: tuple[int, int]
    mission_type: int = MISSION
    items: list[MissionItem] = field(default_factory=list)
    done: bool = False
    deadline_s: float = math.inf
    wants: frozenset[str] = frozenset({"MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_ACK"})
    _count: int | None = None
    _beginnings: int = 1
    _backoff: Backoff = field(default_factory=_patience)

    def start(self, now_s: float) -> list[Message]:
        self.deadline_s = now_s + self._backoff.take()
        if self._count is None:
            return [mavlink.MAVLink_mission_request_list_message(*self.peer, self.mission_type)]
        return [mavlink.MAVLink_mission_request_int_message(*self.peer, len(self.items), self.mission_type)]

    def receive(self, message: Message, now_s: float) -> list[Message]:
        if message.mission_type != self.mission_type or self.done:
            return []
        match message.get_type():
            case "MISSION_COUNT" if self._count is None:
                if message.count > MAX_ITEMS:
                    raise MissionTransferError(f"{self}: {message.count} items are more than {MAX_ITEMS}")
                self._count = message.count
            case "MISSION_ITEM_INT" if self._count is not None and message.seq == len(self.items):
                self.items.append(item_content(message))
            case "MISSION_ACK" if message.type not in _NOT_FINAL:
                self.done = True
                raise MissionTransferError(f"{self}: refused: {enum_name('MAV_MISSION_RESULT', message.type)}")
            case _:
                return []
        self._backoff = _patience()
        if len(self.items) < (self._count or 0):
            return self.start(now_s)
        self.done = True
        return [mavlink.MAVLink_mission_ack_message(*self.peer, mavlink.MAV_MISSION_ACCEPTED, self.mission_type)]

    def handle_timeout(self, now_s: float) -> list[Message]:
        if self._backoff.exhausted:
            self.done = True
            raise MissionTransferError(f"{self}: no answer after {len(self.items)} items")
        if self._count is not None and self._backoff.taken >= BEGIN_AGAIN_AFTER and self._beginnings < BEGINNINGS:
            self._beginnings += 1
            self._count = None
            self.items.clear()
        return self.start(now_s)

    def __str__(self) -> str:
        return f"vehicle {self.peer[0]}: {_KIND_NAMES[self.mission_type]} download"
