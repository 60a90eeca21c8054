"""The operator is told whom to trust, and of frames in somebody else's name."""

import pytest

from gcs.flight.events import EventLog, Severity
from gcs.flight.security_watch import TELL_INTERVAL_S, SecurityWatch
from gcs.link.codec import Codec
from gcs.security.signing import Signing, VehicleKey
from gcs.station import Station
from tests.unit.gcs.security.frames import KEY, NOW_UNIX_US, frame


class Silence:
    """A connection on which nothing is sent."""

    peer = None

    def send(self, datagram: bytes, address: tuple[str, int]) -> None: ...


@pytest.fixture
async def watch() -> SecurityWatch:
    station = Station(codec=Codec(signing=Signing({1: VehicleKey(KEY)}, lambda: NOW_UNIX_US)))
    return SecurityWatch(station, EventLog(lambda: 0.0), {1: "alpha"})


def hear(watch: SecurityWatch, datagram: bytes) -> None:
    watch.station.receive(Silence(), datagram, ("127.0.0.1", 1))


async def test_each_vehicle_is_said_to_be_signed_or_unsigned_once(watch: SecurityWatch):
    hear(watch, frame())
    hear(watch, frame(None, system=2))
    watch.look(0.0)
    watch.look(100.0)
    assert [(e.vehicle, e.text.split(":")[0], e.severity) for e in watch.events.events] == [
        ("alpha", "SIGNED", Severity.INFO),
        ("vehicle 2", "UNSIGNED", Severity.WARNING),
    ]


async def test_refused_frames_are_told_but_do_not_flood_the_log(watch: SecurityWatch):
    hear(watch, frame())
    watch.look(0.0)
    for second in range(30):
        hear(watch, frame(None))
        watch.look(float(second))
    told = [event.text for event in watch.events.events if "dropped" in event.text]
    assert told[0] == "a frame was dropped in its name: what came is not signed"
    assert len(told) == 30 / TELL_INTERVAL_S
    assert watch.station.fleet.vehicles.keys() == {1}


async def test_a_vehicle_with_a_key_that_only_sends_unsigned_frames_does_not_exist(watch: SecurityWatch):
    hear(watch, frame(None))
    watch.look(0.0)
    assert watch.station.fleet.vehicles == {}
    assert "is not signed" in watch.events.events[0].text
