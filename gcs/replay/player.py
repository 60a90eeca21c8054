"""Plays a recording into a fleet's state: at any speed, paused, or from any moment on.

Sans-IO: `advance` is given the time of any steadily rising clock. The player's own clock, `position_s`, is that of the
fleet's state: ages of messages are counted on it.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

from gcs.errors import UsageError
from gcs.fleet.fleet import Fleet
from gcs.replay.recording import Recording

LEAST_SPEED, GREATEST_SPEED = 0.1, 100.0
MOST_MESSAGES_AT_ONCE = 3000
"""Steps that hold more are not played but sought: the state is the same, and nothing piles up."""


@dataclass
class Player:
    """A recording that is being played.

    Args:
        recording: what is played.
        on_seek: told whenever `seek` has moved `position_s`. `fleet` may become a new one at any step.
    """

    recording: Recording
    on_seek: list[Callable[[], None]] = field(default_factory=list[Callable[[], None]])
    fleet: Fleet = field(default_factory=Fleet)
    """State of all vehicles at `position_s`."""
    position_s: float = 0.0
    """Since the first record."""
    speed: float = 1.0
    playing: bool = False
    _count: int = 0
    """Records that are in the fleet's state."""
    _last_s: float | None = None

    def __post_init__(self) -> None:
        self.seek(0.0)

    @property
    def duration_s(self) -> float:
        return self.recording.duration_s

    @property
    def at_end(self) -> bool:
        return self.position_s >= self.duration_s

    def play(self) -> None:
        """Go on; at the end, from the beginning."""
        if self.at_end:
            self.seek(0.0)
        self.playing, self._last_s = True, None

    def pause(self) -> None:
        self.playing = False

    def set_speed(self, speed: float) -> None:
        """Recorded seconds per second.

        Raises:
            UsageError: it is not between `LEAST_SPEED` and `GREATEST_SPEED`.
        """
        if not LEAST_SPEED <= speed <= GREATEST_SPEED:
            raise UsageError(f"speed {speed:g}: expected {LEAST_SPEED:g} to {GREATEST_SPEED:g}")
        self.speed = speed

    def seek(self, position_s: float) -> None:
        """Jump to a moment, which is moved into the recording; playing or paused stays as it is."""
        self._jump(min(max(position_s, 0.0), self.duration_s))
        for listener in self.on_seek:
            listener()

    def advance(self, now_s: float) -> None:
        """Play on to where the clock is; stops at the end."""
        elapsed_s = 0.0 if self._last_s is None else max(now_s - self._last_s, 0.0)
        self._last_s = now_s
        if not self.playing:
            return
        target_s = min(self.position_s + elapsed_s * self.speed, self.duration_s)
        until = self.recording.count_until(target_s)
        if until - self._count > MOST_MESSAGES_AT_ONCE:
            self._jump(target_s)
        for time_s, message in self.recording.messages(range(self._count, until)):
            self.fleet.fold(message, time_s)
        self._count, self.position_s = until, target_s
        self.playing = not self.at_end

    def _jump(self, position_s: float) -> None:
        self.fleet, self.position_s = Fleet(), position_s
        for time_s, message in self.recording.messages(self.recording.state_at(position_s)):
            self.fleet.fold(message, time_s)
        self._count = self.recording.count_until(position_s)
