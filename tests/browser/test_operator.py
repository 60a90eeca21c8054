"""An operator at the page: whole flights by its buttons alone, with the real programs and a real browser."""

import json
from pathlib import Path

import pytest
from playwright.async_api import Browser, Page, expect

from tests.browser.conftest import LARGE, tab
from tests.browser.ground_station import gcs_fly
from tests.browser.loopback import answering, free_port
from tests.browser.watching import OUT, button, choose, row

pytestmark = [pytest.mark.browser, pytest.mark.processes]

INSTANCE_BASE = 730
FLIGHT_TIMEOUT_MS = 180_000


def phase(page: Page):
    return page.locator(".gcs-head .phase")


async def press(page: Page, name: str) -> None:
    """Press a button as soon as it can be pressed."""
    await expect(button(page, name)).to_be_enabled(timeout=FLIGHT_TIMEOUT_MS)
    await button(page, name).click()


async def step_by_step(page: Page) -> None:
    """From the plan to the start of the mission."""
    await press(page, "Plan")
    await expect(phase(page)).to_have_text("Planned", timeout=FLIGHT_TIMEOUT_MS)
    await press(page, "Upload")
    await expect(phase(page)).to_have_text("Ready to fly", timeout=FLIGHT_TIMEOUT_MS)
    await press(page, "Arm")
    await press(page, "Take off")
    await press(page, "Start")
    await expect(phase(page)).to_have_text("Flying", timeout=FLIGHT_TIMEOUT_MS)


async def load(page: Page, mission: str) -> None:
    await choose(page, "Mission", mission)
    await press(page, "Load")
    await expect(page.locator(".gcs-head h1")).to_have_text(mission)


async def test_the_indoor_mission_is_loaded_planned_and_flown_from_the_page_alone(browser: Browser, tmp_path: Path):
    port = free_port()
    options = ["--sim", "--wait", "--speed", "5", "--port", str(port), "--instance-base", str(INSTANCE_BASE)]
    async with gcs_fly("field", *options, "--report", str(tmp_path)):
        await answering(port)
        async with tab(browser, port, LARGE) as page:
            await load(page, "indoor")
            await step_by_step(page)
            await page.reload()
            await expect(phase(page)).to_have_text("Flying", timeout=FLIGHT_TIMEOUT_MS)
            await press(page, "Hold")
            await expect(row(page, "alpha")).to_contain_text("interrupted", timeout=FLIGHT_TIMEOUT_MS)
            await page.screenshot(path=OUT / "operator-hold.png")
            await press(page, "Resume")
            await expect(phase(page)).to_have_text("Mission accomplished", timeout=FLIGHT_TIMEOUT_MS)
            await page.screenshot(path=OUT / "operator-indoor.png")
    report = json.loads((tmp_path / "flight-2" / "report.json").read_text())
    assert report["mission"] == "indoor"
    assert report["success"], report["reason"]


async def test_the_first_terrain_is_flown_by_the_cloud_from_the_page_alone(browser: Browser, tmp_path: Path):
    port = free_port()
    options = ["--sim", "--wait", "--speed", "10", "--port", str(port), "--instance-base", str(INSTANCE_BASE + 20)]
    async with gcs_fly("terrain-1-5uav", *options, "--report", str(tmp_path)):
        await answering(port)
        async with tab(browser, port, LARGE) as page:
            await choose(page, "Planned by", "cloud")
            await expect(page.locator(".gcs-head small")).to_contain_text("cloud")
            await step_by_step(page)
            await page.screenshot(path=OUT / "operator-terrain.png")
            await expect(phase(page)).to_have_text("Mission accomplished", timeout=FLIGHT_TIMEOUT_MS)
    report = json.loads((tmp_path / "flight-2" / "report.json").read_text())
    assert (report["mission"], report["mode"]) == ("terrain-1-5uav", "cloud")
    assert report["success"], report["reason"]
