"""An event that one thread waits for and another one sets."""

import asyncio
from threading import Thread

from gcs.view.wakening import SharedEvent, make_shared


def in_another_thread(event: asyncio.Event) -> None:
    thread = Thread(target=event.set)
    thread.start()
    thread.join()


async def test_who_waits_is_not_touched_by_another_thread_and_woken_by_the_loop():
    event = asyncio.Event()
    waiting = asyncio.create_task(event.wait())
    await asyncio.sleep(0)
    make_shared(event)
    in_another_thread(event)
    for _ in range(3):
        await asyncio.sleep(0)
    assert event.is_set()
    assert not waiting.done()
    event.set()
    assert await waiting


async def test_who_comes_after_it_was_set_does_not_wait():
    event = SharedEvent()
    in_another_thread(event)
    assert await asyncio.wait_for(event.wait(), 1.0)
    event.clear()
    assert not event.is_set()
