"""What tests look for on the page, and press."""

import asyncio
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from playwright.async_api import Locator, Page
from viser import transforms

from tests.browser.loopback import PATIENCE_S

OUT = Path(__file__).parents[2] / "out"
"""Screenshots for people to look at."""

POLL_S = 0.05


def button(page: Page, name: str) -> Locator:
    return page.get_by_role("button", name=name, exact=True)


async def choose(page: Page, label: str, option: str) -> None:
    """Choose from a dropdown."""
    await page.get_by_label(label, exact=True).first.click()
    await page.get_by_role("option", name=option, exact=True).click()


def row(page: Page, vehicle: str) -> Locator:
    return page.locator(".gcs-fleet tbody tr", has_text=vehicle)


async def until(condition: Callable[[], bool], what: str) -> None:
    """Wait for something on the ground station's side."""
    for _ in range(round(PATIENCE_S / POLL_S)):
        if condition():
            return
        await asyncio.sleep(POLL_S)
    pytest.fail(f"waited in vain until {what}")


async def scene(page: Page) -> set[str]:
    """Names of what is in the browser's scene."""
    return set(await page.evaluate("Object.keys(window.__viserSceneTree.getState())"))


async def shows(page: Page, node: str, *, there: bool = True) -> None:
    """Wait until a node is in the browser's scene, or is no more."""
    found = f"{node!r} in window.__viserSceneTree.getState()"
    await page.wait_for_function(found if there else f"!({found})")


async def camera_position_m(page: Page) -> np.ndarray:
    """Of the browser's camera, in ENU."""
    w, x, y, z = await page.evaluate("window.__viserSceneTree.getState()[''].wxyz")
    place = await page.evaluate("window.__viserMutable.camera.position.toArray()")
    return transforms.SO3(np.array([w, x, y, z])).inverse() @ np.array(place)


async def pixel_of(page: Page, place_m: np.ndarray) -> tuple[float, float]:
    """Where in the browser's window its camera shows a place, ENU."""
    w, x, y, z = await page.evaluate("window.__viserSceneTree.getState()[''].wxyz")
    place = transforms.SO3(np.array([w, x, y, z])) @ place_m
    across, down = await page.evaluate(
        """place => {
            const { camera, canvas } = window.__viserMutable;
            const { x, y } = camera.position.clone().fromArray(place).project(camera);
            const { left, top, width, height } = canvas.getBoundingClientRect();
            return [left + (1 + x) / 2 * width, top + (1 - y) / 2 * height];
        }""",
        place.tolist(),
    )
    return across, down


async def middle_of_tag(page: Page, name: str) -> np.ndarray:
    """Where in the browser's window a name tag stands; tags are written anew all the time, so that is one question."""
    found = await page.wait_for_function(
        """name => {
            const tags = Array.from(document.querySelectorAll(".gcs-overlay .tag"));
            const tag = tags.find(tag => tag.querySelector("b").textContent === name);
            if (!tag) return null;
            const { left, top, width, height } = tag.getBoundingClientRect();
            return [left + width / 2, top + height / 2];
        }""",
        arg=name,
    )
    return np.array(await found.json_value())


async def restyled(page: Page, seconds: float) -> list[int]:
    """How many elements the browser has worked out the styles of, each time that it has, while so much time passes."""
    browser = page.context.browser
    assert browser is not None
    await browser.start_tracing(page=page, categories=["devtools.timeline"])
    await page.wait_for_timeout(1e3 * seconds)
    events = json.loads(await browser.stop_tracing())["traceEvents"]
    counts = (event["args"].get("elementCount") for event in events if event["name"] == "UpdateLayoutTree")
    return [count for count in counts if count is not None]


async def pixels(page: Page) -> bytes:
    """What the browser's canvas shows, RGBA."""
    values = await page.evaluate(
        """() => {
            const canvas = document.querySelector("canvas[data-engine]");
            const copy = document.createElement("canvas");
            copy.width = 320; copy.height = 200;
            const context = copy.getContext("2d");
            context.drawImage(canvas, 0, 0, 320, 200);
            return Array.from(context.getImageData(0, 0, 320, 200).data);
        }"""
    )
    return bytes(values)


async def plots(page: Page, count: int) -> None:
    """Wait until so many plots are shown, each with lines in colours: axes and grids are grey."""
    await page.wait_for_function(
        """count => {
            const drawn = Array.from(document.querySelectorAll(".uplot canvas"), canvas => {
                if (!canvas.width) return false;
                const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
                let coloured = 0;
                for (let i = 0; i < data.length; i += 4) {
                    const rgb = data.slice(i, i + 3);
                    if (data[i + 3] > 128 && Math.max(...rgb) - Math.min(...rgb) > 60) coloured += 1;
                }
                return coloured > 100;
            });
            return drawn.length === count && drawn.every(Boolean);
        }""",
        arg=count,
    )
