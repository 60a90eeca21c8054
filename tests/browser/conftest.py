"""A browser for all tests of this folder, and a page with scripted vehicles for each of them."""

import asyncio
from collections.abc import AsyncIterator, Awaitable
from contextlib import AsyncExitStack, asynccontextmanager
from typing import Protocol

import pytest
import pytest_asyncio
from playwright.async_api import Browser, Page, async_playwright, expect

from gcs.view.server import serve_page
from tests.browser.chromium import ARGUMENTS, find_chromium
from tests.browser.loopback import HOST, PATIENCE_S, free_port
from tests.browser.scripted_desk import ScriptedDesk

SMALL, LARGE = (960, 640), (1360, 800)
"""Windows: what is drawn in software is better small, what is looked at better large."""
COARSE, FINE = 0.5, 1.0
"""Pixels of the scene per pixel of the window: a scene that nobody looks at takes a quarter of the time."""


expect.set_options(timeout=PATIENCE_S * 1000)


class OpenPage(Protocol):
    """Serves a scripted desk's page and shows it in a tab."""

    def __call__(
        self, scripted: ScriptedDesk, window: tuple[int, int] = SMALL, pixels: float = COARSE
    ) -> Awaitable[Page]: ...


@pytest_asyncio.fixture(loop_scope="module", scope="module")
async def browser(tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[Browser]:
    """Without a graphics card a page takes whole cores to draw: it gets those that the vehicles leave over."""
    yielding = tmp_path_factory.mktemp("chromium") / "chromium"
    yielding.write_text(f'#!/bin/sh\nexec nice -n 10 "{find_chromium()}" "$@"\n')
    yielding.chmod(0o755)
    async with async_playwright() as playwright:
        started = await playwright.chromium.launch(executable_path=yielding, args=ARGUMENTS)
        yield started
        await started.close()


@pytest_asyncio.fixture(loop_scope="module")
async def open_page(browser: Browser) -> AsyncIterator[OpenPage]:
    """Errors in the page, and errors in serving it, fail the test."""
    async with AsyncExitStack() as stack:

        async def show(scripted: ScriptedDesk, window: tuple[int, int] = SMALL, pixels: float = COARSE) -> Page:
            port = await stack.enter_async_context(serving(scripted))
            return await stack.enter_async_context(tab(browser, port, window, pixels))

        yield show


@asynccontextmanager
async def serving(scripted: ScriptedDesk, token: str | None = None) -> AsyncIterator[int]:
    """The port of a scripted desk's page, behind a gateway if there is a token; its vehicles fly on meanwhile."""
    port, shown = free_port(), asyncio.Event()
    tasks = [
        asyncio.create_task(scripted.run()),
        asyncio.create_task(serve_page(scripted.desk, HOST, port, shown, token)),
    ]
    try:
        yield port
        assert shown.is_set(), "no browser was noticed"
        assert not any(task.done() for task in tasks), "the page has ended by itself"
        assert not [event.text for event in scripted.events.events if event.text.startswith("the page could not")]
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


@asynccontextmanager
async def tab(
    browser: Browser, port: int, window: tuple[int, int] = SMALL, pixels: float = COARSE, query: str = ""
) -> AsyncIterator[Page]:
    """A tab that shows the page on a port, once its panels are there."""
    page = await browser.new_page(viewport={"width": window[0], "height": window[1]})
    page.set_default_timeout(PATIENCE_S * 1000)
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    try:
        await page.goto(f"http://{HOST}:{port}/?fixedDpr={pixels}{query}")
        await page.wait_for_selector(".gcs-fleet")
        yield page
        assert errors == [], "the page raised errors"
    finally:
        await page.close()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """One event loop for the browser and all that talks to it."""
    for item in items:
        if item.get_closest_marker("browser"):
            item.add_marker(pytest.mark.asyncio(loop_scope="module"), append=False)
