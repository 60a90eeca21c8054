"""What viser keeps to itself, websockets and how it sends: the one place that reaches into its private parts."""

from collections.abc import Callable, Coroutine
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
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


def send(node: viser.SceneNodeHandle, **properties: npt.NDArray[np.float32]) -> None:
    """Set properties of a node that change with every update, and send them.

    Assigning them looks up their types, compares and copies them three times, a tenth of a millisecond each. Here they
    have to be of the type that is sent, and must not be changed afterwards.
    """
    kept: Any = node._impl.props  # pyright: ignore[reportPrivateUsage] - see above
    for name, values in properties.items():
        setattr(kept, name, values)
        node._queue_update(name, values)  # pyright: ignore[reportPrivateUsage] - see above
