"""What happened in a flight: decisions, commands and what the vehicles said, in order and with times."""

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any, TextIO

import msgspec

from gcs.dialect import mavlink
from gcs.unwritten import Unwritten

BEGAN = "began"
"""The event with which a program's log begins: its `unix_us` tells when that was."""


MOST_KEPT, KEPT_AFTER = 20_000, 15_000
"""Events in memory; the file has all of them."""


class Severity(Enum):
    """How much an event matters to an operator."""

    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


class Event(msgspec.Struct, frozen=True, kw_only=True):
    """One line of the event log."""

    t_s: float
    """Since the start of the program [s, wall clock]."""
    vehicle: str | None
    kind: str
    text: str
    severity: Severity = Severity.INFO
    data: dict[str, Any] = {}


@dataclass
class EventLog:
    """Keeps the newest events, writes all of them as JSON lines, and tells listeners.

    Args:
        clock: seconds on a monotonic clock.
        path: where the JSON lines go, or None.
        keep: go on with what is there; otherwise it is begun anew.
    """

    clock: Callable[[], float]
    path: Path | None = None
    events: list[Event] = field(default_factory=list[Event])
    listeners: list[Callable[[Event], None]] = field(default_factory=list[Callable[[Event], None]])
    keep: bool = False

    def __post_init__(self) -> None:
        self._started_s = self.clock()
        self._unwritten = Unwritten("the event log", self.complain)
        self._file: TextIO | None = self.path.open("a" if self.keep else "w", buffering=1) if self.path else None

    def add(
        self, kind: str, text: str, vehicle: str | None = None, severity: Severity = Severity.INFO, **data: Any
    ) -> None:
        t_s = round(self.clock() - self._started_s, 3)
        event = Event(t_s=t_s, vehicle=vehicle, kind=kind, text=text, severity=severity, data=data)
        self.events.append(event)
        if len(self.events) > MOST_KEPT:
            del self.events[:-KEPT_AFTER]
        if self._file is not None:
            with self._unwritten:
                self._file.write(msgspec.json.encode(event).decode() + "\n")
        for listener in self.listeners:
            listener(event)

    def complain(self, text: str) -> None:
        """A file of the flight can be written no longer."""
        self.add("disk", text, severity=Severity.ERROR)

    def close(self) -> None:
        if self._file is not None:
            with self._unwritten:
                self._file.close()


def severity_of(mav_severity: int) -> Severity:
    """Of a STATUSTEXT: MAV_SEVERITY counts downwards from 7, debug."""
    if mav_severity <= mavlink.MAV_SEVERITY_ERROR:
        return Severity.ERROR
    return Severity.WARNING if mav_severity == mavlink.MAV_SEVERITY_WARNING else Severity.INFO
