"""How much of the ground link reports may take: less when it loses, delays or falls silent, more again after. Sans-IO.

The ground station says once a second how many reports it has heard and how old the newest status is. As congestion
control does: losses and growing delays shrink the budget by a share, quiet seconds let it grow. Losses of a tenth are
taken for the noise of a radio, against which repetitions help, and no smaller budget.
"""

from collections import deque

from companion.events import Sender
from missions.tunnel import RECEIPT_COUNTS, Receipt

LEAST_SHARE = 0.15
"""Of the full budget, is spent even on a link that seems dead: one that comes back is to find the news under way."""
GROWTH = 1.25
"""With each good receipt."""
FINE_LOSS, BAD_LOSS = 0.1, 0.15
"""Up to the one the budget grows, from the other on it shrinks."""
LOSS_WEIGHT = 0.5
"""It shrinks by so many times the share that was lost."""
BACKLOG_S, BACKLOG_FACTOR = 0.5, 0.7
"""A round trip that is longer than the usual by so much means that frames queue up (wall clock)."""
SILENCE_S, SILENCE_FACTOR = 3.0, 0.5
"""After so long without a receipt, and again each further second (wall clock)."""
FORGETTING = 0.02
"""The usual round trip follows longer ones by this share of the difference with each receipt."""
LEAST_COUNTED = 10
"""Reports sent between two receipts from which a share of losses can be told."""
MOST_KEPT = 512
"""Moments at which something was sent; many seconds' worth."""


class ReportBudget:
    """The budget of one companion's reports.

    Args:
        full_bytes_s: the most [bytes/s of vehicle time].
        speed: vehicle seconds per second of the ground station's clock.
    """

    def __init__(self, full_bytes_s: float, speed: float = 1.0) -> None:
        self._full_bytes_s, self._speed = full_bytes_s, speed
        self._bytes_s = full_bytes_s
        self._sent = 0
        self._log: deque[tuple[float, int]] = deque([(float("-inf"), 0)], maxlen=MOST_KEPT)
        self._sender: Sender | None = None
        self._heard_s = float("-inf")
        self._counted: tuple[int, int] | None = None
        self._usual_s: float | None = None

    def bytes_s(self, now_s: float) -> float:
        """What may be sent now [bytes/s of vehicle time]; nobody who ever answered leaves it as it is."""
        if self._sender is not None and now_s - self._heard_s > SILENCE_S * self._speed:
            self._heard_s += self._speed
            self._scale(SILENCE_FACTOR)
        return self._bytes_s

    def spent(self, messages: int, now_s: float) -> None:
        """So many reports were sent just now."""
        if messages:
            self._sent += messages
            self._log.append((now_s, self._sent))

    def take(self, sender: Sender, receipt: Receipt, now_s: float) -> None:
        """A ground station's word; of several, the one that was heard first and is still heard counts."""
        if sender != self._sender:
            if self._sender is not None and now_s - self._heard_s <= SILENCE_S * self._speed:
                return
            self._sender, self._counted, self._usual_s = sender, None, None
        self._heard_s = now_s
        late_s, loss = self._late_s(receipt, now_s), self._loss(receipt)
        if late_s > BACKLOG_S:
            self._scale(BACKLOG_FACTOR)
        elif loss >= BAD_LOSS:
            self._scale(1.0 - LOSS_WEIGHT * loss)
        elif loss <= FINE_LOSS:
            self._scale(GROWTH)

    def _late_s(self, receipt: Receipt, now_s: float) -> float:
        """By how much the round trip is longer than usual, on the ground station's clock [s]."""
        trip_s = max((now_s - receipt.time_boot_ms / 1e3) / self._speed - receipt.age_s, 0.0)
        if self._usual_s is None or trip_s < self._usual_s:
            self._usual_s = trip_s
        late_s = trip_s - self._usual_s
        self._usual_s += FORGETTING * late_s
        return late_s

    def _loss(self, receipt: Receipt) -> float:
        """Share of the reports between two receipts that was lost; 0 while there are too few to tell."""
        sent = self._sent_by(receipt.time_boot_ms / 1e3)
        if self._counted is None:
            self._counted = sent, receipt.heard
            return 0.0
        expected, arrived = sent - self._counted[0], (receipt.heard - self._counted[1]) % RECEIPT_COUNTS
        if expected < LEAST_COUNTED:
            return 0.0
        self._counted = sent, receipt.heard
        return 0.0 if arrived > expected else 1.0 - arrived / expected

    def _sent_by(self, time_s: float) -> int:
        """Reports that had been sent when a status was."""
        earlier = (sent for at_s, sent in reversed(self._log) if at_s <= time_s)
        return next(earlier, self._log[0][1])

    def _scale(self, factor: float) -> None:
        least = LEAST_SHARE * self._full_bytes_s
        self._bytes_s = min(max(factor * self._bytes_s, least), self._full_bytes_s)
