"""The web page in a real browser: what an operator sees, and what comes of pressing."""

import re

import numpy as np
import pytest
from playwright.async_api import expect

from gcs.dialect import Mode, mavlink
from gcs.flight.events import Severity
from gcs.flight.monitor import Phase
from tests.browser.conftest import FINE, LARGE, OpenPage
from tests.browser.scripted_desk import ScriptedDesk
from tests.browser.scripted_plan import scripted_plan
from tests.browser.watching import OUT, button, camera_position_m, pixels, restyled, row, scene, until

pytestmark = pytest.mark.browser

HOLD = (mavlink.MAV_CMD_DO_SET_MODE, float(Mode.HOLD.main), float(Mode.HOLD.sub))
LAND = (mavlink.MAV_CMD_DO_SET_MODE, float(Mode.LAND.main), float(Mode.LAND.sub))


async def flying(mission: str, share: float = 0.4) -> ScriptedDesk:
    """All vehicles of a mission on their way."""
    scripted = ScriptedDesk(mission)
    await scripted.begin(at_s=[share * part.times_s[-1] for part in scripted_plan(scripted.mission).vehicles])
    return scripted


async def test_the_page_shows_mission_fleet_and_log_and_says_why_buttons_are_off(open_page: OpenPage):
    scripted = ScriptedDesk("indoor")
    scripted.events.add("connected", "autopilot heard", "alpha")
    page = await open_page(scripted)
    await expect(page.locator(".gcs-head h1")).to_have_text("indoor")
    await expect(page.locator(".gcs-head p")).to_contain_text("two drones to crossed targets")
    await expect(page.locator(".gcs-head .phase")).to_have_text("Ready to plan")
    await expect(page.locator(".gcs-fleet tbody tr")).to_have_count(2)
    await expect(row(page, "alpha")).to_contain_text("Hold")
    await expect(row(page, "bravo")).to_contain_text("96 %")
    await expect(page.locator(".gcs-events li", has_text="alpha autopilot heard")).to_have_count(1)
    for name in ("Plan", "Fly"):
        await expect(button(page, name)).to_be_enabled()
    for name in ("Upload", "Hold", "Resume", "RTL", "Land"):
        await expect(button(page, name)).to_be_disabled()
    reasons = page.locator(".gcs-reasons")
    await expect(reasons).to_contain_text("Upload, Arm, Take off, Start there is no plan yet")
    await expect(reasons).to_contain_text("Hold, Resume, RTL, Land, Go to, Speed, Kill not in flight")


async def test_planning_shows_its_progress_and_then_the_plan(open_page: OpenPage):
    scripted = ScriptedDesk("indoor")
    scripted.planning_s = 4.0
    page = await open_page(scripted)
    await expect(page.locator(".gcs-plan")).to_have_text("No plan yet")
    await button(page, "Plan").click()
    await expect(page.get_by_role("progressbar")).to_be_visible()
    await expect(page.locator(".gcs-head .phase")).to_have_text("Planning")
    await expect(button(page, "Plan")).to_be_disabled()
    await expect(page.locator(".gcs-head .phase")).to_have_text("Planned")
    await expect(page.locator(".gcs-plan")).to_contain_text(re.compile("feasible.*evaluations in 0.42 s"))
    await expect(page.get_by_role("progressbar")).to_be_hidden()
    await expect(button(page, "Upload")).to_be_enabled()
    assert {"/plan/curves", "/plan/track points"} <= await scene(page)


async def test_hold_reaches_every_vehicle_and_the_table_shows_it(open_page: OpenPage):
    scripted = await flying("indoor", share=0.2)
    page = await open_page(scripted)
    await expect(row(page, "alpha")).to_contain_text("Offboard")
    await expect(button(page, "Fly")).to_be_disabled()
    await button(page, "Hold").click()
    await until(lambda: all(HOLD in vehicle.commands for vehicle in scripted.vehicles), "both have got the command")
    for name in ("alpha", "bravo"):
        await expect(row(page, name)).to_contain_text("Hold")
        await expect(row(page, name)).to_contain_text("interrupted")
    await expect(page.locator(".gcs-head .phase")).to_have_text("Interrupted")
    await expect(page.locator(".gcs-reasons")).to_contain_text("Hold already in hold")
    await expect(button(page, "Resume")).to_be_enabled()
    assert [event.text for event in scripted.events.events].count("hold") == 2


async def test_orders_go_to_the_selected_vehicle_alone(open_page: OpenPage):
    scripted = await flying("indoor", share=0.2)
    page = await open_page(scripted)
    await page.get_by_label("Orders to").click()
    await page.get_by_role("option", name="bravo", exact=True).click()
    await expect(row(page, "bravo")).to_have_class("selected")
    await button(page, "Land").click()
    await until(lambda: LAND in scripted.vehicles[1].commands, "bravo has got the command")
    await expect(row(page, "bravo")).to_contain_text("Land")
    assert LAND not in scripted.vehicles[0].commands
    assert scripted.vehicles[0].mode is Mode.OFFBOARD


async def test_what_comes_from_outside_is_shown_as_text_and_a_reload_keeps_everything(open_page: OpenPage):
    scripted = await flying("indoor", share=0.2)
    page = await open_page(scripted)
    scripted.air.say(scripted.vehicles[0].text("<img src=x onerror=alert(1)>", severity=3))
    scripted.events.add("failed", "<b>not bold</b>", "bravo", Severity.WARNING)
    log = page.locator(".gcs-events")
    for _ in range(2):
        await expect(log.locator("li.bad", has_text="<img src=x onerror=alert(1)>")).to_have_count(1)
        await expect(log.locator("li.warn", has_text="<b>not bold</b>")).to_have_count(1)
        await expect(log.locator("img")).to_have_count(0)
        await expect(page.locator(".gcs-head h1")).to_have_text("indoor")
        await expect(row(page, "alpha")).to_contain_text("Offboard")
        await expect(button(page, "Hold")).to_be_enabled()
        assert {"/plan/curves", "/fleet/hull", "/world/crate"} <= await scene(page)
        await expect(page.locator(".gcs-overlay .tag", has_text="alpha")).to_contain_text("Offboard · 96 %")
        await page.reload()


async def test_the_end_of_a_mission_is_told(open_page: OpenPage):
    scripted = await flying("indoor", share=1.0)
    assert scripted.desk.flight is not None
    for part in scripted.desk.flight.vehicles.values():
        part.monitor.phase, part.monitor.reached = Phase.DONE, True
    page = await open_page(scripted)
    await expect(page.locator(".gcs-head .phase")).to_have_text("Mission accomplished")
    await expect(row(page, "alpha")).to_contain_text("reached")
    await expect(page.locator(".gcs-reasons")).to_contain_text(
        "Plan, Upload, Fly, Arm, Take off, Start this mission has been flown"
    )


async def test_without_a_mission_vehicles_are_watched_and_commanded(open_page: OpenPage):
    scripted = ScriptedDesk(None, watched=2)
    scripted.vehicles[0].armed = True
    page = await open_page(scripted)
    await expect(page.locator(".gcs-head .phase")).to_have_text("Watching")
    await expect(page.locator(".gcs-fleet tbody tr")).to_have_count(2)
    for name in ("Plan", "Upload", "Fly", "Resume"):
        await expect(button(page, name)).to_have_count(0)
    await button(page, "Land").click()
    await until(lambda: LAND in scripted.vehicles[0].commands, "vehicle 1 has got the command")
    await expect(row(page, "vehicle 1")).to_contain_text("Land")
    assert scripted.vehicles[1].commands == []  # it stands on the ground


async def test_cameras_see_the_whole_world_look_from_above_and_follow(open_page: OpenPage):
    scripted = await flying("indoor", share=0.2)
    page = await open_page(scripted)
    await page.wait_for_function("window.__viserTestpoints?.rendererInfo.render.triangles > 500")
    first_m = await camera_position_m(page)
    assert first_m[0] < 10.0  # of a room of 20 x 15 m: from the south-west
    assert first_m[1] < 0.0
    assert first_m[2] > 4.0
    await button(page, "Top").click()
    await page.wait_for_timeout(1500)
    above_m = await camera_position_m(page)
    np.testing.assert_allclose(above_m[0], 10.0, atol=0.5)
    assert above_m[2] > 12.0
    await page.get_by_label("Orders to").click()
    await page.get_by_role("option", name="alpha", exact=True).click()
    await button(page, "Follow").click()
    await page.wait_for_timeout(3000)
    offset_m = await camera_position_m(page) - scripted.vehicles[0].position_m
    assert np.linalg.norm(offset_m) < 15.0
    await button(page, "Overview").click()
    await page.wait_for_timeout(1500)
    back_m = await camera_position_m(page)
    assert np.linalg.norm(back_m - np.array([10.0, 7.5, 2.0])) > 15.0


@pytest.mark.parametrize(
    ("mission", "vehicles"),
    [
        ("field", 1),
        pytest.param("indoor-unmapped", 2, marks=pytest.mark.slow),
        pytest.param("fleet-10", 10, marks=pytest.mark.slow),
        pytest.param("terrain-1-5uav", 5, marks=pytest.mark.slow),
    ],
)
async def test_every_world_is_drawn(open_page: OpenPage, mission: str, vehicles: int):
    page = await open_page(await flying(mission), LARGE, FINE)
    await expect(page.locator(".gcs-fleet tbody tr")).to_have_count(vehicles)
    await page.wait_for_function("window.__viserTestpoints?.rendererInfo.render.triangles > 500")
    await page.wait_for_timeout(4000)  # for the tags' letters
    await page.locator(".mantine-Notification-closeButton").first.click()  # it says that this is drawn in software
    OUT.mkdir(exist_ok=True)
    await page.screenshot(path=OUT / f"page-{mission}.png")
    shown = np.frombuffer(await pixels(page), dtype=np.uint8).reshape(-1, 4)
    drawn = shown[shown[:, 3] > 0]
    assert len(drawn) > 0.1 * len(shown), "most of the picture is empty"
    assert len(np.unique(drawn // 16, axis=0)) > 60, "the picture has hardly any colours"


async def test_what_is_written_anew_ten_times_a_second_leaves_the_styles_of_the_rest_alone(open_page: OpenPage):
    page = await open_page(await flying("indoor"))
    await expect(page.locator(".gcs-overlay .tag.vehicle")).to_have_count(2)
    await page.wait_for_timeout(2000)
    everything = await page.evaluate("document.querySelectorAll('*').length")
    counts = await restyled(page, 3.0)
    assert len(counts) > 5, "tags and table are written anew"
    assert np.median(counts) < 0.3 * everything, counts
