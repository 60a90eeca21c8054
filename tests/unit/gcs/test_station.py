"""The station between its connections and its microservices."""

import asyncio

from gcs.dialect import mavlink
from gcs.flight import actions
from gcs.microservices.command_client import CommandClient
from gcs.station import Station
from tests.simulation import virtual_time
from tests.unit.gcs import messages as mav

SIMULATOR = ("127.0.0.1", 14580)


class Wire:
    """A connection that keeps what is sent."""

    peer = None
    budget_bytes_s = None

    def __init__(self) -> None:
        self.sent: list[bytes] = []

    def send(self, datagram: bytes, address: tuple[str, int]) -> None:
        self.sent.append(datagram)


def acknowledgement(target: tuple[int, int]) -> bytes:
    ack = mavlink.MAVLink_command_ack_message(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 0, 0, *target)
    return mav.frame_of(1, 1, ack)


async def arm_answered_for(target: tuple[int, int]) -> bool:
    """Whether an acknowledgement for somebody ends our own arming."""
    station, wire = Station(unix_us=lambda: 0), Wire()
    arming = asyncio.create_task(station.run(CommandClient(actions.arm(), (1, 1))))
    await asyncio.sleep(0.01)
    station.receive(wire, acknowledgement(target), SIMULATOR)
    await asyncio.sleep(0.01)
    done = arming.done()
    arming.cancel()
    return done


def test_an_answer_to_somebody_else_answers_nothing_of_ours():
    for target, ours in [((255, 190), True), ((0, 0), True), ((1, 191), False), ((255, 1), False), ((254, 190), False)]:
        assert virtual_time.run(arm_answered_for(target)) is ours
