"""viser's websockets, which it keeps to itself: the one place that reaches into its private parts."""

from collections.abc import Callable, Coroutine
from typing import TYPE_CHECKING

import viser
from viser.infra import WebsockClientConnection, WebsockServer

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection


def sockets_of(server: viser.ViserServer) -> WebsockServer:
    """The websockets that a server sends over."""
    return server._websock_server  # pyright: ignore[reportPrivateUsage] - viser shows them nowhere


def connections_of(sockets: WebsockServer) -> "dict[int, ServerConnection]":
    """Client id -> connection, of the browsers that are connected now."""
    return sockets._live_connections  # pyright: ignore[reportPrivateUsage] - viser shows them nowhere


def on_connection(
    sockets: WebsockServer, act: Callable[[WebsockClientConnection], Coroutine[object, object, None]]
) -> None:
    """Have `act` awaited, in viser's event loop, for every browser that connects from now on."""
    sockets.on_client_connect(act)  # pyright: ignore[reportUnknownMemberType] - viser names no types of its coroutine
