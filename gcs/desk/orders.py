"""The book of orders: each is pending until it was accepted, refused or has failed."""

from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum

from gcs.desk.intents import Intent
from gcs.errors import CommandRefused, PreflightError, UsageError
from missions.errors import MissionError

KEPT = 200


class OrderState(Enum):
    """How far an order has come."""

    PENDING = "pending"
    ACCEPTED = "accepted"
    REFUSED = "refused"
    """Whoever was asked said no; nothing has changed."""
    FAILED = "failed"
    """No answer, or it went wrong on the way: nobody knows."""
    CANCELLED = "cancelled"


@dataclass
class Order:
    """One order to one vehicle, or to the whole flight.

    Args:
        intent: what was asked for.
        sysid: of whom; None is the whole flight.
        who: what the page calls it.
        by: who asked; None is the program itself.
        asked_s: when, on the desk's clock.
    """

    intent: Intent
    sysid: int | None
    who: str
    by: str | None
    asked_s: float
    state: OrderState = OrderState.PENDING
    reason: str = ""


@dataclass
class OrderBook:
    """The latest orders, oldest first.

    Args:
        on_change: called when an order was entered, and when it has ended.
    """

    on_change: Callable[[Order], None]
    orders: deque[Order] = field(default_factory=lambda: deque(maxlen=KEPT))
    _pending: Counter[tuple[Intent, int | None]] = field(default_factory=Counter[tuple[Intent, int | None]])

    def enter(self, order: Order) -> Order:
        """Take down a new order."""
        self.orders.append(order)
        self._pending[order.intent, order.sysid] += 1
        self.on_change(order)
        return order

    def close(self, order: Order, state: OrderState, reason: str = "") -> None:
        """Take down how an order has ended."""
        order.state, order.reason = state, reason
        self._pending[order.intent, order.sysid] -= 1
        self.on_change(order)

    def pending(self, intent: Intent, sysid: int | None) -> bool:
        """Whether the same order is under way already."""
        return self._pending.get((intent, sysid), 0) > 0


def outcome_of(problem: Exception) -> OrderState:
    """Whether an error means that somebody said no, or that something went wrong."""
    refusals = (CommandRefused, PreflightError, UsageError, MissionError)
    return OrderState.REFUSED if isinstance(problem, refusals) else OrderState.FAILED
