"""What a browser loads: viser's client in files that it can keep, beginning without viser's own lights."""

import gzip
import re

import numpy as np
import pytest
from aiohttp import ClientSession

from gcs.view import client_answers, server
from gcs.view.client_files import (
    ALPHABET,
    CHECKED,
    KEPT,
    LIT,
    RESTYLING,
    UNCHECKED,
    UNLIT,
    ClientFile,
    UnknownClientError,
    client_files,
    from_base_88,
    taken_apart,
)
from tests.browser.loopback import HOST, free_port


def contents(suffix: str) -> bytes:
    (file,) = [file for path, file in client_files().items() if path.endswith(suffix)]
    return gzip.decompress(file.packed)


def in_base_88(data: bytes) -> str:
    text = ""
    for start in range(0, len(data), 4):
        group = data[start : start + 4]
        value, characters = int.from_bytes(group, "big"), ""
        for _ in range(5 if len(group) == 4 else len(group) + 1):
            value, digit = divmod(value, len(ALPHABET))
            characters = ALPHABET[digit] + characters
        text += characters
    return text


@pytest.mark.parametrize("length", range(10))
def test_base_88_is_read_to_the_last_byte(length):
    data = np.random.default_rng(length).integers(0, 256, length, dtype=np.uint8).tobytes()
    assert from_base_88(in_base_88(data)) == data
    assert from_base_88(in_base_88(b"\xff" * length)) == b"\xff" * length


def test_what_is_not_base_88_is_refused():
    with pytest.raises(UnknownClientError, match="base 88"):
        from_base_88("ab<de")


def test_the_client_of_the_installed_viser_is_taken_apart():
    assert contents(".wasm").startswith(b"\0asm")
    assert b"createRoot(document.getElementById(`root`))" in contents(".js")
    assert b"{" in contents(".css")


def test_its_scene_begins_without_lights_shadows_and_sky():
    script = contents(".js").decode()
    assert script.count(UNLIT) == 1
    assert LIT not in script


def test_nothing_restyles_the_whole_page_or_waits_for_the_shaders_logs():
    assert RESTYLING.search(contents(".css")) is None
    assert contents(".js").count(UNCHECKED) == 1
    assert CHECKED not in contents(".js")


def test_the_page_names_files_that_are_there_and_carries_no_script_of_2_mb():
    page = gzip.decompress(client_files()[""].packed).decode()
    named = set(re.findall(r'"/([\w.-]+)"', page))
    assert named == client_files().keys() - {"", "index.html"}
    assert len(page) < 5000
    assert '<div id="root">' in page


def test_files_named_after_their_contents_are_kept_and_the_page_is_asked_for_every_time():
    kept = {path: file.caching for path, file in client_files().items()}
    assert kept.pop("") == kept.pop("index.html") == "no-cache"
    assert set(kept.values()) == {KEPT}


@pytest.mark.parametrize(
    ("page", "missing"),
    [("<html></html>", "no compressed client"), ('<script data-p="" data-ss="0" data-cs="0"></script>', "no decoder")],
)
def test_a_page_that_is_made_otherwise_is_refused_by_what_is_missing(page, missing):
    with pytest.raises(UnknownClientError, match=missing):
        taken_apart(page)


async def fetched(path: str) -> tuple[int, str | None, bytes]:
    port = free_port()
    viser_server = server.open_server(HOST, port)
    try:
        async with ClientSession() as session, session.get(f"http://{HOST}:{port}{path}") as found:
            return found.status, found.headers.get("Cache-Control"), await found.read()
    finally:
        server.close_server(viser_server)


async def test_the_server_hands_them_out():
    path = next(path for path in client_files() if path.endswith(".js"))
    assert await fetched(f"/{path}") == (200, KEPT, contents(".js"))
    status, caching, page = await fetched("/?fixedDpr=0.5")
    assert (status, caching) == (200, "no-cache")
    assert path.encode() in page


@pytest.mark.parametrize("path", ["/nothing.js", "/../server.py", "/%2e%2e/server.py"])
async def test_and_nothing_else(path):
    assert (await fetched(path))[0] == 404


async def test_a_viser_whose_client_is_unknown_serves_its_own(monkeypatch, caplog):
    def unknown() -> dict[str, ClientFile]:
        raise UnknownClientError("no compressed client in its page")

    monkeypatch.setattr(client_answers, "client_files", unknown)
    status, _, page = await fetched("/")
    assert status == 200
    assert b"data-cs=" in page
    assert "served as it is" in caplog.text
