"""Flights on the page: the real programs, a real browser, and somebody who watches, from the start or from midway."""

import signal
from pathlib import Path

import pytest
from playwright.async_api import Browser, expect

from gcs.desk.histories import Quantity
from tests.browser.conftest import LARGE, tab
from tests.browser.ground_station import gcs_fly, program
from tests.browser.loopback import answering, free_port
from tests.browser.watching import OUT, button, plots, row, scene

pytestmark = [pytest.mark.browser, pytest.mark.processes]

INSTANCE_BASE = 700
FLIGHT_TIMEOUT_MS = 180_000


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
            await page.get_by_role("tab", name="Plots").click()
            for quantity in Quantity:
                await expect(page.get_by_text(f"{quantity.title} [{quantity.unit}]")).to_be_visible()
            await plots(page, len(Quantity))
            assert process.returncode is None, "the page goes on after the flight"
    assert process.returncode is not None
    assert (tmp_path / "report.json").exists()


async def test_a_flight_whose_ground_station_is_gone_is_watched_by_another_one(browser: Browser, tmp_path: Path):
    """Fly and Hold are pressed, that ground station is killed, and from another one the vehicles are landed."""
    ports, base = (free_port(), free_port()), ["--instance-base", str(INSTANCE_BASE + 10)]
    options = ["--mode", "cloud", "--port", str(ports[0]), *base, "--report", str(tmp_path)]
    async with program("sitl", "indoor", *base):
        async with gcs_fly("indoor", *options) as process:
            await answering(ports[0])
            async with tab(browser, ports[0]) as page:
                await expect(button(page, "Fly")).to_be_enabled()
                await button(page, "Fly").click()
                await expect(page.locator(".gcs-head .phase")).to_have_text("Flying", timeout=FLIGHT_TIMEOUT_MS)
                await button(page, "Hold").click()
                await expect(row(page, "interrupted")).to_have_count(2)
                process.send_signal(signal.SIGKILL)
                await process.wait()
        async with program("gcs", "watch", "--flight", str(tmp_path), "--port", str(ports[1]), *base):
            await answering(ports[1])
            async with tab(browser, ports[1]) as page:
                await expect(page.locator(".gcs-head h1")).to_have_text("indoor")
                await expect(row(page, "Hold")).to_have_count(2)
                await expect(row(page, "interrupted")).to_have_count(2)
                await expect(page.locator(".gcs-overlay .tag.vehicle").first).to_be_visible()
                assert {"/plan/curves", "/fleet/hull", "/fleet/tails"} <= await scene(page)
                await button(page, "Land").click()
                await expect(row(page, "Land")).to_have_count(2)
