"""The paper's flight on the page: the real programs, a real browser, and somebody who only watches."""

import asyncio
import contextlib
import signal
import sys
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from playwright.async_api import Browser, expect

from tests.browser.conftest import LARGE, tab
from tests.browser.loopback import answering, free_port
from tests.browser.watching import OUT, row, scene

pytestmark = [pytest.mark.browser, pytest.mark.processes]

INSTANCE_BASE = 700
FLIGHT_TIMEOUT_MS = 180_000


@contextlib.asynccontextmanager
async def gcs_fly(*options: str) -> AsyncIterator[asyncio.subprocess.Process]:
    """`gcs fly` with these options; Ctrl-C at the end."""
    command = [sys.executable, "-m", "gcs", "fly", *options]
    process = await asyncio.create_subprocess_exec(*command)
    try:
        yield process
    finally:
        if process.returncode is None:
            process.send_signal(signal.SIGINT)
            await asyncio.wait_for(process.wait(), 30.0)


async def test_the_indoor_mission_is_flown_before_the_operators_eyes(browser: Browser, tmp_path: Path):
    port = free_port()
    options = ["--sim", "--speed", "5", "--port", str(port), "--instance-base", str(INSTANCE_BASE)]
    async with gcs_fly("indoor", *options, "--report", str(tmp_path)) as process:
        await answering(port)
        async with tab(browser, port, LARGE) as page:
            phase, table = page.locator(".gcs-head .phase"), page.locator(".gcs-fleet")
            await expect(phase).to_have_text("Flying", timeout=FLIGHT_TIMEOUT_MS)
            await expect(table).to_contain_text("Offboard")
            assert {"/plan/curves", "/fleet/ahead", "/fleet/hull"} <= await scene(page)
            await expect(phase).to_have_text("Mission accomplished", timeout=FLIGHT_TIMEOUT_MS)
            await expect(row(page, "reached")).to_have_count(2)
            await expect(page.locator(".gcs-events")).to_contain_text("landed at its target")
            assert "/trails/newest" in await scene(page)
            await expect(page.locator(".gcs-overlay .tag.vehicle")).to_have_count(2)
            OUT.mkdir(exist_ok=True)
            await page.screenshot(path=OUT / "page-flown.png")
            assert process.returncode is None, "the page goes on after the flight"
    assert process.returncode is not None
    assert (tmp_path / "report.json").exists()
