"""Journals: a flight can be put where it was left, whatever of its journal survived."""

from pathlib import Path

import numpy as np
import pytest

from gcs.errors import FlightAborted
from gcs.flight.events import EventLog
from gcs.flight.journal import JOURNAL_FILE, JournalKeeper, is_written, read_story
from gcs.flight.monitor import Phase
from gcs.flight.rejoining import left_in_flight, unfinished
from gcs.flight.sequence import FleetFlight
from gcs.planner.plan import FleetPlan, VehiclePlan
from gcs.settings import PlanningMode
from gcs.station import Station
from missions.mission import Mission, load_mission
from missions.mission_items import Track, encode_track

MISSION = load_mission("indoor")
TRACK = Track(np.array([[5.0, 6.0, 1.5], [19.0, 8.5, 1.5]]), np.array([3.0, 1.0]))


async def no_planner(mission: Mission, *_: object) -> FleetPlan:
    raise FlightAborted("not here")


def new_flight() -> FleetFlight:
    return FleetFlight(Station(), MISSION, PlanningMode.CLOUD, no_planner, EventLog(lambda: 0.0))


def flown() -> FleetFlight:
    """A flight with a plan, in which alpha flies, and bravo is done."""
    flight = new_flight()
    line_m = np.linspace([0.0, 0.0, 0.0], [19.0, 8.5, 1.5], 50)
    parts = [
        VehiclePlan(vehicle.name, vehicle.sysid, (target,), line_m, np.arange(50.0), TRACK, 20.0)
        for vehicle, target in zip(MISSION.vehicles, MISSION.targets, strict=True)
    ]
    flight.take_plan(FleetPlan("indoor", "ecpso", 0, 1, 0.1, 0.1, 6.4, True, (), (), tuple(parts)))
    alpha, bravo = flight.vehicles.values()
    alpha.monitor.ground_offset_m = 0.4
    alpha.take_items(encode_track(TRACK, MISSION.frame, acceptance_radius_m=0.3, ground_offset_m=0.4), MISSION)
    alpha.monitor.phase, alpha.monitor.started_s = Phase.FLYING, 12.5
    bravo.monitor.phase, bravo.monitor.reached, bravo.monitor.reason = Phase.DONE, True, "landed at its target"
    return flight


def left_in_flight_below(path: Path) -> Path:
    """The folder of a flight that was left in the air, among the flights below a path."""
    folder = path / "flights" / "2026-01-01T00-00-00-indoor"
    folder.mkdir(parents=True)
    keeper = JournalKeeper(folder / JOURNAL_FILE)
    keeper.begin(flown(), 1)
    keeper.look(flown(), 2)
    keeper.close()
    return folder


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return left_in_flight_below(tmp_path)


def test_a_flight_is_put_where_it_was_left(folder: Path):
    story, flight, original = read_story(folder / JOURNAL_FILE), new_flight(), flown()
    assert story is not None
    story.restore(flight)
    for sysid, part in original.vehicles.items():
        restored = flight.vehicles[sysid]
        assert repr(restored.items) == repr(part.items).replace("<Command.NAV_WAYPOINT: 16>", "16").replace(
            "<Command.DO_CHANGE_SPEED: 178>", "178"
        )
        assert restored.plan is not None
        np.testing.assert_allclose(restored.plan.curve_m, part.plan.curve_m, atol=1e-3)
        np.testing.assert_allclose(restored.plan.track.points_m, TRACK.points_m)
        for name in ("phase", "reached", "reason", "ground_offset_m", "started_s"):
            assert getattr(restored.monitor, name) == getattr(part.monitor, name)
    assert [part.name for part in flight.in_flight] == ["alpha"]


def test_what_does_not_change_is_not_written_again(folder: Path):
    keeper, flight = JournalKeeper(folder / JOURNAL_FILE), flown()
    keeper.look(flight, 3)
    size = (folder / JOURNAL_FILE).stat().st_size
    keeper.look(flight, 4)
    assert (folder / JOURNAL_FILE).stat().st_size == size
    flight.vehicles[1].monitor.phase = Phase.COMING_DOWN
    keeper.look(flight, 5)
    keeper.close()
    story = read_story(folder / JOURNAL_FILE)
    assert story is not None
    assert story.progress[1].phase is Phase.COMING_DOWN


@pytest.mark.parametrize("cut", [1, 40, 150])
def test_a_torn_end_costs_the_last_line_alone(folder: Path, cut: int):
    path = folder / JOURNAL_FILE
    path.write_bytes(path.read_bytes()[:-cut])
    story = read_story(path)
    assert story is not None
    assert story.planned is not None
    assert story.progress[1].phase is Phase.FLYING


def test_only_a_flight_of_this_mission_that_was_left_in_the_air_is_unfinished(folder: Path):
    assert unfinished(folder, MISSION) is not None
    assert unfinished(folder, load_mission("field")) is None
    assert unfinished(folder / "none", MISSION) is None
    keeper = JournalKeeper(folder / JOURNAL_FILE)
    keeper.end(success=True, unix_us=9)
    keeper.close()
    assert unfinished(folder, MISSION) is None


def test_a_new_flight_in_the_same_folder_is_another_story(folder: Path):
    keeper = JournalKeeper(folder / JOURNAL_FILE)
    keeper.begin(new_flight(), 10)
    keeper.close()
    story = read_story(folder / JOURNAL_FILE)
    assert story is not None
    assert (story.planned, story.aloft) == (None, [])


def test_a_journal_has_one_writer(folder: Path):
    keeper = JournalKeeper(folder / JOURNAL_FILE)
    assert is_written(folder / JOURNAL_FILE)
    with pytest.raises(BlockingIOError):
        JournalKeeper(folder / JOURNAL_FILE)
    assert left_in_flight(folder.parent, MISSION) is None
    keeper.close()
    assert left_in_flight(folder.parent, MISSION) == folder


@pytest.mark.parametrize(
    "data", [b"", b"\n\n", b"\xff\xfe\n", b'{"type": "began"}\n', b"[1, 2]\n", b"[" * 5000, b'"\xf2"', b'{"a":' * 5000]
)
def test_what_is_no_journal_tells_nothing(tmp_path: Path, data: bytes):
    (tmp_path / JOURNAL_FILE).write_bytes(data)
    assert read_story(tmp_path / JOURNAL_FILE) is None
