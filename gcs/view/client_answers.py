"""viser's server answers a browser's HTTP with the files of `client_files`; its websocket stays as it is."""

import contextlib
import http
import logging
from collections.abc import Generator
from typing import Any
from urllib.parse import urlsplit

import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from gcs.view.client_files import UnknownClientError, client_files

log = logging.getLogger(__name__)


@contextlib.contextmanager
def own_client() -> Generator[None]:
    """A server of viser that is opened within serves our files: there is no setting for that.

    With a viser whose client we do not know, it serves its own, which opens more slowly.
    """
    try:
        client_files()
    except UnknownClientError as unknown:
        log.warning("viser's client is served as it is, which takes longer to open: %s", unknown)
        yield
        return
    serve = websockets.asyncio.server.serve

    def serve_files(*args: Any, **options: Any) -> websockets.asyncio.server.serve:
        return serve(*args, **options | {"process_request": answer})

    try:
        websockets.asyncio.server.serve = serve_files
        yield
    finally:
        websockets.asyncio.server.serve = serve


def answer(connection: ServerConnection, request: Request) -> Response | None:
    """The file that is asked for; None for a websocket."""
    if request.headers.get("Upgrade", "").lower() == "websocket":
        return None
    file = client_files().get(urlsplit(request.path).path.lstrip("/"))
    if file is None:
        return connection.respond(http.HTTPStatus.NOT_FOUND, "There is no such file.\n")
    return Response(http.HTTPStatus.OK, "OK", Headers(file.headers), file.packed)
