"""An operator at the page: whole flights by its buttons alone, with the real programs and a real browser."""

import json
from pathlib import Path

import numpy as np
import pytest
from playwright.async_api import Browser, Locator, Page, expect

from gcs.desk.intents import NewMission
from gcs.dialect import Mode, mavlink
from gcs.flight.monitor import Phase
from gcs.settings import PlanningMode
from missions.mission import SHIPPED
from tests.browser.conftest import LARGE, OpenPage, serving, tab
from tests.browser.ground_station import gcs_fly
from tests.browser.loopback import HOST, answering, free_port
from tests.browser.scripted_desk import ScriptedDesk
from tests.browser.watching import OUT, button, choose, pixel_of, row, until

pytestmark = pytest.mark.browser

INSTANCE_BASE = 730
FLIGHT_TIMEOUT_MS = 180_000


def phase(page: Page) -> Locator:
    return page.locator(".gcs-head .phase")


def orders(page: Page) -> Locator:
    return page.locator(".gcs-orders li")


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
    await press(page, "Take off")  # it arms first: at many times the speed an operator's Arm is over too soon
    await press(page, "Start")
    await expect(phase(page)).to_have_text("Flying", timeout=FLIGHT_TIMEOUT_MS)


async def load_by_list(page: Page, mission: str) -> None:
    await choose(page, "Mission", mission)
    await press(page, "Load")


async def load(page: Page, mission: str) -> None:
    await load_by_list(page, mission)
    await expect(page.locator(".gcs-head h1")).to_have_text(mission)


# ---------------------------------------------------------------- whole flights


@pytest.mark.processes
async def test_the_indoor_mission_is_loaded_planned_and_flown_from_the_page_alone(browser: Browser, tmp_path: Path):
    port = free_port()
    options = ["--sim", "--wait", "--speed", "2", "--port", str(port), "--instance-base", str(INSTANCE_BASE)]
    async with gcs_fly("field", *options, "--report", str(tmp_path)):
        await answering(port)
        async with tab(browser, port, LARGE) as page:
            await load(page, "indoor")
            await step_by_step(page)
            await press(page, "Hold")
            await expect(row(page, "alpha")).to_contain_text("interrupted", timeout=FLIGHT_TIMEOUT_MS)
            await page.reload()
            await expect(phase(page)).to_have_text("Interrupted", timeout=FLIGHT_TIMEOUT_MS)
            await press(page, "Resume")
            await expect(phase(page)).to_have_text("Mission accomplished", timeout=FLIGHT_TIMEOUT_MS)
            await page.screenshot(path=OUT / "operator-indoor.png")
    report = json.loads((tmp_path / "flight-2" / "report.json").read_text())
    assert report["mission"] == "indoor"
    assert report["success"], report["reason"]


@pytest.mark.processes
@pytest.mark.slow
@pytest.mark.timeout(600)
async def test_the_first_terrain_is_flown_by_the_cloud_from_the_page_alone(browser: Browser, tmp_path: Path):
    port = free_port()
    options = ["--sim", "--wait", "--speed", "10", "--port", str(port), "--instance-base", str(INSTANCE_BASE + 20)]
    async with gcs_fly("terrain-1-5uav", *options, "--report", str(tmp_path)):
        await answering(port)
        async with tab(browser, port, LARGE) as page:
            await choose(page, "Planned by", "cloud")
            await expect(page.locator(".gcs-head small")).to_contain_text("cloud", timeout=FLIGHT_TIMEOUT_MS)
            await step_by_step(page)
            await page.screenshot(path=OUT / "operator-terrain.png")
            await expect(phase(page)).to_have_text("Mission accomplished", timeout=2 * FLIGHT_TIMEOUT_MS)
    report = json.loads((tmp_path / "flight-2" / "report.json").read_text())
    assert (report["mission"], report["mode"]) == ("terrain-1-5uav", "cloud")
    assert report["success"], report["reason"]


# ---------------------------------------------------------------- missions


async def test_missions_are_loaded_from_the_list_and_from_files(open_page: OpenPage, tmp_path: Path):
    scripted, opened = ScriptedDesk("indoor"), list[NewMission]()

    async def opener(new: NewMission | None, mode: PlanningMode | None) -> None:
        assert new is not None
        opened.append(new)

    scripted.desk.opener = opener
    page = await open_page(scripted, LARGE)
    await load_by_list(page, "fleet-10")
    await until(lambda: len(opened) == 1, "the first one is opened")
    broken, whole = tmp_path / "broken.yaml", tmp_path / "field.yaml"
    broken.write_text("name: broken")
    whole.write_bytes((SHIPPED / "field.yaml").read_bytes())
    files = page.locator('input[type="file"]')
    await files.set_input_files(broken)
    await expect(page.get_by_text("broken.yaml was not loaded")).to_be_visible()
    await files.set_input_files(whole)
    await until(lambda: len(opened) == 2, "the file is opened")
    assert [new.mission.name for new in opened] == ["fleet-10", "field"]
    assert opened[1].content == whole.read_bytes()


# ---------------------------------------------------------------- single orders


async def hovering() -> ScriptedDesk:
    """Two vehicles on their way; they stay where they are while the page is tried."""
    scripted = ScriptedDesk("indoor")
    scripted.pace = 0.0
    await scripted.begin(at_s=[2.0, 2.0])
    return scripted


def said(scripted: ScriptedDesk, number: int) -> bool:
    return all(number in {command for command, _, _ in vehicle.commands} for vehicle in scripted.vehicles)


async def test_orders_in_flight_reach_the_vehicles_and_tell_how_they_went(open_page: OpenPage):
    scripted = await hovering()
    page = await open_page(scripted, LARGE)
    await page.get_by_role("tab", name="Orders").click()
    await press(page, "Hold")
    await expect(orders(page).first).to_contain_text("Hold")
    await expect(orders(page).first).to_contain_text("accepted")
    await press(page, "Speed")
    await until(lambda: said(scripted, mavlink.MAV_CMD_DO_CHANGE_SPEED), "both fly at another speed")
    await press(page, "RTL")
    await until(lambda: all(vehicle.mode is Mode.RTL for vehicle in scripted.vehicles), "both return")
    await press(page, "Land")
    await until(lambda: all(vehicle.mode is Mode.LAND for vehicle in scripted.vehicles), "both land")
    await expect(orders(page).first).to_contain_text("Land")


async def test_a_vehicle_is_armed_once_nothing_speaks_against_it(open_page: OpenPage):
    scripted = ScriptedDesk("indoor")
    await scripted.begin()
    assert scripted.desk.flight is not None
    await scripted.desk.flight.make_plan()
    page = await open_page(scripted, LARGE)
    await expect(page.locator(".gcs-reasons")).to_contain_text("Arm, Take off nothing is uploaded yet")
    for part in scripted.desk.flight.vehicles.values():
        part.monitor.phase = Phase.PREPARED
    await choose(page, "Orders to", "bravo")
    await press(page, "Arm")
    await until(lambda: scripted.vehicles[1].armed, "bravo is armed")
    await expect(page.locator(".gcs-reasons")).to_contain_text("Arm already armed")
    await expect(button(page, "Take off")).to_be_enabled()
    assert not scripted.vehicles[0].armed


async def test_vehicles_are_sent_to_where_the_operator_clicks(open_page: OpenPage):
    scripted = await hovering()
    page = await open_page(scripted, LARGE)
    await choose(page, "Orders to", "alpha")
    await press(page, "Go to")
    await expect(page.get_by_text("Click at the place")).to_be_visible()
    place_m = np.array([12.0, 3.0, 0.0])  # on the floor, beside the crate
    await page.mouse.click(*await pixel_of(page, place_m))
    await until(lambda: len(scripted.desk.orders.orders) > 0, "the order is there")
    order = scripted.desk.orders.orders[-1]
    await until(lambda: order.state.value != "pending", "it has been answered")
    assert (order.who, order.state.value) == ("alpha", "accepted"), order.reason
    height_m = scripted.mission.takeoff_height_m
    np.testing.assert_allclose(scripted.vehicles[0].sent_to_m[-1], place_m + [0.0, 0.0, height_m], atol=0.1)
    assert scripted.vehicles[1].commands == []


async def test_motors_stop_only_when_the_button_is_held(open_page: OpenPage):
    scripted = await hovering()
    page = await open_page(scripted, LARGE)
    kill = button(page, "Kill: hold 1.5 s")
    await expect(kill).to_be_enabled()
    await kill.click()
    await page.wait_for_timeout(1000)
    assert all(vehicle.armed for vehicle in scripted.vehicles)
    await kill.hover()
    await page.mouse.down()
    await until(lambda: not any(vehicle.armed for vehicle in scripted.vehicles), "the motors stand")
    await page.mouse.up()


# ---------------------------------------------------------------- access


async def test_of_two_browsers_one_commands_and_the_other_sees_it(browser: Browser):
    scripted = await hovering()
    async with serving(scripted) as port, tab(browser, port) as first, tab(browser, port) as second:
        await expect(first.locator(".gcs-seat")).to_contain_text("You are in command")
        await expect(second.locator(".gcs-seat")).to_contain_text("browser 1 is in command")
        await button(second, "Hold").dispatch_event("click")
        await expect(second.get_by_text("browser 1 is in command").last).to_be_visible()
        assert scripted.vehicles[0].commands == []
        await button(second, "Take command").click()
        await expect(second.locator(".gcs-seat")).to_contain_text("You are in command")
        await expect(first.locator(".gcs-seat")).to_contain_text("browser 2 is in command")
        await expect(first.locator(".gcs-events")).to_contain_text("browser 2 has taken command from browser 1")
        await button(second, "Hold").click()
        await until(lambda: all(vehicle.mode is Mode.HOLD for vehicle in scripted.vehicles), "both hold")
        await second.reload()
        await expect(second.locator(".gcs-seat")).to_contain_text("You are in command")


async def test_without_the_token_there_is_no_page(browser: Browser):
    scripted = await hovering()
    async with serving(scripted, token="correct horse") as port:
        page = await browser.new_page()
        await page.goto(f"http://{HOST}:{port}")
        await expect(page.locator("form")).to_contain_text("asks for its token")
        await page.get_by_placeholder("Token").fill("battery staple")
        await page.get_by_role("button", name="Enter").click()
        await expect(page.locator(".said")).to_have_text("This is not the token.")
        await expect(page.locator(".gcs-fleet")).to_have_count(0)
        await page.screenshot(path=OUT / "operator-door.png")
        await page.close()
        async with tab(browser, port, query="&token=correct%20horse") as inside:
            assert "token" not in inside.url
            await press(inside, "Hold")
            await until(lambda: all(vehicle.mode is Mode.HOLD for vehicle in scripted.vehicles), "both hold")
