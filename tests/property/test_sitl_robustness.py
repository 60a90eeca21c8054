"""Whatever comes in over the links, a vehicle answers or drops it, and goes on flying."""

import math
import struct

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.dialect import mavlink
from sitl.microservices.outbox import Link
from sitl.simulator import Simulator
from tests.unit.sitl.flown import Flown, field, waypoint

UNDERSTOOD = (
    "COMMAND_LONG",
    "COMMAND_INT",
    "SET_MODE",
    "SET_POSITION_TARGET_LOCAL_NED",
    "SET_POSITION_TARGET_GLOBAL_INT",
    "SET_ATTITUDE_TARGET",
    "MANUAL_CONTROL",
    "PARAM_REQUEST_LIST",
    "PARAM_REQUEST_READ",
    "PARAM_SET",
    "MISSION_COUNT",
    "MISSION_ITEM_INT",
    "MISSION_ITEM",
    "MISSION_REQUEST_LIST",
    "MISSION_REQUEST_INT",
    "MISSION_REQUEST",
    "MISSION_ACK",
    "MISSION_CLEAR_ALL",
    "MISSION_SET_CURRENT",
    "HEARTBEAT",
    "TIMESYNC",
    "PING",
)
KINDS = {kind.msgname: kind for kind in mavlink.mavlink_map.values()}
COMMANDS = (16, 20, 21, 22, 34, 176, 178, 179, 185, 187, 192, 195, 197, 246, 262, 300, 400, 410, 510, 511, 512, 520)
FLOATS = st.one_of(st.floats(width=32), st.sampled_from([0.0, 1.0, -1.0, 47.4, 8.5, 490.0, math.nan, math.inf, 1e38]))


def simulator() -> Simulator:
    """A vehicle that hovers in Offboard with a mission in store."""
    flown = Flown(field()).take_off(3.0)
    flown.upload([waypoint(5.0, 0.0, 3.0), waypoint(5.0, 5.0, 3.0)])
    return flown.stream(position=(0.0, 0.0, -3.0)).offboard().simulator


class Victim:
    """A simulator to be maltreated; a new one when the old one does not fly any more."""

    def __init__(self) -> None:
        self._simulator = simulator()

    @property
    def flying(self) -> Simulator:
        if not self._simulator.vehicles[1].autopilot.armed or self._simulator.truth.position_enu_m[0, 2] < 0.5:
            self._simulator = simulator()
        return self._simulator


VICTIM = Victim()


def is_sound(flown: Simulator) -> bool:
    """All numbers of the truth and of every record that control reads are numbers, or NaN where that means free."""
    fleet = flown._fleet.vehicles
    tracked = ("position_m", "velocity_m_s", "attitude", "rates_rad_s", "rotor", "motor", "smooth_position_m")
    return all(np.isfinite(fleet[name]).all() for name in tracked)


def go_on(flown: Simulator, ticks: int = 3) -> None:
    for _ in range(ticks):
        flown.step()
        flown.transmissions()
    assert is_sound(flown)


@given(datagram=st.binary(max_size=300), link=st.sampled_from(Link))
@settings(max_examples=150)
def test_bytes_of_any_kind(datagram, link):
    flown = VICTIM.flying
    flown.receive(1, link, datagram)
    go_on(flown)


@st.composite
def messages(draw):
    """A well-formed message that the vehicle understands, with any content."""
    kind = KINDS[draw(st.sampled_from(UNDERSTOOD))]
    payload = draw(st.binary(min_size=kind.unpacker.size, max_size=kind.unpacker.size))
    values = list(kind.unpacker.unpack(payload))
    codes = kind.unpacker.format.lstrip("<")
    if kind.array_lengths and not any(kind.array_lengths):
        values = [draw(FLOATS) if code == "f" else value for code, value in zip(codes, values, strict=True)]
    names = dict(zip(kind.ordered_fieldnames, range(len(kind.ordered_fieldnames)), strict=True))
    if not any(kind.array_lengths):
        for name, value in (("target_system", 1), ("target_component", 1), ("target", 1)):
            if name in names:
                values[names[name]] = value
        if "command" in names and kind.msgname != "MISSION_ITEM_INT":
            values[names["command"]] = draw(st.sampled_from(COMMANDS))
    return kind, kind.unpacker.pack(*values)


def framed(kind, payload: bytes) -> bytes:
    header = struct.pack("<BBBBBBBHB", 0xFD, len(payload), 0, 0, 0, 255, 190, kind.id & 0xFFFF, kind.id >> 16)
    crc = mavlink.x25crc(header[1:] + payload)
    crc.accumulate(bytes([kind.crc_extra]))
    return header + payload + struct.pack("<H", crc.crc)


@given(sent=st.lists(st.tuples(messages(), st.sampled_from(Link)), min_size=1, max_size=12))
@settings(max_examples=150)
def test_well_formed_messages_with_any_content(sent):
    flown = VICTIM.flying
    dropped = flown.vehicles[1].dropped
    for (kind, payload), link in sent:
        flown.receive(1, link, framed(kind, payload))
        go_on(flown, 1)
    go_on(flown)
    assert flown.vehicles[1].dropped == dropped  # they were all read


@given(data=st.data())
@settings(max_examples=40)
def test_any_parameters(data):
    flown = VICTIM.flying
    parameters = flown.vehicles[1].autopilot.parameters
    for name in data.draw(st.lists(st.sampled_from(parameters.names), min_size=1, max_size=8)):
        if parameters.is_int(name):
            parameters.set(name, data.draw(st.integers(-(2**31), 2**31 - 1)))
        else:
            parameters.set(name, data.draw(st.floats(width=32, allow_nan=False, allow_infinity=False)))
    go_on(flown, 20)


@given(
    numbers=st.lists(FLOATS, min_size=11, max_size=11),
    mask=st.integers(0, 0xFFFF),
    frame=st.sampled_from([1, 8, 0, 7]),
)
@settings(max_examples=150)
def test_any_setpoint(numbers, mask, frame):
    values = (0, *numbers[:9], *numbers[9:], mask, 1, 1, frame)
    kind = KINDS["SET_POSITION_TARGET_LOCAL_NED"]
    flown = VICTIM.flying
    flown.receive(1, Link.ONBOARD, framed(kind, kind.unpacker.pack(*values)))
    go_on(flown, 5)
