"""The virtual clock that simulated flights run on."""

import asyncio
import time

import pytest

from tests.simulation import virtual_time


def test_an_hour_passes_at_once():
    async def wait_an_hour() -> float:
        loop = asyncio.get_running_loop()
        await asyncio.sleep(3600.0)
        return loop.time()

    began_s = time.perf_counter()
    assert virtual_time.run(wait_an_hour()) == pytest.approx(3600.0)
    assert time.perf_counter() - began_s < 1.0


def test_timers_fire_in_order_and_timeouts_hold():
    async def main() -> list[str]:
        order = []

        async def after(seconds: float, name: str) -> None:
            await asyncio.sleep(seconds)
            order.append(name)

        async with asyncio.TaskGroup() as group:
            for seconds, name in ((3.0, "c"), (1.0, "a"), (2.0, "b")):
                group.create_task(after(seconds, name))
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(5.0):
                await asyncio.sleep(5.1)
        return [*order, f"{asyncio.get_running_loop().time():g}"]

    assert virtual_time.run(main()) == ["a", "b", "c", "8"]


def test_a_deadlock_is_an_error_instead_of_a_hang():
    async def wait_for_nobody() -> None:
        await asyncio.Event().wait()

    with pytest.raises(virtual_time.NothingLeftToWaitFor):
        virtual_time.run(wait_for_nobody())
