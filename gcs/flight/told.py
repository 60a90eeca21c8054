"""What was told during a recording: the ground station's own log where it lies beside it, else what vehicles said."""

from bisect import bisect_right
from dataclasses import dataclass
from pathlib import Path

import msgspec

from gcs.dialect import mavlink
from gcs.flight.events import BEGAN, Event, severity_of
from gcs.replay.recording import Recording

MOST_BYTES = 64 << 20


@dataclass(frozen=True)
class Told:
    """Events in the order of their times.

    Args:
        events: with `t_s` in the recording.
        unreadable: lines of the log that are no events.
    """

    events: tuple[Event, ...]
    unreadable: int = 0

    def until(self, position_s: float) -> list[Event]:
        """Everything up to a moment."""
        return list(self.events[: bisect_right(self.events, position_s, key=lambda event: event.t_s)])


def read_told(path: Path, recording: Recording) -> Told:
    """The events of a log file, moved onto the recording's clock; without such a file, what the vehicles said."""
    try:
        with path.open("rb") as file:
            lines = file.read(MOST_BYTES).splitlines()
    except OSError:
        return said_by_vehicles(recording)
    events, unreadable = _decoded(lines)
    late_s: float | None = None
    moved: list[Event] = []
    for event in events:
        began_us = event.data.get("unix_us")
        if event.kind == BEGAN and isinstance(began_us, int):  # once, and again after each restart
            late_s = (began_us - recording.began_unix_us) / 1e6
        if late_s is not None:
            moved.append(msgspec.structs.replace(event, t_s=event.t_s + late_s))
    if not moved:
        return said_by_vehicles(recording)
    return Told(tuple(sorted(moved, key=lambda event: event.t_s)), unreadable)


def said_by_vehicles(recording: Recording) -> Told:
    """All STATUSTEXTs of a recording."""
    texts = [
        Event(
            t_s=time_s,
            vehicle=f"vehicle {message.get_srcSystem()}",
            kind="said",
            text=message.text.rstrip("\t\x00 "),
            severity=severity_of(message.severity),
        )
        for kind, records in recording.kinds.items()
        if kind[2] == mavlink.MAVLINK_MSG_ID_STATUSTEXT
        for time_s, message in recording.messages(records)
    ]
    return Told(tuple(sorted(texts, key=lambda event: event.t_s)))


def _decoded(lines: list[bytes]) -> tuple[list[Event], int]:
    events: list[Event] = []
    for line in lines:
        try:
            events.append(msgspec.json.decode(line, type=Event))
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
            continue
    return events, len(lines) - len(events)
