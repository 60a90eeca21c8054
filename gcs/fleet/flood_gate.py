"""How many lines may come at once: what is beyond is counted, not shown. No clock: time is an argument."""

from collections import deque
from dataclasses import dataclass, field


@dataclass
class FloodGate:
    """Lets `most` through in any `window_s`."""

    most: int
    window_s: float
    held_back: int = 0
    """Since the beginning."""
    _recent_s: deque[float] = field(default_factory=deque[float])

    def admits(self, now_s: float) -> bool:
        """Whether one more is let through now."""
        while self._recent_s and now_s - self._recent_s[0] >= self.window_s:
            self._recent_s.popleft()
        if len(self._recent_s) >= self.most:
            self.held_back += 1
            return False
        self._recent_s.append(now_s)
        return True
