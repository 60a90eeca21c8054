"""The scene in a real browser: several at once, editing, light and dark, a recording's controls."""

from pathlib import Path
from typing import cast

import numpy as np
import pytest
from playwright.async_api import Browser, expect

from gcs.replay.player import Player
from missions.mission import load_mission
from tests.browser.conftest import OpenPage, serving, tab
from tests.browser.scripted_desk import ScriptedDesk
from tests.browser.scripted_plan import scripted_plan
from tests.browser.toy_player import ToyPlayer
from tests.browser.watching import OUT, button, camera_position_m, middle_of_tag, pixel_of, shows, until

pytestmark = pytest.mark.browser

VERY_FINE = 1.5
"""As many pixels per pixel of the window as small screens of high resolution have."""


async def test_two_browsers_have_a_camera_each_and_share_everything_else(browser: Browser):
    scripted = ScriptedDesk("indoor")
    await scripted.begin(at_s=[0.3 * part.times_s[-1] for part in scripted_plan(scripted.mission).vehicles])
    async with serving(scripted) as port, tab(browser, port, pixels=VERY_FINE) as one, tab(browser, port) as other:
        for page in (one, other):
            await expect(page.locator(".gcs-overlay .tag.vehicle")).to_have_count(2)
            await expect(page.locator(".gcs-overlay .tag", has_text="alpha")).to_contain_text("Offboard · 96 %")
            for node in ("/fleet/hull", "/fleet/tails", "/world/fence"):
                await shows(page, node)
        for vehicle, name in zip(scripted.vehicles, ("alpha", "bravo"), strict=True):
            away = await middle_of_tag(one, name) - await pixel_of(one, vehicle.position_m)
            assert np.all(np.abs(away) < [100.0, 60.0]), "a tag stands by its vehicle, however finely that is drawn"
        before_m = await camera_position_m(other)
        await button(one, "Top").click()
        await one.wait_for_timeout(1500)
        np.testing.assert_allclose((await camera_position_m(one))[0], 10.0, atol=0.5)
        np.testing.assert_allclose(await camera_position_m(other), before_m)
        await button(other, "Light").click()
        await expect(one.locator("html")).to_have_attribute("data-mantine-color-scheme", "light")
        OUT.mkdir(exist_ok=True)
        await one.screenshot(path=OUT / "page-light-from-above.png")


async def test_a_mission_is_edited_in_the_scene_and_saved_as_a_file_that_loads(open_page: OpenPage, tmp_path: Path):
    page = await open_page(ScriptedDesk("indoor"))
    await page.get_by_text("Edit mission").click()
    await button(page, "Cylinder").click()
    await expect(page.locator(".gcs-editing")).to_contain_text("changed")
    await shows(page, "/world/cylinder 1")
    await shows(page, "/editing/gizmo")
    async with page.expect_download() as downloading:
        await button(page, "Save").click()
    saved = tmp_path / "saved.yaml"
    await (await downloading.value).save_as(saved)
    mission = load_mission(saved)
    assert [cylinder.name for cylinder in mission.world.cylinders] == ["column", "cylinder 1"]
    await button(page, "Undo").click()
    await expect(page.locator(".gcs-editing")).to_contain_text("as it was loaded")
    await shows(page, "/world/cylinder 1", there=False)


async def test_a_recording_is_played_and_moved_through(open_page: OpenPage):
    scripted, player = ScriptedDesk(None, watched=1), ToyPlayer()
    scripted.desk.player = cast(Player, player)
    page = await open_page(scripted)
    await expect(page.locator(".gcs-replay")).to_contain_text("00:00.0 of 01:00.0")
    await button(page, "Play").click()
    await until(lambda: player.playing, "it plays")
    for name, then in (("+ 10 s", "00:10.0"), ("+ 10 s", "00:20.0"), ("− 10 s", "00:10.0")):
        await button(page, name).click()
        await expect(page.locator(".gcs-replay")).to_contain_text(f"{then} of 01:00.0")
    await page.get_by_text("5×", exact=True).click()
    await until(lambda: player.speed == 5.0, "it is faster")
    await button(page, "Pause").click()
    await until(lambda: not player.playing, "it stands still")
