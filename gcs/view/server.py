"""The page's life cycle: opened on the port that was asked for, updated until cancelled, closed without a trace."""

import asyncio
import contextlib
import gc
import hmac
import logging
import socket
from collections.abc import Generator
from contextlib import AsyncExitStack
from urllib.parse import urlsplit

import rich
import viser
from viser.infra import WebsockClientConnection, WebsockServer

from gcs.desk import Desk
from gcs.errors import UsageError
from gcs.flight.events import Severity
from gcs.settings import LOOPBACK
from gcs.view.client_answers import own_client
from gcs.view.gateway import SECRET_HEADER, new_secret, open_gateway
from gcs.view.page import Page
from gcs.view.viser_internals import connections_of, on_connection, sockets_of
from gcs.view.wakening import make_shared

UPDATE_INTERVAL_S = 0.1
POLICY_VIOLATION = 1008

log = logging.getLogger(__name__)
logging.getLogger("websockets").addHandler(logging.NullHandler())  # a broken connection is nothing for a terminal


async def serve_page(
    desk: Desk, host: str, port: int, first_client: asyncio.Event | None = None, token: str | None = None
) -> None:
    """Serve a desk's page until cancelled.

    Args:
        desk: what is shown and commanded.
        host: a loopback address, or with a token any.
        port: where the page is found; no other one is taken instead.
        first_client: set once the first browser shows the page.
        token: what visitors have to know; a gateway then stands in front of the page.

    Raises:
        UsageError: the port is in use.
    """
    loop = asyncio.get_running_loop()
    secret = None if token is None else new_secret()
    async with AsyncExitStack() as stack:
        if token is None:
            server = open_server(host, port)
        else:
            _check_free(host, port)
            server = open_server("127.0.0.1", 0, secret)
        stack.push_async_callback(asyncio.to_thread, close_server, server)
        if token is not None and secret is not None:
            await stack.enter_async_context(open_gateway(host, port, token, server.get_port(), secret))
        if first_client is not None:
            _tell_of_first_client(server, loop, first_client)
        page = Page(server, desk)
        spare_the_collector()
        await _keep_up_to_date(page, desk)


def open_server(host: str, port: int, secret: str | None = None) -> viser.ViserServer:
    """A viser server on this port; 0 is any that is free.

    Args:
        host: a loopback address.
        port: the port.
        secret: websockets that do not show it are refused; without one, those of other sites' pages.

    Raises:
        UsageError: the port is in use.
    """
    if port:
        _check_free(host, port)
    with _no_announcements():
        with own_client():
            server = viser.ViserServer(host=host, port=port, verbose=False)
        sockets = sockets_of(server)

        make_shared(sockets.get_message_buffer().message_event)

        async def examine(client: WebsockClientConnection) -> None:
            make_shared(client.get_message_buffer().message_event)
            await _refuse_strangers(sockets, client.client_id, secret)

        on_connection(sockets, examine)
        for client_id in list(connections_of(sockets)):
            asyncio.run_coroutine_threadsafe(_refuse_strangers(sockets, client_id, secret), server.get_event_loop())
    if port and server.get_port() != port:  # somebody was faster; viser then takes the next port that is free
        close_server(server)
        raise _in_use(host, port)
    return server


def spare_the_collector() -> None:
    """Keep what is loaded by now out of the garbage collector's later rounds.

    The libraries behind the page are so large that a whole round takes a tenth of a second, in which nobody flies.
    """
    gc.collect()
    gc.freeze()


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


async def _refuse_strangers(sockets: WebsockServer, client_id: int, secret: str | None) -> None:
    """Close a stranger's connection before anything is sent: browsers let any site connect to loopback."""
    connection = connections_of(sockets).get(client_id)
    if connection is None or connection.request is None:
        return
    headers = connection.request.headers
    if secret is not None and not hmac.compare_digest(headers.get(SECRET_HEADER, ""), secret):
        log.warning("refused a connection that did not come through the gateway")
        await connection.close(POLICY_VIOLATION, "not through the gateway")
    elif secret is None and not is_own_page(headers.get("Origin")):
        log.warning("refused a connection from a page of %s", headers.get("Origin"))
        await connection.close(POLICY_VIOLATION, "foreign origin")


def _check_free(host: str, port: int) -> None:
    for family, *_, address in socket.getaddrinfo(host, port, type=socket.SOCK_STREAM):
        try:
            socket.create_server(address, family=family).close()
        except OSError as problem:
            raise _in_use(host, port, problem.strerror or str(problem)) from None


def _in_use(host: str, port: int, why: str = "in use") -> UsageError:
    return UsageError(f"--port {port}: the page cannot be served on {host}:{port}: {why}")


@contextlib.contextmanager
def _no_announcements() -> Generator[None]:
    """Keep viser from writing to the terminal."""
    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before
