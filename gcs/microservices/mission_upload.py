"""Uploading a plan with a window of items ahead of the vehicle's requests.

The vehicle pulls item by item, and each round trip would cost one item. A PX4 takes items that come before it has asked
for them, in order, and ignores all others; its request for item k says that it has taken all before k. So items go out
ahead (a window), and from the lost one again when its answer is late (go-back-N). See docs/ground-link.md.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from gcs.dialect import Message, enum_name, mavlink
from gcs.errors import MissionTransferError
from gcs.microservices import Microservice
from gcs.microservices.mission_messages import (
    FORGOTTEN_AFTER_S,
    KIND_NAMES,
    MISSION,
    MISSION_TURN,
    MOST_IN_FLIGHT,
    PASSING_RESULTS,
    LinkEstimate,
    copies_at,
    item_message,
)
from gcs.microservices.round_trip import LossEstimate, RoundTrip
from missions.mission_items import MissionItem

BUSY_PAUSE_S = 1.0
SHORT_PAUSES = 2
"""After so many answers "busy" only silence helps: each MISSION_COUNT keeps a dead client's upload alive."""
PATIENCE_S = 60.0
"""Silence after which an upload is given up."""
LONGEST_PAUSE_S = 1.0
"""Between two tries on a link that is down."""
WINDOW_OF_LOSS = 0.6
"""Window x loss: what goes out behind a lost item is sent again, so a longer window trades messages for time."""
SAME_BURST_S = 0.005
LEAST_WINDOW = 3
"""A vehicle answers nothing to an item that it has: only the ones behind it show that its request was lost."""
ERRORS_THAT_COUNT = 2


@dataclass
class MissionUpload(Microservice):
    """Offer items until the vehicle has taken them all.

    At the end `acknowledged` tells whether the vehicle has said so; if not, all items were sent and only reading back
    tells what is stored.

    Args:
        items: what is to be stored.
        peer: system and component.
        mission_type: MAV_MISSION_TYPE.
        link: what is known of the link beforehand.

    Raises:
        MissionTransferError: refused, or no answer for `PATIENCE_S`; the old plan stays.
    """

    items: Sequence[MissionItem]
    peer: tuple[int, int]
    mission_type: int = MISSION
    link: LinkEstimate = field(default_factory=LinkEstimate)
    done: bool = False
    acknowledged: bool = False
    deadline_s: float = math.inf
    wants: frozenset[str] = frozenset({"MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK"})
    turn: str | None = MISSION_TURN
    items_sent: int = 0
    """Item messages, copies included."""

    def __post_init__(self) -> None:
        self._round_trip: RoundTrip = self.link.round_trip()
        self._loss: LossEstimate = self.link.loss_estimate()
        self._copies, self._window = 1, MOST_IN_FLIGHT
        self._base: int | None = None
        """All items before are taken; None until the vehicle has asked for one."""
        self._next = 0
        """The item to be sent next."""
        self._most_sent = 0
        """Items that have been sent at least once."""
        self._sent_s = [-math.inf] * len(self.items)
        self._repeated = bytearray(len(self.items))
        self._count_s: float | None = None
        self._counts = self._late = self._errors = self._low_requests = self._busy_answers = 0
        self._heard_s = -math.inf
        self._last_request = -1

    @property
    def all_sent(self) -> bool:
        """Whether the vehicle may have the whole plan."""
        return self._most_sent == len(self.items)

    @property
    def taken(self) -> int:
        """Items that the vehicle is known to have taken."""
        return self._base or 0

    @property
    def learned(self) -> LinkEstimate:
        """The link as this transfer has found it."""
        return LinkEstimate(self._round_trip.smoothed_s, self._loss.share, self._round_trip.variation_s)

    def start(self, now_s: float) -> list[Message]:
        self._heard_s = now_s
        return self._begin(now_s)

    def receive(self, message: Message, now_s: float) -> list[Message]:
        if message.mission_type != self.mission_type or self.done:
            return []
        if message.get_type() == "MISSION_ACK":
            return self._acknowledgement(message.type, now_s)
        if not 0 <= message.seq < len(self.items) or message.seq > self._most_sent:
            return []  # a straggler of somebody's other transfer
        return self._requested(message.seq, now_s)

    def handle_timeout(self, now_s: float) -> list[Message]:
        if now_s - self._heard_s > PATIENCE_S:
            self.done = True
            raise MissionTransferError(f"{self}: no answer after {self.taken} of {len(self.items)} items")
        if self._base is None:
            return self._begin(now_s)
        if now_s - self._heard_s > FORGOTTEN_AFTER_S:  # forgotten, or stored: the last request or ACK may be lost
            self.done = self.all_sent
            return [] if self.done else self._begin(now_s)
        self._late += 1
        self._next = self._base
        return self._fill(now_s)

    # ------------------------------------------------------------------ steps
    def _begin(self, now_s: float) -> list[Message]:
        self._count_s = now_s if self._count_s is None else math.nan  # no sample of the second try on
        self._base, self._next, self._errors = None, 0, 0
        pause_s = self._round_trip.timeout_s * 1.5 ** min(self._counts, 8)
        self._counts += 1
        self.deadline_s = now_s + min(pause_s, max(LONGEST_PAUSE_S, self._round_trip.timeout_s))
        return [mavlink.MAVLink_mission_count_message(*self.peer, len(self.items), self.mission_type)]

    def _requested(self, seq: int, now_s: float) -> list[Message]:
        self._heard_s, self._errors = now_s, 0
        self._low_requests = self._low_requests + 1 if seq == self._last_request else 0
        self._last_request = seq
        if self._base is None:
            if self._count_s is not None and math.isfinite(self._count_s):
                self._round_trip.sample(now_s - self._count_s)
            self._counts = 0
            self._base, self._next = seq, seq
        elif seq > self._base:
            self._progress(seq, now_s)
        elif seq < self._base and self._low_requests:  # twice in a row: it has begun anew
            self._base = self._next = seq
        elif seq == self._base and now_s - self._sent_s[seq] > self._round_trip.timeout_s:
            self._next = seq
        return self._fill(now_s)

    def _progress(self, seq: int, now_s: float) -> None:
        assert self._base is not None
        for _ in range(self._base, seq):
            self._loss.saw_through(self._copies)
        if self._repeated[self._base] and seq == self._base + 1:  # had only the request been lost, it would be farther
            self._loss.saw_lost(self._copies)
        if not self._repeated[seq - 1]:
            self._round_trip.sample(now_s - self._sent_s[seq - 1])
        self._base, self._next, self._late = seq, max(self._next, seq), 0

    def _fill(self, now_s: float) -> list[Message]:
        """Send what the window has room for."""
        assert self._base is not None
        self._size_window()
        end = min(self._base + self._window, len(self.items))
        messages: list[Message] = []
        for seq in range(self._next, end):
            self._repeated[seq] = self._repeated[seq] or self._sent_s[seq] > -math.inf
            self._sent_s[seq] = now_s
            messages += [item_message(self.items[seq], seq, self.peer, self.mission_type)] * self._copies
        self.items_sent += len(messages)
        self._next = max(self._next, end)
        self._most_sent = max(self._most_sent, end)
        pause_s = self._round_trip.timeout_s * 1.5 ** min(self._late, 8)
        pause_s = min(pause_s, max(LONGEST_PAUSE_S, self._round_trip.timeout_s))
        self.deadline_s = max(self._awaited_since_s(self._base) + pause_s, now_s + 1e-3)
        return messages

    def _awaited_since_s(self, base: int) -> float:
        """When that was sent whose answer will be missed.

        The last item of a burst is as likely to have lost its request as itself: the next burst's answer will tell.
        """
        follows = base + 1
        is_last = follows < self._next and self._sent_s[follows] > self._sent_s[base] + SAME_BURST_S
        return self._sent_s[follows if is_last else base]

    def _size_window(self) -> None:
        """As many frames as are likely to get through without a loss, at most `MOST_IN_FLIGHT` under way."""
        loss = self._loss.share
        self._copies = copies_at(loss)
        until_loss = WINDOW_OF_LOSS / max(loss**self._copies, 1e-3)
        self._window = max(LEAST_WINDOW, min(MOST_IN_FLIGHT // self._copies, math.ceil(until_loss)))

    def _acknowledgement(self, result: int, now_s: float) -> list[Message]:
        if result not in PASSING_RESULTS:
            self.done = True
            raise MissionTransferError(f"{self}: refused: {enum_name('MAV_MISSION_RESULT', result)}")
        if result == mavlink.MAV_MISSION_ACCEPTED:
            self.done = self.acknowledged = self.all_sent and (self._base is not None or not self.items)
            return []
        self._heard_s = now_s
        self._errors += 1
        if self._base is None:
            return self._busy(now_s)
        if self.all_sent and self._next == len(self.items):
            self.done = self._errors >= ERRORS_THAT_COUNT  # it is idle: stored, or forgotten
        elif self._errors >= ERRORS_THAT_COUNT * self._window * self._copies:
            return self._begin(now_s)  # it is idle, and has not got everything
        return []

    def _busy(self, now_s: float) -> list[Message]:
        """Another transfer is under way: ours, which this cancels, or somebody's, which will end or be forgotten."""
        self._busy_answers += 1
        pause_s = BUSY_PAUSE_S if self._busy_answers <= SHORT_PAUSES else FORGOTTEN_AFTER_S + BUSY_PAUSE_S
        self.deadline_s = now_s + pause_s
        return self.abandon() if self._most_sent == 0 else []

    def abandon(self) -> list[Message]:
        """What ends a transfer before its time; the vehicle keeps its old plan."""
        cancelled = mavlink.MAV_MISSION_OPERATION_CANCELLED
        return [mavlink.MAVLink_mission_ack_message(*self.peer, cancelled, self.mission_type)]

    def __str__(self) -> str:
        return f"vehicle {self.peer[0]}: {KIND_NAMES[self.mission_type]} upload"
