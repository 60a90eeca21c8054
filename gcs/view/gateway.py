"""The gateway in front of the page: whoever knows the token gets through to viser, which listens on loopback alone.

Nothing is shown and nothing obeyed before the token was checked. The page's HTTP and its websocket are passed on as
they are; viser takes websockets from this gateway only, which proves itself with a secret of this run.
"""

import asyncio
import contextlib
import logging
import secrets
from collections.abc import AsyncGenerator
from importlib.resources import files
from urllib.parse import urlsplit

from aiohttp import ClientSession, ClientTimeout, WSMsgType, web
from aiohttp.client_ws import ClientWebSocketResponse

from gcs.errors import UsageError
from gcs.view.admission import SESSION_S, Admission, TooManyAttempts

COOKIE = "gcs_session"
SECRET_HEADER, VISITOR_HEADER = "X-Gcs-Gateway", "X-Gcs-Visitor"
MOST_BYTES = 64 * 1024 * 1024
"""Of one websocket message, as viser has it."""
HEARTBEAT_S = 15.0
PASSED_ON = ("Accept", "Accept-Encoding", "If-None-Match", "User-Agent")
HOP_BY_HOP = {"connection", "keep-alive", "transfer-encoding", "upgrade", "date", "server"}
HEADERS = {"X-Frame-Options": "DENY", "Referrer-Policy": "no-referrer", "X-Content-Type-Options": "nosniff"}
NOT_STORED = {**HEADERS, "Cache-Control": "no-store"}

log = logging.getLogger(__name__)


class Gateway:
    """The gateway of one page.

    Args:
        token: what visitors have to know.
        upstream_port: where viser listens on loopback.
        secret: what viser expects from this gateway.
    """

    def __init__(self, token: str, upstream_port: int, secret: str) -> None:
        self._admission, self._secret = Admission(token), secret
        self._upstream = f"127.0.0.1:{upstream_port}"
        self._session: ClientSession | None = None

    async def open(self) -> None:
        """Get ready to pass on; within the event loop."""
        self._session = ClientSession(timeout=ClientTimeout(total=60.0), auto_decompress=False)

    async def close(self) -> None:
        if self._session is not None:
            await self._session.close()

    async def handle(self, request: web.Request) -> web.StreamResponse:
        """Everything that comes in."""
        address = request.remote or "nowhere"
        if "token" in request.query:
            return self._enter(address, request.query["token"])
        if request.path == "/login" and request.method == "POST":
            form = await request.post()
            return self._enter(address, str(form.get("token", "")))
        if not self._admission.admits(request.cookies.get(COOKIE), _now_s()):
            return _door(401)
        if request.headers.get("Upgrade", "").lower() == "websocket":
            return await self._pass_websocket(request, address)
        return await self._pass_http(request)

    def _enter(self, address: str, offered: str) -> web.Response:
        try:
            session = self._admission.enter(address, offered, _now_s())
        except TooManyAttempts:
            log.warning("too many wrong tokens; %s has to wait", address)
            return _door(429, "Too many wrong tokens. Wait a minute.")
        if session is None:
            log.warning("a wrong token from %s", address)
            return _door(401, "This is not the token.")
        inside = web.Response(status=303, headers={**NOT_STORED, "Location": "/"})
        inside.set_cookie(COOKIE, session, max_age=int(SESSION_S), httponly=True, samesite="Strict", path="/")
        return inside

    async def _pass_http(self, request: web.Request) -> web.Response:
        if request.method not in {"GET", "HEAD"}:
            return web.Response(status=405, headers=NOT_STORED)
        assert self._session is not None
        wanted = {name: request.headers[name] for name in PASSED_ON if name in request.headers}
        async with self._session.get(f"http://{self._upstream}{request.rel_url}", headers=wanted) as answer:
            headers = {name: value for name, value in answer.headers.items() if name.lower() not in HOP_BY_HOP}
            headers.pop("Content-Length", None)
            return web.Response(status=answer.status, body=await answer.read(), headers={**headers, **HEADERS})

    async def _pass_websocket(self, request: web.Request, address: str) -> web.StreamResponse:
        origin = request.headers.get("Origin")
        if origin is not None and urlsplit(origin).netloc != request.host:
            log.warning("refused a connection from a page of %s", origin)
            return web.Response(status=403, text="foreign origin", headers=NOT_STORED)
        assert self._session is not None
        offered = [
            name.strip() for name in request.headers.get("Sec-WebSocket-Protocol", "").split(",") if name.strip()
        ]
        proof = {SECRET_HEADER: self._secret, VISITOR_HEADER: address}
        async with self._session.ws_connect(
            f"ws://{self._upstream}{request.rel_url}", protocols=offered, headers=proof, max_msg_size=MOST_BYTES
        ) as inner:
            outer = web.WebSocketResponse(
                protocols=[inner.protocol] if inner.protocol else [],
                max_msg_size=MOST_BYTES,
                compress=False,
                heartbeat=HEARTBEAT_S,
            )
            await outer.prepare(request)
            await _join(outer, inner)
            return outer


@contextlib.asynccontextmanager
async def open_gateway(host: str, port: int, token: str, upstream_port: int, secret: str) -> AsyncGenerator[None]:
    """A gateway on this address.

    Raises:
        UsageError: the port is in use.
    """
    gateway = Gateway(token, upstream_port, secret)
    app = web.Application(client_max_size=4096)
    app.router.add_route("*", "/{path:.*}", gateway.handle)
    runner = web.AppRunner(app, access_log=None, shutdown_timeout=1.0)
    await gateway.open()
    await runner.setup()
    try:
        try:
            await web.TCPSite(runner, host, port).start()
        except OSError as problem:
            why = problem.strerror or str(problem)
            raise UsageError(f"--port {port}: the page cannot be served on {host}:{port}: {why}") from None
        yield
    finally:
        await gateway.close()
        await runner.cleanup()


def new_secret() -> str:
    """What gateway and viser agree on for one run."""
    return secrets.token_urlsafe(32)


async def _join(outer: web.WebSocketResponse, inner: ClientWebSocketResponse) -> None:
    """Pass messages on both ways until one end closes; a slow end slows its own connection alone."""
    ways = {asyncio.ensure_future(_pump(outer, inner)), asyncio.ensure_future(_pump(inner, outer))}
    try:
        await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for way in ways:
            way.cancel()
        await asyncio.gather(*ways, return_exceptions=True)
        await inner.close()
        await outer.close()


async def _pump(
    source: web.WebSocketResponse | ClientWebSocketResponse, sink: web.WebSocketResponse | ClientWebSocketResponse
) -> None:
    async for message in source:
        if message.type is WSMsgType.BINARY:
            await sink.send_bytes(message.data)
        elif message.type is WSMsgType.TEXT:
            await sink.send_str(message.data)


def _door(status: int, said: str = "") -> web.Response:
    """What is shown to whoever has not offered the token yet."""
    page = files("gcs.view").joinpath("door.html").read_text().replace("{said}", said)
    return web.Response(status=status, text=page, content_type="text/html", headers=NOT_STORED)


def _now_s() -> float:
    return asyncio.get_running_loop().time()
