"""The pictures of the page in the documents: `make screenshots`."""

import asyncio
from pathlib import Path

from playwright.async_api import Browser, async_playwright

from tests.browser.chromium import ARGUMENTS, find_chromium
from tests.browser.conftest import LARGE, serving, tab
from tests.browser.scripted_desk import ScriptedDesk
from tests.browser.scripted_plan import scripted_plan
from tests.browser.watching import button

IMAGES = Path(__file__).parents[2] / "docs" / "images"
PICTURES = (
    ("page.jpg", "indoor", 0.45, False),
    ("page-terrain.jpg", "terrain-2-5uav", 0.5, False),
    ("page-light.jpg", "fleet-10", 0.4, True),
)
"""File, mission, how much of the plan has been flown, and whether the page is light."""
SETTLE_MS = 3000


async def picture(browser: Browser, file: str, mission: str, share: float, *, light: bool) -> None:
    """Draw one of them."""
    scripted = ScriptedDesk(mission)
    await scripted.begin(at_s=[share * part.times_s[-1] for part in scripted_plan(scripted.mission).vehicles])
    async with serving(scripted) as port, tab(browser, port, LARGE) as page:
        await page.wait_for_function("window.__viserTestpoints?.rendererInfo.render.triangles > 500")
        await page.wait_for_timeout(SETTLE_MS)
        await page.locator(".mantine-Notification-closeButton").first.click()
        if light:
            await button(page, "Light").click()
        await page.locator(".gcs-legend summary").click()
        await page.wait_for_timeout(SETTLE_MS)
        await page.screenshot(path=IMAGES / file, type="jpeg", quality=86)


async def main() -> None:
    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(executable_path=find_chromium(), args=ARGUMENTS)
        for file, mission, share, light in PICTURES:
            await picture(browser, file, mission, share, light=light)
            print(IMAGES / file)
        await browser.close()


if __name__ == "__main__":
    asyncio.run(main())
