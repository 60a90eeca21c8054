"""Keeping what goes out over a connection within its budget: urgent frames first, bounded queues. Sans-IO."""

from collections import deque
from dataclasses import dataclass, field
from enum import IntEnum

BURST_S = 0.1
"""So much of the budget may go out at once."""
LONGEST_WAIT_S = 2.0
"""What would have to wait longer is dropped: whoever sent it asks again."""


class Urgency(IntEnum):
    """Which frames go first."""

    CONTROL = 0
    """Heartbeats, commands, acknowledgements."""
    BULK = 1
    """Items, parameters, requests for telemetry."""


Frame = tuple[bytes, tuple[str, int]]


@dataclass
class Shaper:
    """A token bucket with one queue per urgency.

    Args:
        budget_bytes_s: what may go out per second; None is without limit.
    """

    budget_bytes_s: float | None
    dropped: int = 0
    _tokens: float = 0.0
    _filled_s: float | None = None
    _queues: dict[Urgency, deque[Frame]] = field(default_factory=lambda: {urgency: deque() for urgency in Urgency})
    _waiting_bytes: dict[Urgency, int] = field(default_factory=lambda: dict.fromkeys(Urgency, 0))

    def offer(self, frame: bytes, address: tuple[str, int], urgency: Urgency, now_s: float) -> list[Frame]:
        """Hand in a frame; what may go out now."""
        if self.budget_bytes_s is None:
            return [(frame, address)]
        if self._waiting_bytes[urgency] + len(frame) > LONGEST_WAIT_S * self.budget_bytes_s:
            self.dropped += 1
            return self.due(now_s)
        self._queues[urgency].append((frame, address))
        self._waiting_bytes[urgency] += len(frame)
        return self.due(now_s)

    def due(self, now_s: float) -> list[Frame]:
        """What may go out now."""
        if self.budget_bytes_s is None:
            return []
        most = max(BURST_S * self.budget_bytes_s, 300.0)  # the longest frame has 280 bytes
        since_s = now_s - self._filled_s if self._filled_s is not None else BURST_S
        self._tokens, self._filled_s = min(self._tokens + since_s * self.budget_bytes_s, most), now_s
        out: list[Frame] = []
        for urgency, queue in self._queues.items():
            while queue and len(queue[0][0]) <= self._tokens:
                self._tokens -= len(queue[0][0])
                self._waiting_bytes[urgency] -= len(queue[0][0])
                out.append(queue.popleft())
            if queue:
                break
        return out

    @property
    def wait_s(self) -> float | None:
        """Until the next frame may go out; None if nothing waits."""
        waiting = next((queue[0][0] for queue in self._queues.values() if queue), None)
        if waiting is None or self.budget_bytes_s is None:
            return None
        return max((len(waiting) - self._tokens) / self.budget_bytes_s, 1e-3)


def fitting_rates(
    wanted_hz: dict[int, float], frame_bytes: dict[int, int], n_vehicles: int, budget_bytes_s: float | None
) -> dict[int, float]:
    """Telemetry rates [Hz] by message id, scaled down together until all vehicles of a link fit into its budget."""
    if budget_bytes_s is None:
        return wanted_hz
    needed = n_vehicles * sum(rate_hz * frame_bytes[message_id] for message_id, rate_hz in wanted_hz.items())
    scale = min(1.0, TELEMETRY_SHARE * budget_bytes_s / needed) if needed else 1.0
    return {message_id: rate_hz * scale for message_id, rate_hz in wanted_hz.items()}


TELEMETRY_SHARE = 0.7
"""Of a link's budget; the rest is for what else the vehicles say."""
