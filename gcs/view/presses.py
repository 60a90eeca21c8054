"""From a press in some browser to an intent at the desk: who pressed is known, and told when it cannot be."""

import asyncio
from collections.abc import Callable, Iterable

import viser

from gcs.desk import Desk, Details, Intent
from gcs.desk.intents import NO_DETAILS

TOLD_S = 6.0


class Presses:
    """Hands presses over to the event loop's thread; its methods are called in threads of viser.

    Args:
        desk: what is commanded.
        selected: whom orders concern when nobody is named.
    """

    def __init__(self, desk: Desk, selected: Callable[[], Iterable[int]]) -> None:
        self._desk, self._selected, self._loop = desk, selected, asyncio.get_running_loop()

    def ask(
        self,
        intent: Intent,
        client: viser.ClientHandle | None,
        details: Details = NO_DETAILS,
        sysids: Iterable[int] | None = None,
    ) -> None:
        """Ask the desk for something, of the selected vehicles unless some are named."""
        self._loop.call_soon_threadsafe(self._request, intent, client, details, sysids)

    def do(self, act: Callable[[], None]) -> None:
        """Do something else on the event loop's thread."""
        self._loop.call_soon_threadsafe(act)

    def _request(
        self, intent: Intent, client: viser.ClientHandle | None, details: Details, sysids: Iterable[int] | None
    ) -> None:
        if client is None:
            return  # it has left since
        chosen = sorted(self._selected() if sysids is None else sysids)
        why_not = self._desk.request(intent, chosen, details, by=visitor_key(client))
        if why_not is not None:
            tell(client, f"{intent.value} is not possible", why_not)


def visitor_key(client: viser.ClientHandle) -> str:
    """By which the desk's seat knows a browser."""
    return str(client.client_id)


def tell(client: viser.ClientHandle, title: str, body: str) -> None:
    """A notice in one browser."""
    client.add_notification(title, body, auto_close_seconds=TOLD_S, color="yellow")
