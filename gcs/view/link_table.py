"""How well each vehicle is heard, as HTML; pure."""

from dataclasses import dataclass
from html import escape

from gcs.desk import Desk
from gcs.dialect import AUTOPILOT
from gcs.link.codec import SourceCount
from gcs.link.paths import LinkQuality
from gcs.view import words
from gcs.view.colours import Rgb, css
from gcs.view.sightings import vehicle_colours, vehicle_names

HEADINGS = ("Vehicle", "Last heard", "Quality", "Round trip", "Links", "Signing", "Received", "Lost", "Sent")


@dataclass(frozen=True)
class _Row:
    name: str
    colour: Rgb
    cells: tuple[str, ...]


def render(desk: Desk, now_s: float) -> str:
    """One row per vehicle."""
    names = vehicle_names(desk)
    colours = vehicle_colours(names)
    head = "".join(f"<th>{heading}</th>" for heading in HEADINGS)
    body = "".join(_render(_Row(names[sysid], colours[sysid], _cells(desk, sysid, now_s))) for sysid in names)
    dropped = desk.station.codec.malformed
    foot = f"<p>{dropped} malformed frames were dropped</p>" if dropped else ""
    table = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    return f'<section class="gcs-fleet gcs-links">{table}{foot}</section>'


def _cells(desk: Desk, sysid: int, now_s: float) -> tuple[str, ...]:
    state, outlook = desk.vehicles.get(sysid), desk.observations.outlooks.get(sysid)
    if state is None:
        return (words.NOTHING,) * (len(HEADINGS) - 1)
    count = desk.station.codec.sources.get((sysid, AUTOPILOT), SourceCount())
    age, age_tone = words.age_words(now_s - state.telemetry_s)
    quality, tone = words.quality_words(outlook.link_quality if outlook else float("nan"))
    return (
        f'<i class="{age_tone.value}">{escape(age)}</i>',
        f'<i class="{tone.value}">{escape(quality)}</i>',
        _round_trip(desk.station.quality(sysid)),
        f"{len(desk.station.routes.live_paths(sysid, desk.station.now_s)) or words.NOTHING}",
        words.NOTHING if desk.player else escape(desk.station.codec.signing.trust(sysid).value.lower()),
        f"{count.received}",
        f"{count.lost}",
        f"{desk.station.sent.get(sysid, 0)}",
    )


def _round_trip(best: LinkQuality | None) -> str:
    if best is None or best.round_trip_s is None:
        return words.NOTHING
    return f"{1e3 * best.round_trip_s:.0f}<small> ms</small>"


def _render(row: _Row) -> str:
    cells = "".join(f"<td>{cell}</td>" for cell in row.cells)
    name = f'<td class="name"><s style="background:{css(row.colour)}"></s>{escape(row.name)}</td>'
    return f"<tr>{name}{cells}</tr>"
