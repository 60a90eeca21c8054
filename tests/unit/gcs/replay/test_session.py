"""A recording on a desk: what is shown is that of the moment, and nothing can be commanded."""

from pathlib import Path

import msgspec
import pytest

from gcs.desk import Intent
from gcs.flight.events import BEGAN, Event
from gcs.flight.told import read_told, said_by_vehicles
from gcs.replay.player import Player
from gcs.replay_session import ReplaySession
from tests.unit.gcs.replay.flights import BEGAN_US, flight, parsed

RECORDING = parsed(flight(60.0))


@pytest.fixture
def session() -> ReplaySession:
    return ReplaySession(Player(RECORDING), said_by_vehicles(RECORDING))


def test_trails_and_events_are_those_of_the_moment(session: ReplaySession):
    session.player.seek(30.0)
    assert session.desk.trails is not None
    assert len(session.desk.trails.by_sysid[1].times_s) == 301
    assert [event.t_s for event in session.desk.events.events][-1] == 28.0
    session.player.seek(10.0)
    assert session.desk.trails is not None
    assert len(session.desk.trails.by_sysid[1].times_s) == 101
    assert {event.text for event in session.desk.events.events} == {"text at 0", "text at 7"}
    assert not session.desk.vehicles[1].texts[-1].text.endswith("28")


def test_playing_makes_trails_longer_without_beginning_them_anew(session: ReplaySession):
    session.player.seek(10.0)
    trails = session.desk.trails
    session.player.play()
    for step in range(21):
        session.step(step * 0.05)
    assert session.desk.trails is trails
    assert trails is not None
    assert len(trails.by_sysid[2].times_s) == 111


def test_ages_are_counted_on_the_recordings_clock(session: ReplaySession):
    session.player.seek(30.0)
    session.step(1e6)
    assert session.desk.station.now_s == 30.0
    assert session.desk.vehicles[1].online(session.desk.station.now_s)


@pytest.mark.parametrize("intent", list(Intent))
def test_nothing_can_be_commanded(session: ReplaySession, intent: Intent):
    session.player.seek(30.0)
    assert session.desk.why_not(intent, [1]) == "this is a recording"


def test_the_log_beside_a_recording_is_moved_onto_its_clock_also_after_a_restart(tmp_path: Path):
    began = [Event(t_s=0.0, vehicle=None, kind=BEGAN, text="", data={"unix_us": BEGAN_US + us}) for us in (-5e6, 20e6)]
    began = [msgspec.structs.replace(e, data={"unix_us": int(e.data["unix_us"])}) for e in began]
    armed = Event(t_s=7.0, vehicle="alpha", kind="command", text="arm")
    lines = [msgspec.json.encode(event) for event in (began[0], armed, began[1], armed)]
    (tmp_path / "events.jsonl").write_bytes(b"\n".join([*lines, b'{"t_s": 1', b"\xff"]))
    told = read_told(tmp_path / "events.jsonl", RECORDING)
    assert [event.t_s for event in told.events if event.kind == "command"] == [2.0, 27.0]
    assert told.unreadable == 2
    assert [event.t_s for event in told.until(3.0)] == [-5.0, 2.0]


def test_without_a_log_the_vehicles_own_words_are_told(tmp_path: Path):
    told = read_told(tmp_path / "none.jsonl", RECORDING)
    assert len(told.events) == 18
    assert (told.events[1].vehicle, told.events[1].text) == ("vehicle 2", "text at 0")
