"""Files that come from elsewhere, or were left behind by a crash: whatever is in them, they are read or refused."""

import tempfile
from abc import abstractmethod
from contextlib import suppress
from pathlib import Path

import msgspec
import numpy as np

from gcs.dialect import mavlink
from gcs.errors import BadFile, GcsError, KeyRingError, ParameterError
from gcs.files.conversion import WRITABLE, Format, format_document, parse_document
from gcs.files.document import CIRCLE_CORNERS, PlanDocument
from gcs.files.flying import mission_of, plan_of
from gcs.files.sources import mission_area
from gcs.flight.events import EventLog
from gcs.flight.journal import JOURNAL_FILE, JournalKeeper, read_story
from gcs.flight.sequence import FleetFlight
from gcs.flight.told import read_told
from gcs.microservices.parameter_fetch import Parameter
from gcs.microservices.parameter_files import parameter_differences, read_parameters, write_parameters
from gcs.planner.plan import FleetPlan, VehiclePlan
from gcs.replay.player import Player
from gcs.replay.recording import parse_recording
from gcs.replay.ways import Ways
from gcs.security.key_ring import KEYS, PENDING, TIMESTAMPS, KeyRing
from gcs.security.signing import VehicleKey
from gcs.settings import PlanningMode
from gcs.station import Station
from missions.errors import MissionError
from missions.mission import Mission, load_mission
from missions.mission_items import MissionItem, Track, encode_track
from tests.fuzz.damage import Damage
from tests.fuzz.target import Target
from tests.unit.gcs.replay import flights

MISSION = load_mission("indoor")
TRACK = Track(np.array([[5.0, 6.0, 1.5], [19.0, 8.5, 1.5]]), np.array([3.0, 1.0]))


class FileTarget(Target):
    """Reads one damaged file after the other."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._damage = Damage(rng, self.samples())

    @abstractmethod
    def samples(self) -> list[bytes]:
        """Well-formed files."""

    @abstractmethod
    def read(self, data: bytes) -> None:
        """Read and use a file; raises if it gets anything but read or refused with a sentence."""

    def feed(self) -> None:
        for _ in range(5):
            self.read(self._damage.sample())

    def check(self) -> None:
        """Nothing is remembered from one file to the next."""


class PlanFileTarget(FileTarget):
    """Plans and areas of other tools, of all formats, and what is done with them: written again, made ready to fly."""

    def samples(self) -> list[bytes]:
        area = mission_area(MISSION)
        items = encode_track(TRACK, MISSION.frame, acceptance_radius_m=0.3)
        mission = PlanDocument(items=tuple(items), home=MISSION.origin, hover_speed_m_s=3.0)
        self._kinds: list[Format] = []
        texts: list[bytes] = []
        for kind in sorted(WRITABLE, key=lambda one: one.value):
            for document in (mission, area):
                with suppress(BadFile):
                    texts.append(format_document(document, "x", kind)[0].encode())
        return texts

    def read(self, data: bytes) -> None:
        for kind in WRITABLE:
            with suppress(BadFile):
                document, _ = parse_document(data, f"x{kind.value}", kind)
                self._use(document)

    def _use(self, document: PlanDocument) -> None:
        assert len(document.items) <= 10_000
        assert CIRCLE_CORNERS * len(document.circles) <= 10_000_000
        for kind in WRITABLE:
            with suppress(BadFile):
                format_document(document, "x", kind)
        with suppress(BadFile, MissionError):
            plan_of(document, mission_of(document, "x", 1, set_parameters=False))


class RecordingTarget(FileTarget):
    """Recordings: read, played, sought, and drawn."""

    def __init__(self, rng: np.random.Generator) -> None:
        super().__init__(rng)
        self._rng = rng

    def samples(self) -> list[bytes]:
        odd = mavlink.MAVLink_global_position_int_message(2**32 - 1, -(2**31), 2**31 - 1, -(2**31), 0, 0, 0, 0, 0)
        return [flights.flight(20.0), b"".join(flights.record(t, odd) for t in (0.0, -5.0, 1e9)) + flights.flight(2.0)]

    def read(self, data: bytes) -> None:
        recording = parse_recording(np.frombuffer(data, np.uint8))
        assert len(recording) == len(recording.times_s)
        assert (np.diff(recording.times_s) >= 0.0).all()
        if not len(recording):
            return
        player = Player(recording)
        player.play()
        player.seek(recording.duration_s * self._rng.random())
        for step in range(3):
            player.advance(float(step))
        ways = Ways(recording)
        assert all(np.isfinite(way.geodetic).all() for way in ways.by_sysid.values())
        ways.first_place()


class ParameterFileTarget(FileTarget):
    """`.params` files."""

    def samples(self) -> list[bytes]:
        values = {"COM_OF_LOSS_T": Parameter(1.0, 9), "NAV_DLL_ACT": Parameter(0, 6), "A": Parameter(-1.5e-7, 9)}
        return [write_parameters(values, 1).encode(), b"1 1 MPC_XY_CRUISE 5.0 9\n# x\n\n1 50 OTHER 1 6\n"]

    def read(self, data: bytes) -> None:
        with suppress(ParameterError):
            found = read_parameters(data.decode(errors="replace"), "x.params")
            assert read_parameters(write_parameters(found, 1), "again") == found
            list(parameter_differences(found, {}))
            list(parameter_differences(found, found))


class KeyRingTarget(FileTarget):
    """Keys, pending keys and timestamps on the disk."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._folder = tempfile.TemporaryDirectory()
        self._ring, self._rng = KeyRing(Path(self._folder.name) / "ring"), rng
        super().__init__(rng)

    def samples(self) -> list[bytes]:
        self._ring.save({1: VehicleKey(bytes(range(32)), bytes(32), 5, {(1, 0): 4}), 2: VehicleKey(b"k" * 32)})
        self._whole = {name: (self._ring.folder / name).read_bytes() for name in (KEYS, PENDING, TIMESTAMPS)}
        return list(self._whole.values())

    def read(self, data: bytes) -> None:
        names = list(self._whole)
        spoilt = names[self._rng.integers(len(names))]
        for name in names:
            (self._ring.folder / name).write_bytes(data if name == spoilt else self._whole[name])
        with suppress(KeyRingError):
            vehicles = self._ring.load()
            assert all(1 <= sysid <= 255 and (v.key is None or len(v.key) == 32) for sysid, v in vehicles.items())
            self._ring.save(vehicles)

    def close(self) -> None:
        self._folder.cleanup()


class JournalTarget(FileTarget):
    """A journal, and the event log beside it, after a crash: the flight is put where it says, or left alone."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._folder = tempfile.TemporaryDirectory()
        self._path = Path(self._folder.name) / JOURNAL_FILE
        self._recording = parse_recording(np.frombuffer(flights.flight(2.0), np.uint8))
        super().__init__(rng)

    def samples(self) -> list[bytes]:
        keeper = JournalKeeper(self._path)
        keeper.begin(_flown(), 1)
        keeper.look(_flown(), 2)
        keeper.close()
        return [self._path.read_bytes()]

    def read(self, data: bytes) -> None:
        self._path.write_bytes(data)
        read_told(self._path, self._recording)
        story = read_story(self._path)
        if story is not None:
            with suppress(GcsError, MissionError):
                story.restore(_new_flight(story.mission))

    def close(self) -> None:
        self._folder.cleanup()


async def _no_planner(mission: Mission) -> FleetPlan:
    raise BadFile(mission.name, "", "not planned here")


def _new_flight(mission: Mission) -> FleetFlight:
    return FleetFlight(Station(), mission, PlanningMode.CLOUD, _no_planner, EventLog(lambda: 0.0))


def _flown() -> FleetFlight:
    flight = _new_flight(MISSION)
    line_m = np.linspace([0.0, 0.0, 0.0], [19.0, 8.5, 1.5], 5)
    parts = [
        VehiclePlan(vehicle.name, vehicle.sysid, (target,), line_m, np.arange(5.0), TRACK, 20.0)
        for vehicle, target in zip(MISSION.vehicles, MISSION.targets, strict=True)
    ]
    flight.take_plan(FleetPlan("indoor", "ecpso", 0, 1, 0.1, 0.1, 6.4, True, (), (), tuple(parts)))
    for part in flight.vehicles.values():
        items: list[MissionItem] = list(encode_track(TRACK, MISSION.frame, acceptance_radius_m=0.3))
        part.take_items(tuple(msgspec.structs.replace(item) for item in items), MISSION)
    return flight
