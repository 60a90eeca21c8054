"""Alerts: what is wrong now, by severity, each told once when it comes and once when it goes; pure.

What trembles around a threshold is one alert, not a flood: an alarm has to be gone for a while before its alert ends.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np

from gcs.flight.events import Severity
from gcs.flight.monitor import Phase

if TYPE_CHECKING:
    from gcs.desk.desk import Desk
    from gcs.desk.observations import Outlook

CALM_S = 3.0
"""For so long an alarm must be gone until its alert ends [s]."""
LOW_BATTERY_PERCENT, EMPTY_BATTERY_PERCENT = 40.0, 20.0
POOR_LINK = 0.8
"""Share of messages that arrive below which a link is called poor."""


class Alarm(Enum):
    """What can be wrong with a vehicle, the worst first: what it is called, and how much it matters."""

    FAILSAFE = ("failsafe", Severity.ERROR)
    TOO_CLOSE = ("nearer to another vehicle than the mission allows", Severity.ERROR)
    LINK_LOST = ("link lost", Severity.ERROR)
    BATTERY_EMPTY = ("battery nearly empty", Severity.ERROR)
    COMPANION_SILENT = ("companion silent", Severity.ERROR)
    INTERRUPTED = ("flight interrupted", Severity.WARNING)
    NEAR_OBSTACLE = ("nearer to an obstacle than the mission allows", Severity.WARNING)
    BATTERY_LOW = ("battery low", Severity.WARNING)
    LINK_POOR = ("poor link", Severity.WARNING)

    @property
    def words(self) -> str:
        return self.value[0]

    @property
    def severity(self) -> Severity:
        return self.value[1]


@dataclass
class Alert:
    """One alarm of one vehicle that is going on."""

    alarm: Alarm
    vehicle: str
    since_s: float
    seen_s: float


@dataclass(frozen=True)
class Change:
    """An alert that has come or gone, for the log."""

    text: str
    vehicle: str
    severity: Severity


@dataclass
class AlertBoard:
    """All alerts that are going on."""

    alerts: dict[tuple[Alarm, str], Alert] = field(default_factory=dict[tuple[Alarm, str], Alert])
    changes: list[Change] = field(default_factory=list[Change])
    """Of the last update."""

    def update(self, alarms: Iterable[tuple[Alarm, str]], now_s: float) -> None:
        """Take in which alarms there are now, as (alarm, vehicle's name)."""
        self.changes = []
        for alarm, vehicle in alarms:
            alert = self.alerts.get((alarm, vehicle))
            if alert is None:
                self.alerts[alarm, vehicle] = Alert(alarm, vehicle, now_s, now_s)
                self.changes.append(Change(alarm.words, vehicle, alarm.severity))
            else:
                alert.seen_s = now_s
        for key, alert in list(self.alerts.items()):
            if now_s - alert.seen_s > CALM_S:
                del self.alerts[key]
                self.changes.append(Change(f"over: {alert.alarm.words}", alert.vehicle, Severity.INFO))

    def by_alarm(self) -> list[tuple[Alarm, list[Alert]]]:
        """The alerts of each alarm together, the worst alarm first and the oldest alert first."""
        together = [(alarm, [a for a in self.alerts.values() if a.alarm is alarm]) for alarm in Alarm]
        return [(alarm, sorted(alerts, key=lambda a: a.since_s)) for alarm, alerts in together if alerts]


def alarms_of(desk: "Desk", outlooks: Mapping[int, "Outlook"], now_s: float) -> list[tuple[Alarm, str]]:
    """Every alarm that there is now, as (alarm, vehicle's name)."""
    found = [(alarm, desk.name(sysid)) for sysid in desk.vehicles for alarm in _of_vehicle(desk, sysid, now_s)]
    mission = desk.mission
    if mission is None:
        return found
    aloft = [sysid for sysid, state in desk.vehicles.items() if state.airborne and sysid in outlooks]
    apart_m = _nearest_m(np.array([outlooks[sysid].position_m for sysid in aloft]).reshape(-1, 3))
    for sysid, other_m in zip(aloft, apart_m, strict=True):
        part = desk.part(sysid)
        if part is not None and part.monitor.phase is Phase.FLYING:
            if other_m < mission.limits.separation_m and outlooks[sysid].progress > 0.1:
                found.append((Alarm.TOO_CLOSE, part.name))
            if outlooks[sysid].clearance_m < mission.limits.body_radius_m + 0.1:
                found.append((Alarm.NEAR_OBSTACLE, part.name))
    return found


def _of_vehicle(desk: "Desk", sysid: int, now_s: float) -> Iterable[Alarm]:
    state, part = desk.vehicles[sysid], desk.part(sysid)
    phase = part.monitor.phase if part is not None else None
    if not state.online(now_s):
        yield Alarm.LINK_LOST
        return
    if state.failsafe:
        yield Alarm.FAILSAFE
    if state.battery_percent < EMPTY_BATTERY_PERCENT:
        yield Alarm.BATTERY_EMPTY
    elif state.battery_percent < LOW_BATTERY_PERCENT:
        yield Alarm.BATTERY_LOW
    if phase is Phase.INTERRUPTED:
        yield Alarm.INTERRUPTED
    needed = part is not None and part.monitor.flown_by_companion and phase in {Phase.FLYING, Phase.HOVERING}
    if needed and not state.companion_online(now_s):
        yield Alarm.COMPANION_SILENT
    outlook = desk.observations.outlooks.get(sysid)
    if outlook is not None and outlook.link_quality < POOR_LINK:
        yield Alarm.LINK_POOR


def _nearest_m(places_m: np.ndarray) -> list[float]:
    """Distance of each of (n, 3) places to the nearest other one; infinite for a single one."""
    if len(places_m) < 2:
        return [math.inf] * len(places_m)
    apart_m = np.linalg.norm(places_m[:, None] - places_m[None], axis=2)
    np.fill_diagonal(apart_m, np.inf)
    return apart_m.min(axis=1).tolist()
