"""The page's life cycle: one port, no trace afterwards, no foreign web pages, and no flight that a drawing can end."""

import asyncio
import socket
import threading

import pytest
import viser
import websockets.asyncio.client
from websockets.typing import Origin, Subprotocol

from gcs.desk import Desk
from gcs.errors import UsageError
from gcs.flight.events import Severity
from gcs.view import server
from gcs.view.page import Page
from tests.browser.loopback import HOST, answering, free_port
from tests.unit.gcs.view.desks import make_desk

VISER = [Subprotocol(f"viser-v{viser.__version__}")]


async def served(desk: Desk, port: int) -> asyncio.Task[None]:
    """The page, once it answers."""
    task = asyncio.create_task(server.serve_page(desk, HOST, port))
    await answering(port)
    return task


async def ended(task: asyncio.Task[None]) -> None:
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task


async def test_after_it_was_cancelled_the_port_is_free_and_no_thread_is_left(capsys):
    threads, port = set(threading.enumerate()), free_port()
    await ended(await served(await make_desk(), port))
    socket.create_server((HOST, port)).close()
    await asyncio.get_running_loop().shutdown_default_executor()
    for left in set(threading.enumerate()) - threads:
        left.join(timeout=5.0)
    assert set(threading.enumerate()) <= threads
    assert capsys.readouterr().out == ""


async def test_a_port_in_use_is_refused_by_name_and_no_other_one_is_taken():
    with socket.create_server((HOST, 0)) as listener:
        port = listener.getsockname()[1]
        with pytest.raises(UsageError, match=f"--port {port}.*in use"):
            await server.serve_page(await make_desk(), HOST, port)


async def test_a_port_that_is_taken_at_the_last_moment_is_noticed_too(monkeypatch):
    monkeypatch.setattr(server, "_check_free", lambda host, port: None)
    threads = threading.active_count()
    with socket.create_server((HOST, 0)) as listener:
        port = listener.getsockname()[1]
        with pytest.raises(UsageError, match=f"--port {port}.*in use"):
            server.open_server(HOST, port)
    assert threading.active_count() == threads


async def test_two_pages_on_one_port_are_one_too_many():
    port = free_port()
    first = await served(await make_desk(), port)
    with pytest.raises(UsageError, match=str(port)):
        await server.serve_page(await make_desk(), HOST, port)
    await ended(first)


@pytest.mark.parametrize(
    ("origin", "own"),
    [
        (None, True),
        ("http://127.0.0.1:8080", True),
        ("http://localhost:8080", True),
        ("http://[::1]:8080", True),
        ("https://example.org", False),
        ("http://localhost.example.org:8080", False),
        ("null", False),
    ],
)
def test_pages_of_other_sites_are_not_ours(origin: str | None, own: bool):
    assert server.is_own_page(origin) is own


async def test_a_foreign_web_page_is_cut_off_and_our_own_is_served():
    port = free_port()
    task = await served(await make_desk(), port)
    connect = websockets.asyncio.client.connect
    async with connect(f"ws://{HOST}:{port}", subprotocols=VISER, origin=Origin(f"http://{HOST}:{port}")) as own:
        assert len(await own.recv()) > 0
    async with connect(f"ws://{HOST}:{port}", subprotocols=VISER, origin=Origin("https://example.org")) as foreign:
        async with asyncio.timeout(10.0):
            await foreign.wait_closed()
        assert foreign.close_code == server.POLICY_VIOLATION
    await ended(task)


async def test_a_page_that_cannot_be_drawn_says_so_once_and_goes_on(monkeypatch):
    updates, enough = [], asyncio.Event()

    def fail(self: Page, now_s: float) -> None:
        updates.append(now_s)
        if len(updates) >= 3:
            enough.set()
        raise ZeroDivisionError("nothing to divide by")

    monkeypatch.setattr(Page, "update", fail)
    monkeypatch.setattr(server, "UPDATE_INTERVAL_S", 0.001)
    desk = await make_desk()
    task = await served(desk, free_port())
    async with asyncio.timeout(10.0):
        await enough.wait()
    await ended(task)
    complaints = [event.text for event in desk.events.events if event.severity is Severity.ERROR]
    assert complaints == ["the page could not be updated: ZeroDivisionError('nothing to divide by')"]
