"""The pictures of the page in the documents: `make screenshots`."""

import asyncio
import io
from pathlib import Path

from PIL import Image
from playwright.async_api import Browser, FloatRect, async_playwright

from missions.mission import Mission
from tests.browser.chromium import ARGUMENTS, find_chromium
from tests.browser.conftest import FINE, LARGE, serving, tab
from tests.browser.large_fleet import large_fleet
from tests.browser.scripted_desk import ScriptedDesk
from tests.browser.scripted_plan import scripted_plan
from tests.browser.watching import button

IMAGES = Path(__file__).parents[2] / "docs" / "images"
PICTURES = (
    ("page.jpg", "indoor", 0.45, False),
    ("page-terrain.jpg", "terrain-2-5uav", 0.5, False),
    ("page-light.jpg", "fleet-10", 0.4, True),
    ("page-fleet.jpg", large_fleet(), 0.45, False),
)
"""File, mission, how much of the plan has been flown, and whether the page is light."""
SETTLE_MS = 3000
FRAMES, FRAME_S, FRAME_MS, FRAME_PX, COLOURS = 30, 0.2, 150, (615, 389), 96
"""Of the animation: how many, flown in between [s], how long each is shown, its size, and its colours."""
SCENE_PX = FloatRect(x=340, y=0, width=1020, height=645)
"""What it shows of the window: the scene alone, since its colours do not do for letters."""
STEP_S = 0.05


async def picture(browser: Browser, file: str, mission: Mission | str, share: float, *, light: bool) -> None:
    """Draw one of them."""
    scripted = ScriptedDesk(mission)
    await scripted.begin(at_s=[share * part.times_s[-1] for part in scripted_plan(scripted.mission).vehicles])
    async with serving(scripted) as port, tab(browser, port, LARGE, FINE) as page:
        await page.wait_for_function("window.__viserTestpoints?.rendererInfo.render.triangles > 500")
        await page.wait_for_timeout(SETTLE_MS)
        await page.locator(".mantine-Notification-closeButton").first.click()
        if light:
            await button(page, "Light").click()
        await page.locator(".gcs-legend summary").click()
        await page.wait_for_timeout(SETTLE_MS)
        await page.screenshot(path=IMAGES / file, type="jpeg", quality=86)


async def animation(browser: Browser) -> None:
    """Draw a flight, frame by frame."""
    scripted, frames = ScriptedDesk("indoor"), list[Image.Image]()
    scripted.pace = 0.0
    await scripted.begin(at_s=[STEP_S, STEP_S])
    async with serving(scripted) as port, tab(browser, port, LARGE, FINE) as page:
        await page.wait_for_timeout(2 * SETTLE_MS)
        await page.locator(".mantine-Notification-closeButton").first.click()
        for _ in range(FRAMES):
            for _ in range(round(FRAME_S / STEP_S)):
                for vehicle in scripted.vehicles:
                    vehicle.fly_on(STEP_S)
                scripted.say()
                scripted.sample()
            await page.wait_for_timeout(600)
            shown = Image.open(io.BytesIO(await page.screenshot(clip=SCENE_PX))).convert("RGB").resize(FRAME_PX)
            frames.append(shown.quantize(COLOURS, dither=Image.Dither.NONE))
    frames[0].save(IMAGES / "flight.gif", save_all=True, append_images=frames[1:], duration=FRAME_MS, loop=0)


async def main() -> None:
    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(executable_path=find_chromium(), args=ARGUMENTS)
        for file, mission, share, light in PICTURES:
            await picture(browser, file, mission, share, light=light)
            print(IMAGES / file)
        await animation(browser)
        print(IMAGES / "flight.gif")
        await browser.close()


if __name__ == "__main__":
    asyncio.run(main())
