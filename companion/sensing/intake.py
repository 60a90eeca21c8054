"""What is taken in from outside, and why something is not; the same for every sensor."""

from enum import Enum

OLDEST_S = 0.5
"""Vehicle time after which what was seen is of no use any more."""
AHEAD_S = 0.2
"""A stamp farther in the future is of another clock."""


class Dropped(Enum):
    """Why something that a sensor sent was not used."""

    MALFORMED = "malformed"
    CLOCK = "not of the vehicle's time"
    LATE = "late"
    TWICE = "twice"
    TOO_MANY = "too many"
    NO_POSE = "no pose"
    OVERTAKEN = "overtaken"


def is_current(stamp_s: float, now_s: float) -> bool:
    """Whether a stamp is of the vehicle's clock, and not too old."""
    return now_s - OLDEST_S <= stamp_s <= now_s + AHEAD_S
