"""What was ordered, and what came of it, as HTML, the newest first; pure."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from html import escape
from itertools import groupby, islice

from gcs.desk.orders import Order, OrderState
from gcs.view.colours import Tone

SHOWN = 14
NAMED = 3
"""Vehicles that are named; of more, the others are counted."""

TONES = {
    OrderState.PENDING: Tone.INFO,
    OrderState.ACCEPTED: Tone.GOOD,
    OrderState.REFUSED: Tone.WARN,
    OrderState.FAILED: Tone.BAD,
    OrderState.CANCELLED: Tone.QUIET,
}


@dataclass
class _Line:
    what: str
    state: OrderState
    reason: str
    who: list[str] = field(default_factory=list[str])


def render(orders: Iterable[Order]) -> str:
    """The newest orders; the same order to several vehicles, with the same outcome, is one line."""
    newest = reversed(list(orders))
    groups = groupby(newest, key=lambda order: (order.intent, order.state, order.reason, order.asked_s))
    lines = [_Line(key[0].value, key[1], key[2], [order.who for order in group][::-1]) for key, group in groups]
    items = "".join(_item(line) for line in islice(lines, SHOWN))
    return f'<ol class="gcs-orders">{items or "<li><span>nothing was ordered yet</span></li>"}</ol>'


def named(names: list[str]) -> str:
    """Names as a phrase; of many, the first and how many more."""
    more = f" +{len(names) - NAMED}" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more


def _item(line: _Line) -> str:
    reason = f"<small>{escape(line.reason)}</small>" if line.reason else ""
    return (
        f"<li><b>{escape(line.what)}</b><span>{escape(named(line.who))}</span>"
        f'<i class="{TONES[line.state].value}">{line.state.value}</i>{reason}</li>'
    )
