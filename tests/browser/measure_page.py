"""What the page costs: `python -m tests.browser.measure_page`.

Producer time per update, bytes per second to one browser, and the time from opening the page to seeing the scene.
"""

import asyncio
import time
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import viser
import websockets.asyncio.client
from playwright.async_api import async_playwright
from websockets.typing import Subprotocol

from gcs.dialect import Mode
from gcs.planner.plan import VehiclePlan
from gcs.view.page import Page
from gcs.view.server import UPDATE_INTERVAL_S, close_server, open_server
from missions.mission import load_mission
from missions.mission_items import Track
from missions.tunnel import CompanionState
from tests.browser.chromium import ARGUMENTS, find_chromium
from tests.browser.scripted_desk import ScriptedDesk

Array = npt.NDArray[np.float64]

PORT = 18_230
FLEETS = (2, 10, 100)
WARM_UP, UPDATES = 30, 300


def circling(count: int) -> ScriptedDesk:
    """Vehicles without a mission that fly circles, with companions that report what they fly."""
    scripted = ScriptedDesk(None, watched=count)
    angles = np.linspace(0.0, 60.0 * np.pi, 20_000)
    for index, vehicle in enumerate(scripted.vehicles):
        centre_m = np.array([12.0 * (index % 10), 12.0 * (index // 10), 5.0])
        curve_m = centre_m + 4.0 * np.stack((np.cos(angles), np.sin(angles), 0.2 * np.sin(3 * angles)), axis=1)
        track, target = Track(curve_m[-1:], np.array([3.0])), load_mission("field").targets[0]
        vehicle.plan = VehiclePlan("", vehicle.sysid, (target,), curve_m, angles * 4.0 / 3.0, track, 1.0)
        vehicle.mode, vehicle.armed, vehicle.companion = Mode.OFFBOARD, True, CompanionState.FLYING
    return scripted


async def producer_ms(count: int) -> tuple[Array, float]:
    """CPU times of the updates [ms], and bytes per second to one browser."""
    scripted, server = circling(count), open_server("127.0.0.1", PORT)
    try:
        page = Page(server, scripted.desk)
        times_s: list[float] = []
        received = asyncio.create_task(_bytes_received())
        begun_s = asyncio.get_running_loop().time()
        for update in range(WARM_UP + UPDATES):
            for vehicle in scripted.vehicles:
                vehicle.fly_on(UPDATE_INTERVAL_S)
            scripted.say()
            scripted.sample()
            at_s = time.thread_time()
            page.update(update * UPDATE_INTERVAL_S)
            times_s.append(time.thread_time() - at_s)
            await asyncio.sleep(
                max(0.0, begun_s + (update + 1) * UPDATE_INTERVAL_S - asyncio.get_running_loop().time())
            )
        lasted_s = asyncio.get_running_loop().time() - begun_s
        received.cancel()
        counted = await received
    finally:
        await asyncio.to_thread(close_server, server)
    return np.array(times_s[WARM_UP:]) * 1e3, counted / lasted_s


async def _bytes_received() -> int:
    """What arrives at one client until it is cancelled."""
    total = 0
    protocol = Subprotocol(f"viser-v{viser.__version__}")
    try:
        async with websockets.asyncio.client.connect(
            f"ws://127.0.0.1:{PORT}", subprotocols=[protocol], max_size=None, compression=None
        ) as connection:
            async for datagram in connection:
                total += len(datagram)
    except asyncio.CancelledError:
        pass
    return total


async def load_times_s(mission: str) -> dict[str, float]:
    """From opening the page to its panels and to its scene [s]."""
    scripted = ScriptedDesk(mission)
    await scripted.begin(at_s=[5.0] * len(scripted.vehicles))
    server = open_server("127.0.0.1", PORT)
    page = Page(server, scripted.desk)
    flying = asyncio.create_task(_keep_flying(scripted, page.update))
    try:
        async with async_playwright() as playwright:
            browser = await playwright.chromium.launch(executable_path=find_chromium(), args=ARGUMENTS)
            tab = await browser.new_page(viewport={"width": 1280, "height": 720})
            begun_s = time.perf_counter()
            await tab.goto(f"http://127.0.0.1:{PORT}")
            await tab.wait_for_selector(".gcs-fleet")
            panels_s = time.perf_counter() - begun_s
            await tab.wait_for_function("window.__viserTestpoints?.rendererInfo.render.triangles > 1000")
            scene_s = time.perf_counter() - begun_s
            await browser.close()
    finally:
        flying.cancel()
        await asyncio.to_thread(close_server, server)
    return {"panels": panels_s, "scene": scene_s}


async def _keep_flying(scripted: ScriptedDesk, update: Callable[[float], None]) -> None:
    while True:
        scripted.say()
        scripted.sample()
        update(asyncio.get_running_loop().time())
        await asyncio.sleep(UPDATE_INTERVAL_S)


async def main() -> None:
    for count in FLEETS:
        cpu_ms, bytes_per_s = await producer_ms(count)
        p10, p50, p99 = np.percentile(cpu_ms, (10, 50, 99))
        update = f"{p50:6.2f} ms of CPU per update (p10 {p10:.2f}, p99 {p99:.2f}, mean {cpu_ms.mean():.2f})"
        print(f"{count:4} vehicles: {update}, {bytes_per_s / 1e3:.0f} kB/s to one browser")
    for mission in ("indoor", "terrain-1-5uav"):
        took_s = await load_times_s(mission)
        print(
            f"{mission}: panels after {took_s['panels']:.1f} s, scene after {took_s['scene']:.1f} s, drawn in software"
        )


if __name__ == "__main__":
    asyncio.run(main())
