"""The event log as one HTML list, newest first; pure. Texts come from outside and are escaped."""

from collections.abc import Sequence
from html import escape
from itertools import islice

from gcs.flight.events import BEGAN, Event, Severity
from gcs.view.colours import Rgb, css

SHOWN = 30
MINUTE_S = 60

QUIET_KINDS = {BEGAN, "stream"}
"""Of use in the log file alone."""

_CLASSES = {Severity.INFO: "info", Severity.WARNING: "warn", Severity.ERROR: "bad"}


def render(events: Sequence[Event], colours: dict[str, Rgb]) -> str:
    """The newest events; `colours` are those of the vehicles, by name."""
    told = (event for event in reversed(events) if event.kind not in QUIET_KINDS)
    items = "".join(_item(event, colours) for event in islice(told, SHOWN))
    return f'<ol class="gcs-events">{items or "<li class=info><span>nothing has happened yet</span></li>"}</ol>'


def _item(event: Event, colours: dict[str, Rgb]) -> str:
    minutes, seconds = divmod(round(event.t_s, 1), MINUTE_S)
    who = ""
    if event.vehicle is not None:
        colour = css(colours[event.vehicle]) if event.vehicle in colours else "inherit"
        who = f'<b style="color:{colour}">{escape(event.vehicle)}</b> '
    time = f"<time>{minutes:02.0f}:{seconds:04.1f}</time>"
    return f'<li class="{_CLASSES[event.severity]}">{time}<span>{who}{escape(event.text)}</span></li>'
