"""Who is in command, as every browser shows it for itself: those who look on cannot press what commands."""

from html import escape

import viser

from gcs.desk.seat import CommandSeat
from gcs.view.gateway import VISITOR_HEADER
from gcs.view.presses import visitor_key
from gcs.view.viser_internals import connections_of, sockets_of

LOCK = (
    "<style>div:has(> div > .gcs-command) button, div:has(> div > .gcs-command) input "
    "{ pointer-events: none; opacity: 0.4; }</style>"
)
FIRST = -1e9
"""Orders what it says before everything else in the panel."""


class Seating:
    """The browsers at the page, and the seat.

    Args:
        server: of the page.
        seat: the desk's.
    """

    def __init__(self, server: viser.ViserServer, seat: CommandSeat) -> None:
        self._server, self._seat, self._come = server, seat, 0
        self._signs: dict[int, viser.GuiHtmlHandle] = {}

    def update(self) -> None:
        """See who has come and gone, and tell everybody who is in command."""
        clients = self._server.get_clients()
        for client_id in self._signs.keys() - clients.keys():
            del self._signs[client_id]
            self._seat.leave(str(client_id))
        for client_id, client in clients.items():
            if client_id not in self._signs:
                self._signs[client_id] = client.gui.add_html("", order=FIRST)
                self._seat.arrive(visitor_key(client), self._name(client_id))
        for client_id, sign in self._signs.items():
            sign.content = self._sign(str(client_id))

    def _sign(self, key: str) -> str:
        if len(self._seat.present) < 2:
            return '<section class="gcs-seat alone"></section>' if self._seat.holder == key else self._look_on()
        if self._seat.holder == key:
            others = len(self._seat.present) - 1
            return f'<section class="gcs-seat mine">You are in command<small>{others} looking on</small></section>'
        return self._look_on()

    def _look_on(self) -> str:
        who = self._seat.holder_name
        said = f"{escape(who)} is in command" if who else "Nobody is in command"
        return f'{LOCK}<section class="gcs-seat">{said}<small>you look on</small></section>'

    def _name(self, client_id: int) -> str:
        self._come += 1
        connection = connections_of(sockets_of(self._server)).get(client_id)
        request = connection.request if connection is not None else None
        address = request.headers.get(VISITOR_HEADER) if request is not None else None
        return f"browser {self._come}" + (f" ({address})" if address else "")
