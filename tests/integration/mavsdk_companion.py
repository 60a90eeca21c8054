"""MAVSDK on a simulated vehicle's onboard link, for tests."""

import asyncio
from collections.abc import AsyncIterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager

from mavsdk.asyncio.mavsdk import Configuration, Mavsdk

from missions.ports import companion_port


@asynccontextmanager
async def companion(base: int, vehicle: int) -> AsyncIterator[tuple]:
    """MAVSDK on a vehicle's onboard link; the library and the vehicle's system."""
    asyncio.get_running_loop().set_default_executor(ThreadPoolExecutor(16))
    library = Mavsdk(Configuration.create_manual(vehicle, 191, True))
    try:
        await library.add_any_connection(f"udpin://127.0.0.1:{companion_port(vehicle) + base}")
        yield library, await library.first_autopilot(10.0)
    finally:
        library.destroy()


async def until(holds, timeout_s: float = 20.0):
    """Poll an async condition; what it was."""
    async with asyncio.timeout(timeout_s):
        while not (found := await holds()):  # noqa: ASYNC110 - the getters have no event to wait for
            await asyncio.sleep(0.05)
    return found
