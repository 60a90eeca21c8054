"""Access beyond loopback: nothing is shown or obeyed before the token was checked."""

import asyncio
from collections.abc import AsyncIterator

import pytest
import viser
from aiohttp import ClientSession, CookieJar, WSMsgType, WSServerHandshakeError

from gcs.view import admission, server
from gcs.view.admission import (
    ATTEMPTS,
    ATTEMPTS_OF_ALL,
    ATTEMPTS_WINDOW_S,
    MOST_SESSIONS,
    SESSION_S,
    Admission,
    TooManyAttempts,
)
from gcs.view.gateway import COOKIE
from tests.browser.loopback import HOST, answering, free_port
from tests.unit.gcs.view.desks import make_desk

TOKEN = "correct horse"
PROTOCOL = f"viser-v{viser.__version__}"


# ---------------------------------------------------------------- the door


def test_the_right_token_opens_and_a_wrong_one_does_not():
    door = Admission(TOKEN)
    assert door.enter("1.2.3.4", "wrong", 0.0) is None
    session = door.enter("1.2.3.4", TOKEN, 0.0)
    assert door.admits(session, 1.0)
    assert not door.admits("made up", 1.0)
    assert not door.admits(None, 1.0)


def test_a_session_ends():
    door = Admission(TOKEN)
    session = door.enter("1.2.3.4", TOKEN, 0.0)
    assert door.admits(session, SESSION_S - 1.0)
    assert not door.admits(session, SESSION_S + 1.0)


def test_guessing_is_soon_over_even_with_the_right_token_in_the_end():
    door = Admission(TOKEN)
    for attempt in range(ATTEMPTS):
        assert door.enter("1.2.3.4", f"guess {attempt}", 0.0) is None
    with pytest.raises(TooManyAttempts):
        door.enter("1.2.3.4", TOKEN, 1.0)
    assert door.enter("5.6.7.8", TOKEN, 1.0) is not None  # others are let in meanwhile
    assert door.enter("1.2.3.4", TOKEN, ATTEMPTS_WINDOW_S + 1.0) is not None


def test_guessing_from_many_addresses_is_over_too_and_takes_no_memory():
    door, refused = Admission(TOKEN), 0
    for address in range(5 * ATTEMPTS_OF_ALL):
        try:
            door.enter(f"address {address}", "guess", 0.0)
        except TooManyAttempts:
            refused += 1
    assert refused == 4 * ATTEMPTS_OF_ALL
    assert len(door._wrong) <= admission.MOST_ADDRESSES


def test_sessions_are_bounded_and_the_oldest_goes():
    door = Admission(TOKEN)
    sessions = [door.enter("1.2.3.4", TOKEN, 0.0) for _ in range(MOST_SESSIONS + 1)]
    assert not door.admits(sessions[0], 1.0)
    assert door.admits(sessions[1], 1.0)
    assert door.admits(sessions[-1], 1.0)


def test_a_token_of_other_letters_is_only_wrong():
    assert Admission(TOKEN).enter("1.2.3.4", "glück 🗝", 0.0) is None


# ---------------------------------------------------------------- the gateway


@pytest.fixture
async def port() -> AsyncIterator[int]:
    """A page behind its gateway."""
    port, desk = free_port(), await make_desk()
    task = asyncio.create_task(server.serve_page(desk, HOST, port, token=TOKEN))
    await answering(port)
    yield port
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task


@pytest.fixture
async def visitor(port: int) -> AsyncIterator[ClientSession]:
    async with ClientSession(f"http://{HOST}:{port}", cookie_jar=CookieJar(unsafe=True)) as session:
        yield session


async def enter(visitor: ClientSession) -> None:
    async with visitor.post("/login", data={"token": TOKEN}) as answer:
        assert answer.status == 200


async def test_without_the_token_there_is_a_door_and_nothing_behind_it(visitor: ClientSession):
    for path in ("/", "/index.html", "/assets/anything.js", "/%2e%2e/"):
        async with visitor.get(path) as answer:
            assert answer.status == 401
            assert "asks for its token" in await answer.text()
    with pytest.raises(WSServerHandshakeError) as refused:
        await visitor.ws_connect("/", protocols=[PROTOCOL])
    assert refused.value.status == 401


async def test_a_wrong_token_is_refused_and_many_are_not_even_looked_at(visitor: ClientSession):
    statuses = []
    for attempt in range(ATTEMPTS + 1):
        async with visitor.post("/login", data={"token": f"guess {attempt}"}, allow_redirects=False) as answer:
            statuses.append(answer.status)
            assert COOKIE not in answer.cookies
    assert statuses == [401] * ATTEMPTS + [429]


async def test_with_the_token_the_page_is_shown_and_the_address_is_rid_of_it(visitor: ClientSession):
    async with visitor.get("/", params={"token": TOKEN}) as answer:
        assert answer.status == 200
        assert answer.url.query_string == ""
        assert "viser" in (await answer.text()).lower()
    async with visitor.get("/") as again:
        assert again.status == 200
        assert again.headers["X-Frame-Options"] == "DENY"
    async with visitor.ws_connect("/", protocols=[PROTOCOL]) as connection:
        message = await connection.receive(timeout=10.0)
        assert message.type is WSMsgType.BINARY
        assert len(message.data) > 100


async def test_the_cookie_is_out_of_reach_of_scripts_and_of_other_sites(visitor: ClientSession):
    async with visitor.post("/login", data={"token": TOKEN}, allow_redirects=False) as answer:
        cookie = answer.cookies[COOKIE]
    assert answer.status == 303
    assert cookie["httponly"]
    assert cookie["samesite"] == "Strict"
    assert TOKEN not in cookie.value


async def test_a_page_of_another_site_gets_no_connection_with_a_good_cookie_either(visitor: ClientSession, port: int):
    await enter(visitor)
    with pytest.raises(WSServerHandshakeError) as refused:
        await visitor.ws_connect("/", protocols=[PROTOCOL], origin="https://example.org")
    assert refused.value.status == 403
    async with visitor.ws_connect("/", protocols=[PROTOCOL], origin=f"http://{HOST}:{port}") as own:
        assert (await own.receive(timeout=10.0)).type is WSMsgType.BINARY


async def test_nobody_gets_past_the_gateway_to_what_stands_behind_it():
    secret, behind = "of this run", server.open_server(HOST, 0, "of this run")
    try:
        async with ClientSession() as session:
            url = f"ws://{HOST}:{behind.get_port()}"
            async with session.ws_connect(url, protocols=[PROTOCOL]) as stranger:
                message = await stranger.receive(timeout=10.0)
                assert message.type is WSMsgType.CLOSE
                assert stranger.close_code == server.POLICY_VIOLATION
            headers = {server.SECRET_HEADER: secret}
            async with session.ws_connect(url, protocols=[PROTOCOL], headers=headers) as gateway:
                assert (await gateway.receive(timeout=10.0)).type is WSMsgType.BINARY
    finally:
        await asyncio.to_thread(server.close_server, behind)


async def test_only_reading_is_passed_on(visitor: ClientSession):
    await enter(visitor)
    for method in ("PUT", "DELETE", "PATCH"):
        async with visitor.request(method, "/") as answer:
            assert answer.status == 405
    async with visitor.post("/login", data={"token": "x" * 100_000}) as answer:
        assert answer.status == 413
