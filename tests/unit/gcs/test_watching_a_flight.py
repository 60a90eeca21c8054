"""`gcs watch --flight`: a flight that another ground station has begun is found by its journal, and not commanded."""

import asyncio
from pathlib import Path

import pytest

from gcs.desk import Desk
from gcs.flight.events import EventLog
from gcs.flight.journal import JOURNAL_FILE, JournalKeeper, read_story
from gcs.flight.rejoining import newest_left_in_flight
from gcs.link.url import LinkUrl, Scheme
from gcs.security.audit import AUDIT_FILE
from gcs.settings import FlightSettings
from gcs.watch import watch
from tests.browser.loopback import free_port
from tests.unit.gcs.test_journal import left_in_flight_below


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return left_in_flight_below(tmp_path)


def test_a_flight_that_was_left_in_the_air_is_found_whatever_its_mission(folder: Path):
    assert newest_left_in_flight(folder.parent) == folder
    (folder.parent / "2026-01-02T00-00-00-watch").mkdir()
    assert newest_left_in_flight(folder.parent) == folder
    keeper = JournalKeeper(folder / JOURNAL_FILE)
    assert newest_left_in_flight(folder.parent) is None  # its ground station lives
    keeper.end(success=True, unix_us=3)
    keeper.close()
    assert newest_left_in_flight(folder.parent) is None
    assert newest_left_in_flight(folder.parent / "nowhere") is None


async def test_the_flight_is_on_the_desk_as_it_was_left_and_nothing_is_ordered(folder: Path, tmp_path: Path):
    story, desks = read_story(folder / JOURNAL_FILE), []

    async def page(desk: Desk, first_browser: asyncio.Event) -> None:
        desks.append(desk)
        await asyncio.Event().wait()

    link = LinkUrl(Scheme.UDP_IN, "127.0.0.1", free_port())
    settings = FlightSettings(mission="", links=(link,), keys=tmp_path / "keys")
    looking = asyncio.Event()
    events = EventLog(lambda: 0.0, listeners=[lambda event: looking.set() if event.kind == "rejoin" else None])
    watching = asyncio.create_task(watch(settings, events, tmp_path, page, story))
    async with asyncio.timeout(5.0):
        await looking.wait()
    watching.cancel()
    await asyncio.wait({watching})
    (desk,) = desks
    assert desk.flight is not None
    assert [part.name for part in desk.flight.in_flight] == ["alpha"]
    assert desk.flight.plan is not None
    assert desk.flight.passive
    assert any("left alpha in flight; looking for them, commanding nothing" in event.text for event in events.events)
    assert (tmp_path / AUDIT_FILE).read_bytes() == b""
