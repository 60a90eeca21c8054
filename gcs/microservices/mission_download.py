"""Downloading a plan with requests ahead of the vehicle's answers.

A PX4 gives out items strictly in order: it answers a request for the item that is next, or for the one before it once
more, and drops the whole download at any other. So requests run ahead in order, each in as many copies as keep the
risk low that all of one's copies are lost; what is missing after a pass is asked for in a second one.
"""

import math
from dataclasses import dataclass, field

from gcs.dialect import Message, enum_name, mavlink
from gcs.errors import MissionTransferError
from gcs.microservices import Microservice
from gcs.microservices.mission_messages import (
    FORGOTTEN_AFTER_S,
    KIND_NAMES,
    MAX_ITEMS,
    MISSION,
    MISSION_TURN,
    PASSING_RESULTS,
    LinkEstimate,
    copies_at,
    item_content,
)
from gcs.microservices.round_trip import LossEstimate, RoundTrip
from missions.mission_items import MissionItem

PATIENCE_S = 60.0
"""Silence after which a download is given up."""
LONGEST_PAUSE_S = 1.0
MOST_REQUESTS_IN_FLIGHT = 32
"""Copies included: 0.5 kB up, and up to 1.6 kB of items down."""
MOST_COPIES = 16
CAUTION = 1.3
"""The estimate of the loss may be too low by so much."""
PASS_COST = 40
"""Beginning a pass takes the time of so many items."""
LEAST_LOSS = 0.005
"""Below it nothing is sent twice."""
SHORT_PASS, SHORT_PASSES = 40, 4
"""So many passes in a row that end before so many items: requests are overtaken on their way."""
TRIES_OF_LAST, TRIES_ALONE = 3, 10
"""Repetitions of the last request before it is taken that the vehicle has dropped the download."""
SPREAD = 8
"""Times the mean variation of a round trip that frames which leave together may arrive apart ..."""
LATECOMERS_S = 0.3
"""... and so much more: what a link holds back, or sends twice, does not show in the answers that come first."""


@dataclass
class MissionDownload(Microservice):
    """Ask for all items; they end up in `items`.

    Args:
        peer: system and component.
        mission_type: MAV_MISSION_TYPE.
        link: what is known of the link beforehand.

    Raises:
        MissionTransferError: refused, no answer for `PATIENCE_S`, or a count that cannot be.
    """

    peer: tuple[int, int]
    mission_type: int = MISSION
    link: LinkEstimate = field(default_factory=LinkEstimate)
    items: list[MissionItem] = field(default_factory=list[MissionItem])
    opaque_id: int = 0
    """What the vehicle calls the plan; 0 if it has no name for it."""
    done: bool = False
    deadline_s: float = math.inf
    wants: frozenset[str] = frozenset({"MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_ACK"})
    turn: str | None = MISSION_TURN

    def __post_init__(self) -> None:
        self._round_trip: RoundTrip = self.link.round_trip()
        self._loss: LossEstimate = self.link.loss_estimate()
        self._loss.share = 1.0 - (1.0 - self.link.loss) ** 2  # of a request or its answer
        self._count: int | None = None
        self._found: dict[int, MissionItem] = {}
        self._pass: _Pass | None = None
        """Is there once the vehicle has answered the list request."""
        self._lists = self._missing_until = 0
        self._led_to = 0
        """The vehicle has been led past all items before this one in an earlier pass."""
        self._list_s: float | None = None
        self._keeps_order = True
        """Answers have come in the order of their requests; on a link that does not keep it one item is asked for at a
        time, since a request that is overtaken ends the download as a lost one does.
        """
        self._short_passes = 0
        self._heard_s = -math.inf

    @property
    def learned(self) -> LinkEstimate:
        """The link as this transfer has found it."""
        return LinkEstimate(self._round_trip.smoothed_s, self._one_way_loss, self._round_trip.variation_s)

    def start(self, now_s: float) -> list[Message]:
        self._heard_s = now_s
        return self._ask_for_list(now_s)

    def receive(self, message: Message, now_s: float) -> list[Message]:
        if message.mission_type != self.mission_type or self.done:
            return []
        match message.get_type():
            case "MISSION_COUNT":
                return self._counted(message, now_s)
            case "MISSION_ITEM_INT" if self._count is not None and 0 <= message.seq < self._count:
                return self._item(message, now_s)
            case "MISSION_ACK":
                return self._acknowledgement(message.type, now_s)
            case _:
                return []

    def handle_timeout(self, now_s: float) -> list[Message]:
        if now_s - self._heard_s > PATIENCE_S:
            self.done = True
            raise MissionTransferError(f"{self}: no answer after {len(self._found)} items")
        walk = self._pass
        if walk is None or now_s - walk.heard_s > FORGOTTEN_AFTER_S:
            return self._ask_for_list(now_s)
        for late in walk.drop_late(now_s - self._round_trip.timeout_s):
            if not self._keeps_order:  # otherwise the next answer tells that it is lost
                self._loss.saw_lost(late.copies)
        if walk.in_flight:
            return self._fill(walk, now_s)
        return self._stalled(walk, now_s)

    def abandon(self) -> list[Message]:
        """What ends a transfer before its time."""
        cancelled = mavlink.MAV_MISSION_OPERATION_CANCELLED
        return [mavlink.MAVLink_mission_ack_message(*self.peer, cancelled, self.mission_type)]

    # ------------------------------------------------------------------ steps
    def _ask_for_list(self, now_s: float) -> list[Message]:
        """A pass over the vehicle's plan begins with a request for its length."""
        if self._pass is not None:
            self._led_to = max(self._led_to, self._pass.next_seq)
            self._short_passes = self._short_passes + 1 if self._pass.next_seq < SHORT_PASS else 0
            self._keeps_order = self._keeps_order and self._short_passes < SHORT_PASSES
            self._pass = None
        self._list_s = now_s if self._list_s is None else math.nan  # no sample of the second on: which one is answered?
        pause_s = self._round_trip.timeout_s * 1.5 ** min(self._lists, 8)
        self._lists += 1
        self.deadline_s = now_s + min(pause_s, max(LONGEST_PAUSE_S, self._round_trip.timeout_s))
        copies = copies_at(self._one_way_loss) if self._is_steady else 1
        return [mavlink.MAVLink_mission_request_list_message(*self.peer, self.mission_type)] * copies

    def _counted(self, message: Message, now_s: float) -> list[Message]:
        if message.count > MAX_ITEMS:
            self.done = True
            raise MissionTransferError(f"{self}: {message.count} items are more than {MAX_ITEMS}")
        if self._pass is not None:
            return []  # a copy
        if (self._count, self.opaque_id) != (message.count, message.opaque_id):
            self._found.clear()  # another plan than in the pass before
            self._missing_until, self._led_to = message.count, 0
        self._count, self.opaque_id = message.count, message.opaque_id
        if self._list_s is not None and math.isfinite(self._list_s):
            self._round_trip.sample(now_s - self._list_s)
        self._heard_s, self._lists = now_s, 0
        walk = self._pass = _Pass(now_s)
        return self._end() if self._complete else self._fill(walk, now_s)

    def _item(self, message: Message, now_s: float) -> list[Message]:
        seq, walk = message.seq, self._pass
        self._heard_s = now_s
        if walk is None or seq >= walk.next_seq:
            return []  # not asked for in this pass
        self._found.setdefault(seq, item_content(message))
        if seq < walk.highest_answered and seq not in walk.answers:
            self._keeps_order = False
        self._learn(walk, seq, now_s)
        walk.answered(seq, now_s)
        return self._end() if self._complete else self._fill(walk, now_s)

    def _learn(self, walk: "_Pass", seq: int, now_s: float) -> None:
        """An answer tells the round trip, and that requests before it, or their answers, are lost."""
        if seq not in walk.in_flight:
            return
        if walk.in_flight[seq].copies == 1:
            self._round_trip.sample(now_s - walk.in_flight[seq].sent_s)
        self._loss.saw_through(walk.in_flight[seq].copies)
        for earlier in [other for other in walk.in_flight if other < seq]:
            self._loss.saw_lost(walk.in_flight.pop(earlier).copies)

    def _fill(self, walk: "_Pass", now_s: float) -> list[Message]:
        """Request what there is room for, in order."""
        messages: list[Message] = []
        most = MOST_REQUESTS_IN_FLIGHT if self._keeps_order else 1
        room = most - sum(flight.copies for flight in walk.in_flight.values())
        end = self._end_of_pass
        while walk.next_seq < end and not self._waits(walk):
            copies = self._copies(walk.next_seq)
            if copies > room and walk.in_flight:
                break
            room -= copies
            messages += self._request(walk, walk.next_seq, copies, now_s)
        timeout_s = self._round_trip.timeout_s
        oldest_s = min((flight.sent_s for flight in walk.in_flight.values()), default=now_s)
        self.deadline_s = max(oldest_s + timeout_s, now_s + 1e-3)
        return messages

    def _request(self, walk: "_Pass", seq: int, copies: int, now_s: float) -> list[Message]:
        walk.in_flight[seq] = _InFlight(now_s, copies)
        walk.next_seq = max(walk.next_seq, seq + 1)
        return [mavlink.MAVLink_mission_request_int_message(*self.peer, seq, self.mission_type)] * copies

    def _stalled(self, walk: "_Pass", now_s: float) -> list[Message]:
        """No answer is to be expected any more: ask for the last item again, which is allowed, or begin a pass."""
        last, end = walk.next_seq - 1, self._end_of_pass
        answered = walk.highest_answered == last
        tries = TRIES_OF_LAST if self._keeps_order else TRIES_ALONE
        if last >= 0 and not answered and walk.tries < tries and self._is_worth_asking_again(last, end):
            walk.tries += 1
            copies = min(2 * self._copies(last), MOST_COPIES) if self._may_copy else 1
            messages = self._request(walk, last, copies, now_s)
            self.deadline_s = now_s + self._round_trip.timeout_s
            return messages
        if not answered:
            self._loss.saw_lost()
        return self._ask_for_list(now_s)

    def _is_worth_asking_again(self, last: int, end: int) -> bool:
        """Not if a further pass is needed anyway."""
        return last + 1 < end or all(seq in self._found for seq in range(last))

    def _waits(self, walk: "_Pass") -> bool:
        """What an earlier pass has lost is waited for before the vehicle is led past it once more."""
        last = walk.next_seq - 1
        if not self._keeps_order:
            return last >= 0 and last not in walk.answers
        return 0 <= last < self._led_to and last not in self._found

    def _copies(self, seq: int) -> int:
        """So many that the work of a lost pass, times its likelihood, is about that of one more copy."""
        one_way = self._one_way_loss
        if one_way < LEAST_LOSS or not self._may_copy:
            return 1
        rate = -math.log(min(CAUTION * one_way, 0.9))
        return min(max(math.ceil(math.log((seq + PASS_COST) * rate) / rate), 1), MOST_COPIES)

    @property
    def _may_copy(self) -> bool:
        return self._keeps_order or self._is_steady

    @property
    def _is_steady(self) -> bool:
        """Whether all copies of a request arrive before one that is sent when the first of them is answered."""
        trip = self._round_trip
        return trip.smoothed_s is not None and SPREAD * trip.variation_s + LATECOMERS_S < trip.smoothed_s

    @property
    def _one_way_loss(self) -> float:
        return 1.0 - math.sqrt(1.0 - self._loss.share)

    @property
    def _end_of_pass(self) -> int:
        """One past the last item that is missing."""
        while self._missing_until and self._missing_until - 1 in self._found:
            self._missing_until -= 1
        return self._missing_until

    @property
    def _complete(self) -> bool:
        return self._count is not None and len(self._found) == self._count

    def _end(self) -> list[Message]:
        self.items[:] = [self._found[seq] for seq in range(len(self._found))]
        self.done = True
        return [mavlink.MAVLink_mission_ack_message(*self.peer, mavlink.MAV_MISSION_ACCEPTED, self.mission_type)]

    def _acknowledgement(self, result: int, now_s: float) -> list[Message]:
        if result not in PASSING_RESULTS:
            self.done = True
            raise MissionTransferError(f"{self}: refused: {enum_name('MAV_MISSION_RESULT', result)}")
        walk = self._pass
        settled = walk is not None and now_s - walk.begun_s > self._round_trip.timeout_s
        if result == mavlink.MAV_MISSION_ERROR and settled:  # a request has overtaken one that is lost: all is dropped
            self._loss.saw_lost()
            return self._ask_for_list(now_s)
        return []

    def __str__(self) -> str:
        return f"vehicle {self.peer[0]}: {KIND_NAMES[self.mission_type]} download"


@dataclass(frozen=True)
class _InFlight:
    sent_s: float
    copies: int


@dataclass
class _Pass:
    """One walk over the vehicle's items, from the first on."""

    begun_s: float
    next_seq: int = 0
    """The item to be requested next."""
    in_flight: dict[int, _InFlight] = field(default_factory=dict[int, _InFlight])
    """Requested, and their answer may still come."""
    heard_s: float = -math.inf
    highest_answered: int = -1
    answers: set[int] = field(default_factory=set[int])
    tries: int = 0
    """Repetitions of the last request since the last answer."""

    def __post_init__(self) -> None:
        self.heard_s = self.begun_s

    def answered(self, seq: int, now_s: float) -> None:
        self.in_flight.pop(seq, None)
        self.answers.add(seq)
        self.highest_answered = max(self.highest_answered, seq)
        self.heard_s, self.tries = now_s, 0

    def drop_late(self, before_s: float) -> list[_InFlight]:
        """Stop waiting for what was sent so long ago; returns what that is."""
        late = [seq for seq, flight in self.in_flight.items() if flight.sent_s <= before_s + 1e-6]
        return [self.in_flight.pop(seq) for seq in late]
