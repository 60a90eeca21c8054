"""The page's life cycle: opened on the port that was asked for, updated until cancelled, closed without a trace."""

import asyncio
import contextlib
import logging
import socket
from collections.abc import Iterator
from urllib.parse import urlsplit

import rich
import viser

from gcs.desk import Desk
from gcs.errors import UsageError
from gcs.flight.events import Severity
from gcs.view.page import Page

UPDATE_INTERVAL_S = 0.1
POLICY_VIOLATION = 1008

LOOPBACK = {"127.0.0.1", "localhost", "::1"}

log = logging.getLogger(__name__)
logging.getLogger("websockets").addHandler(logging.NullHandler())  # a broken connection is nothing for a terminal


async def serve_page(desk: Desk, host: str, port: int, first_client: asyncio.Event | None = None) -> None:
    """Serve a desk's page until cancelled.

    Args:
        desk: what is shown and commanded.
        host: a loopback address.
        port: where the page is found; no other one is taken instead.
        first_client: set once the first browser shows the page.

    Raises:
        UsageError: the port is in use.
    """
    loop = asyncio.get_running_loop()
    server = open_server(host, port)
    try:
        if first_client is not None:
            _tell_of_first_client(server, loop, first_client)
        await _keep_up_to_date(Page(server, desk), desk)
    finally:
        await asyncio.to_thread(close_server, server)


def open_server(host: str, port: int) -> viser.ViserServer:
    """A viser server on this port.

    Raises:
        UsageError: the port is in use.
    """
    _check_free(host, port)
    with _no_announcements():
        server = viser.ViserServer(host=host, port=port, verbose=False)
        server._websock_server.on_client_connect(lambda client: _refuse_foreign_page(server, client.client_id))
        for client_id in list(server._websock_server._live_connections):
            _refuse_foreign_page(server, client_id)
    if server.get_port() != port:  # somebody was faster; viser then takes the next port that is free
        close_server(server)
        raise _in_use(host, port)
    return server


def close_server(server: viser.ViserServer) -> None:
    """Stop the server and its threads."""
    with _no_announcements():
        server.stop()


async def _keep_up_to_date(page: Page, desk: Desk) -> None:
    """Update a page until cancelled; a page that cannot be drawn is told once, and does not end a flight."""
    told: set[str] = set()
    while True:
        try:
            page.update(asyncio.get_running_loop().time())
        except Exception as defect:
            if repr(defect) not in told:
                told.add(repr(defect))
                log.exception("the page could not be updated")
                desk.events.add("page", f"the page could not be updated: {defect!r}", severity=Severity.ERROR)
        await asyncio.sleep(UPDATE_INTERVAL_S)


def _tell_of_first_client(server: viser.ViserServer, loop: asyncio.AbstractEventLoop, first: asyncio.Event) -> None:
    @server.on_client_connect
    def _(_: viser.ClientHandle) -> None:
        loop.call_soon_threadsafe(first.set)


def is_own_page(origin: str | None) -> bool:
    """Whether a connection comes from our own page, or from no page at all: other sites' scripts name their site."""
    return origin is None or urlsplit(origin).hostname in LOOPBACK


def _refuse_foreign_page(server: viser.ViserServer, client_id: int) -> None:
    """Close a foreign page's connection: browsers let any site connect to loopback, and what it presses flies."""
    connection = server._websock_server._live_connections.get(client_id)
    if connection is None or connection.request is None:
        return
    origin = connection.request.headers.get("Origin")
    if not is_own_page(origin):
        log.warning("refused a connection from a page of %s", origin)
        closing = connection.close(POLICY_VIOLATION, "foreign origin")
        asyncio.run_coroutine_threadsafe(closing, server.get_event_loop())


def _check_free(host: str, port: int) -> None:
    for family, *_, address in socket.getaddrinfo(host, port, type=socket.SOCK_STREAM):
        try:
            socket.create_server(address, family=family).close()
        except OSError as problem:
            raise _in_use(host, port, problem.strerror or str(problem)) from None


def _in_use(host: str, port: int, why: str = "in use") -> UsageError:
    return UsageError(f"--port {port}: the page cannot be served on {host}:{port}: {why}")


@contextlib.contextmanager
def _no_announcements() -> Iterator[None]:
    """Keep viser from writing to the terminal."""
    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before
