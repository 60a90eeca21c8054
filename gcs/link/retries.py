"""When a lost connection is tried again: soon after a good one, ever later where it does not hold. Sans-IO."""

from dataclasses import dataclass

FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.25, 5.0
HELD_S = 5.0
"""A connection that held so long was good: the next try comes soon."""


@dataclass
class Retries:
    """The pauses between tries; each is twice as long as the one before."""

    taken: int = 0
    """Since the last good connection."""

    @property
    def is_first(self) -> bool:
        """Whether what goes wrong now is news."""
        return self.taken == 0

    def held(self, lasted_s: float) -> None:
        """A connection is lost that was there for so long."""
        if lasted_s >= HELD_S:
            self.taken = 0

    def take(self) -> float:
        """How long [s] to wait before the next try."""
        pause_s = min(FIRST_PAUSE_S * 2 ** min(self.taken, 16), LONGEST_PAUSE_S)
        self.taken += 1
        return pause_s
