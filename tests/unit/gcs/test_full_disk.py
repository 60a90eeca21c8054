"""On a full disk a flight goes on: what cannot be written is said once, and orders go out."""

import asyncio
from pathlib import Path

import pytest

from gcs.dialect import mavlink
from gcs.flight import actions
from gcs.flight.events import Event, EventLog, Severity
from gcs.flight.journal import JournalKeeper
from gcs.link.tlog import TlogWriter
from gcs.microservices.command_client import CommandClient
from gcs.security.audit import Audit, AuditFile
from gcs.station import Station
from gcs.unwritten import Unwritten
from tests.simulation import virtual_time
from tests.unit.gcs import messages as mav
from tests.unit.gcs.test_journal import flown

FULL = Path("/dev/full")
"""Takes nothing: "No space left on device"."""
PEER = ("127.0.0.1", 1)


class Wire:
    peer = None
    budget_bytes_s: float | None = None

    def __init__(self) -> None:
        self.sent: list[bytes] = []

    def send(self, datagram: bytes, address: tuple[str, int]) -> None:
        self.sent.append(datagram)


async def acknowledged(station: Station, wire: Wire, service: CommandClient) -> None:
    answer = mav.frame_of(1, 1, mavlink.MAVLink_command_ack_message(service.command.number, 0))
    asyncio.get_running_loop().call_later(0.1, station.receive, wire, answer, PEER)
    await station.run(service)


def test_a_vehicle_is_heard_and_ordered_although_nothing_can_be_recorded():
    said: list[str] = []

    async def play() -> None:
        station, wire = Station(recording=TlogWriter(FULL, say=said.append), unix_us=lambda: 0), Wire()
        audit = AuditFile(FULL, said.append)
        station.audit = Audit(audit.write, station.unix_us)
        heartbeat = mavlink.MAVLink_heartbeat_message(2, 12, 81, 0x03040000, 3, 3)
        for seq in range(1000):
            station.receive(wire, mav.frame_of(1, 1, heartbeat, seq % 256), PEER)
        for command in (actions.arm(), actions.disarm()):
            await acknowledged(station, wire, CommandClient(command, (1, 1)))
        assert station.recording is not None
        station.recording.close()
        audit.close()
        assert len(wire.sent) == 2

    virtual_time.run(play())
    goes_on = "cannot be written: No space left on device; everything else goes on without it"
    assert said == [f"the recording {goes_on}", f"the audit log {goes_on}"]


def test_events_are_told_although_they_cannot_be_written():
    told: list[Event] = []
    log = EventLog(lambda: 0.0, FULL, listeners=[told.append])
    for number in range(3):
        log.add("x", f"event {number}")
    log.close()
    assert [event.text for event in told if event.kind == "x"] == ["event 0", "event 1", "event 2"]
    (complaint,) = [event for event in told if event.kind == "disk"]
    assert complaint.severity is Severity.ERROR
    assert "the event log cannot be written" in complaint.text


def test_a_journal_that_cannot_be_written_does_not_end_the_flight():
    said: list[str] = []
    keeper = JournalKeeper(FULL, said.append)
    keeper.begin(flown(), 1)
    keeper.look(flown(), 2)
    keeper.close()
    assert len(said) == 1


def test_other_defects_are_not_hidden():
    with pytest.raises(ValueError, match="a defect"), Unwritten("x", print):
        raise ValueError("a defect")
