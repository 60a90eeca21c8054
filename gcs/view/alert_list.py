"""The alerts that are going on, by severity, as HTML; pure."""

from html import escape

from gcs.desk.alerts import AlertBoard
from gcs.flight.events import Severity
from gcs.view.order_list import named

_CLASSES = {Severity.INFO: "info", Severity.WARNING: "warn", Severity.ERROR: "bad"}


def render(board: AlertBoard) -> str:
    """One line per kind of alert, with the vehicles that it concerns; nothing where all is well."""
    lines = (
        f'<li class="{_CLASSES[alarm.severity]}"><b>{escape(named([alert.vehicle for alert in alerts]))}</b>'
        f"<span>{escape(alarm.words)}</span></li>"
        for alarm, alerts in board.by_alarm()
    )
    text = "".join(lines)
    return f'<ul class="gcs-alerts">{text}</ul>' if text else ""
