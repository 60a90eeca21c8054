"""The measurements: a page that is kept up to date at 10 Hz, and who looks at it."""

import asyncio
import time
from collections.abc import AsyncIterator, Awaitable
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from playwright.async_api import Browser, async_playwright
from playwright.async_api import Page as Tab

from gcs.view.page import Page
from gcs.view.server import UPDATE_INTERVAL_S, close_server, open_server, spare_the_collector
from tests.benchmarks.view.circling_fleet import CirclingFleet
from tests.browser.chromium import ARGUMENTS, find_chromium
from tests.browser.loopback import HOST, free_port
from tests.browser.raw_client import RawClient, raw_client

Array = npt.NDArray[np.float64]

WARM_UP_S = 4.0
SLOW_BYTES_PER_S = 30e3
LOOKED_AT_S = 3.0
"""From one reload to the next."""


@dataclass
class Kept:
    """A page that is kept up to date, and what that costs."""

    port: int
    cpu_ms: list[float] = field(default_factory=list)
    """CPU time of each update in its thread [ms] ..."""
    late_ms: list[float] = field(default_factory=list)
    """... and how much later it began than it should have: what the page leaves to a flight in the same process."""

    def forget(self) -> None:
        self.cpu_ms.clear()
        self.late_ms.clear()


@dataclass(frozen=True)
class Load:
    """What one measurement has found; times per update, rates per client."""

    cpu_ms: Array
    late_ms: Array
    fast_bytes_per_s: float
    slow_bytes_per_s: float


@dataclass(frozen=True)
class Opened:
    """How long a page takes until it is there [s]: in a browser that has never seen it, and when it is loaded again."""

    first_s: float
    again_s: list[float]


@asynccontextmanager
async def kept_page(fleet: CirclingFleet) -> AsyncIterator[Kept]:
    """A page whose vehicles fly on at real time."""
    kept = Kept(free_port())
    server = open_server(HOST, kept.port)
    page = Page(server, fleet.desk)
    spare_the_collector()
    keeping = asyncio.create_task(_keep(page, fleet, kept))
    try:
        yield kept
        assert not keeping.done(), "the page has ended by itself"
    finally:
        keeping.cancel()
        await asyncio.gather(keeping, return_exceptions=True)
        await asyncio.to_thread(close_server, server)


async def load(count: int, seconds: float, *, fast: int, slow: int) -> Load:
    """Keep a page of so many vehicles up to date for so long, watched by fast and slow connections."""
    async with AsyncExitStack() as stack:
        kept = await stack.enter_async_context(kept_page(CirclingFleet(count)))
        readers = [await stack.enter_async_context(raw_client(kept.port)) for _ in range(fast)]
        laggards = [await stack.enter_async_context(raw_client(kept.port, SLOW_BYTES_PER_S)) for _ in range(slow)]
        await asyncio.sleep(WARM_UP_S)
        kept.forget()
        before = [client.received for client in (*readers, *laggards)]
        begun_s = time.perf_counter()
        await asyncio.sleep(seconds)
        lasted_s = time.perf_counter() - begun_s
        rates = [_rate(client, was, lasted_s) for client, was in zip((*readers, *laggards), before, strict=True)]
        return Load(
            np.array(kept.cpu_ms),
            np.array(kept.late_ms),
            max(rates[:fast], default=0.0),
            max(rates[fast:], default=0.0),
        )


async def reloads(count: int, flown_s: float, times: int) -> tuple[Opened, Opened]:
    """Open the page in a flight that has lasted `flown_s` already and reload it so many times; then so a bare one."""
    fleet = CirclingFleet(count)
    fleet.have_flown(flown_s, 0.2)
    async with kept_page(fleet) as kept, bare_page() as bare_port, async_playwright() as playwright:
        browser = await playwright.chromium.launch(executable_path=find_chromium(), args=ARGUMENTS)
        try:
            await _opened(browser, bare_port, "/box", "button", 0)  # starts the browser's own processes
            ours = await _opened(browser, kept.port, "/fleet/hull", ".gcs-fleet tr", times)
            return ours, await _opened(browser, bare_port, "/box", "button", times)
        finally:
            await browser.close()


@asynccontextmanager
async def bare_page() -> AsyncIterator[int]:
    """The port of a page of viser with a box and a button: what every page of it costs a browser."""
    port = free_port()
    server = open_server(HOST, port)
    server.scene.add_box("/box")
    server.gui.add_button("button")
    try:
        yield port
    finally:
        await asyncio.to_thread(close_server, server)


async def _opened(browser: Browser, port: int, node: str, panel: str, times: int) -> Opened:
    """Open a page in a profile that has never seen it, and reload it so many times, a while after it was there."""
    tab = await browser.new_page(viewport={"width": 1000, "height": 640})
    try:
        first_s = await _until_there_s(tab, tab.goto(f"http://{HOST}:{port}", wait_until="commit"), node, panel)
        again_s: list[float] = []
        for _ in range(times):
            await asyncio.sleep(LOOKED_AT_S)
            again_s.append(await _until_there_s(tab, tab.reload(wait_until="commit"), node, panel))
        return Opened(first_s, again_s)
    finally:
        await tab.close()


async def _until_there_s(tab: Tab, loading: Awaitable[object], node: str, panel: str) -> float:
    """From loading a page to a panel and a node of the scene in it [s]."""
    begun_s = time.perf_counter()
    await loading
    await tab.wait_for_selector(panel, state="attached", timeout=60_000)
    await tab.wait_for_function(f"{node!r} in (window.__viserSceneTree?.getState() ?? {{}})", timeout=60_000)
    return time.perf_counter() - begun_s


def _rate(client: RawClient, before: int, lasted_s: float) -> float:
    return (client.received - before) / lasted_s


async def _keep(page: Page, fleet: CirclingFleet, kept: Kept) -> None:
    clock = asyncio.get_running_loop().time
    due_s = clock()
    while True:
        kept.late_ms.append((clock() - due_s) * 1e3)
        fleet.fly_on(UPDATE_INTERVAL_S)
        fleet.sample()
        begun_s = time.thread_time()
        page.update(clock())
        kept.cpu_ms.append((time.thread_time() - begun_s) * 1e3)
        due_s = max(due_s + UPDATE_INTERVAL_S, clock())
        await asyncio.sleep(due_s - clock())
