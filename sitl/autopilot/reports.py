"""What the autopilot says besides its telemetry: results of requests, and texts for the pilot."""

from collections.abc import Callable
from enum import IntEnum


class Result(IntEnum):
    """MAV_RESULT, as far as this autopilot answers with it."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
    CANCELLED = 6


class Severity(IntEnum):
    """MAV_SEVERITY, as far as it is used."""

    EMERGENCY = 0
    CRITICAL = 2
    ERROR = 3
    WARNING = 4
    INFO = 6


Say = Callable[[Severity, str], None]
"""Hands a text to whoever sends STATUSTEXT."""
