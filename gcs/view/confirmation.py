"""A button that has to be held until it counts; pure."""

import math
from dataclasses import dataclass


@dataclass
class HoldToConfirm:
    """Counts how long a button has been held without a break.

    Args:
        needed_s: so long.
        gap_s: the longest pause between two signs that it is still held.
    """

    needed_s: float = 1.5
    gap_s: float = 0.6
    _since_s: float = math.inf
    _last_s: float = -math.inf
    _done: bool = False

    def held(self, now_s: float) -> bool:
        """A sign that the button is held; True once, when it has been held long enough."""
        if now_s - self._last_s > self.gap_s:
            self._since_s, self._done = now_s, False
        self._last_s = now_s
        if self._done or now_s - self._since_s < self.needed_s:
            return False
        self._done = True
        return True
