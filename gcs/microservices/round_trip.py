"""How long an answer takes, and so when a lost one is to be missed: RFC 6298's estimator for short exchanges."""

from dataclasses import dataclass

UNKNOWN_TIMEOUT_S = 0.5
"""Patience before the first answer."""
LEAST_WEIGHT = 1 / 20
"""Of one observation of loss; the first ones weigh more."""
MOST_LOSS = 0.95
LEAST_MARGIN_S = 0.02
"""An autopilot's main loop, and the scheduling at both ends."""
SHORTEST_TIMEOUT_S, LONGEST_TIMEOUT_S = 0.03, 3.0


@dataclass
class RoundTrip:
    """Smoothed round-trip time and its variation [s]; `None` before the first sample."""

    smoothed_s: float | None = None
    variation_s: float = 0.0

    def sample(self, round_trip_s: float) -> None:
        """Take in one measured round trip of something that was sent once (Karn's rule)."""
        if self.smoothed_s is None:
            self.smoothed_s, self.variation_s = round_trip_s, round_trip_s / 4
            return
        self.variation_s += (abs(round_trip_s - self.smoothed_s) - self.variation_s) / 4
        self.smoothed_s += (round_trip_s - self.smoothed_s) / 8

    @property
    def timeout_s(self) -> float:
        """When an answer is late."""
        if self.smoothed_s is None:
            return UNKNOWN_TIMEOUT_S
        late_s = self.smoothed_s + max(4 * self.variation_s, LEAST_MARGIN_S)
        return min(max(late_s, SHORTEST_TIMEOUT_S), LONGEST_TIMEOUT_S)


@dataclass
class LossEstimate:
    """Share of frames that get lost, from what is seen of groups of copies."""

    share: float = 0.0
    observations: int = 0

    def saw_lost(self, copies: int = 1) -> None:
        """No copy of something got through."""
        for _ in range(copies):
            self._take(1.0)

    def saw_through(self, copies: int = 1) -> None:
        """At least one copy got through; how many of them did is what the present estimate expects."""
        all_lost = self.share**copies
        expected = (self.share - all_lost) / (1.0 - all_lost) if copies > 1 else 0.0
        for _ in range(copies):
            self._take(expected)

    def _take(self, lost: float) -> None:
        weight = max(LEAST_WEIGHT, 1 / (self.observations + 8))
        self.observations += 1
        self.share = min(self.share + weight * (lost - self.share), MOST_LOSS)
