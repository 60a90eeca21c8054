"""The fleet as one HTML table: state in, text out; pure."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from html import escape

import numpy as np

from gcs.desk import Desk
from gcs.fleet.vehicle_state import VehicleState
from gcs.flight.monitor import Phase, VehicleMonitor
from gcs.flight.preflight import autopilots_reasons
from gcs.view import words
from gcs.view.colours import Rgb, Tone, css
from gcs.view.sightings import Sighting, vehicle_colours, vehicle_names
from gcs.view.words import NOTHING

HEADINGS = (
    "Vehicle",
    "Mode",
    "Phase",
    "Battery",
    "Height",
    "Speed",
    "Clear",
    "To target",
    "Way",
    "ETA",
    "Companion",
    "Replan",
    "Heard",
    "Link",
    "Signed",
)

EMPTY = f"<td>{NOTHING}</td>"
FEW = 6
"""Vehicles up to which there is room for air between the rows."""


@dataclass(frozen=True)
class Row:
    """One vehicle; words come with their tone, numbers in SI units, NaN where there is none."""

    name: str
    colour: Rgb
    selected: bool
    mode: tuple[str, Tone] = ("not heard", Tone.QUIET)
    phase: tuple[str, Tone] = (NOTHING, Tone.QUIET)
    reason: str = ""
    battery_percent: float = math.nan
    height_m: float = math.nan
    speed_m_s: float = math.nan
    clearance_m: float = math.nan
    to_target_m: float = math.nan
    progress: float = math.nan
    eta_s: float = math.nan
    companion: tuple[str, Tone] = (NOTHING, Tone.QUIET)
    replan_ms: float = math.nan
    heard: tuple[str, Tone] = (NOTHING, Tone.QUIET)
    quality: float = math.nan
    trust: tuple[str, Tone] = (NOTHING, Tone.QUIET)


def rows(desk: Desk, seen: Iterable[Sighting], selected: set[int], now_s: float) -> list[Row]:
    """One row per vehicle of the mission, and of whoever else was heard."""
    names, places = vehicle_names(desk), {sighting.sysid: sighting for sighting in seen}
    colours = vehicle_colours(names)
    return [_row(desk, sysid, names[sysid], colours[sysid], places, selected, now_s) for sysid in names]


def render(table: Sequence[Row]) -> str:
    """The table; a large fleet's rows stand closer."""
    head = "".join(f"<th>{heading}</th>" for heading in HEADINGS)
    body = "".join(_render_row(row) for row in table)
    many = " many" if len(table) > FEW else ""
    return (
        f'<section class="gcs-fleet{many}"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></section>'
    )


def _row(
    desk: Desk, sysid: int, name: str, colour: Rgb, places: dict[int, Sighting], selected: set[int], now_s: float
) -> Row:
    state = desk.vehicles.get(sysid)
    if state is None:
        return Row(name, colour, sysid in selected)
    part = desk.flight.vehicles.get(sysid) if desk.flight is not None else None
    monitor = part.monitor if part is not None else None
    sighting, status = places.get(sysid), state.companion.status
    outlook = desk.observations.outlooks.get(sysid)
    under_way = outlook is not None and monitor is not None and monitor.phase.in_flight
    return Row(
        name,
        colour,
        sysid in selected,
        mode=words.mode_words(state, now_s),
        phase=_phase(state, monitor),
        reason=_reason(state, monitor),
        battery_percent=state.battery_percent,
        height_m=float(sighting.position_m[2]) if sighting else math.nan,
        speed_m_s=float(np.linalg.norm(state.velocity_enu_m_s)) if sighting else math.nan,
        clearance_m=outlook.clearance_m if outlook is not None and state.airborne else math.nan,
        to_target_m=_distance_m(sighting, monitor),
        progress=outlook.progress if under_way and outlook is not None else math.nan,
        eta_s=outlook.eta_s if under_way and outlook is not None else math.nan,
        companion=words.companion_words(state, now_s),
        replan_ms=status.replan_p50_ms if status is not None and status.replans else math.nan,
        heard=words.age_words(now_s - state.telemetry_s),
        quality=outlook.link_quality if outlook is not None else math.nan,
        trust=words.trust_words(desk.station.codec.signing.trust(sysid)),
    )


def _is_unready(state: VehicleState, monitor: VehicleMonitor | None) -> bool:
    """On the ground, and its autopilot would refuse to arm."""
    waits = monitor is None or monitor.phase is Phase.WAITING
    return waits and not state.armed and not state.ready_to_arm and math.isfinite(state.status_s)


def _phase(state: VehicleState, monitor: VehicleMonitor | None) -> tuple[str, Tone]:
    if _is_unready(state, monitor):
        return "not ready", Tone.WARN
    return words.phase_words(monitor.phase if monitor else None, monitor is not None and monitor.reached)


def _reason(state: VehicleState, monitor: VehicleMonitor | None) -> str:
    """Why it is in its phase; of one that is not ready, in the autopilot's own words."""
    said = "; ".join(autopilots_reasons(state)) if _is_unready(state, monitor) else ""
    return said or (monitor.reason if monitor else "")


def _distance_m(sighting: Sighting | None, monitor: VehicleMonitor | None) -> float:
    if sighting is None or monitor is None:
        return math.nan
    return float(np.linalg.norm(sighting.position_m - np.array(monitor.target.position_m)))


def _render_row(row: Row) -> str:
    return "".join(
        (
            '<tr class="selected">' if row.selected else "<tr>",
            _name(row.name, row.colour),
            _words(*row.mode),
            _words(*row.phase, row.reason),
            _battery(row.battery_percent),
            _number(row.height_m, "m"),
            _number(row.speed_m_s, "m/s"),
            _number(row.clearance_m, "m"),
            _number(row.to_target_m, "m"),
            _progress(row.progress),
            f"<td>{words.duration_words(row.eta_s)}</td>",
            _words(*row.companion),
            _number(row.replan_ms, "ms"),
            _words(*row.heard),
            _words(*words.quality_words(row.quality)),
            _words(*row.trust),
            "</tr>",
        )
    )


@lru_cache(maxsize=4096)
def _name(name: str, colour: Rgb) -> str:
    return f'<td class="name"><s style="background:{css(colour)}"></s>{escape(name)}</td>'


@lru_cache(maxsize=4096)
def _words(text: str, tone: Tone, title: str = "") -> str:
    hover = f' title="{escape(title)}"' if title else ""
    return f'<td{hover}><i class="{tone.value}">{escape(text)}</i></td>'


def _battery(percent: float) -> str:
    return _bar(round(percent), words.battery_tone(percent)) if math.isfinite(percent) else EMPTY


def _progress(share: float) -> str:
    return _bar(round(100 * share), Tone.INFO) if math.isfinite(share) else EMPTY


@lru_cache(maxsize=512)
def _bar(percent: int, tone: Tone) -> str:
    return f'<td><em class="{tone.value}"><q style="width:{percent}%"></q></em>{percent} %</td>'


def _number(value: float, unit: str) -> str:
    text = words.number_words(value)
    return f"<td>{text}</td>" if text == NOTHING else f"<td>{text}<small> {unit}</small></td>"
