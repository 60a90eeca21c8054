"""Whatever comes in on the links or the control port: nothing breaks, nothing grows, nothing is obeyed by accident."""

import math
import random
import struct
from typing import Any

import pytest

from sitl.dialect import mavlink
from sitl.link.control_port import MOST_LINES, obey
from sitl.microservices.command_server import MOST_REMEMBERED
from sitl.microservices.outbox import Link
from sitl.microservices.router import MOST_HEARD
from sitl.simulator import Simulator
from tests.unit.sitl.flown import Flown

KEY = bytes(range(32))
ODD_NUMBERS = (0.0, 1.0, -1.0, math.nan, math.inf, -math.inf, 1e30, -1e30, 3.4e38, 1e-45)
LARGEST_DATAGRAM = 65_507
LIMITS = {"uint8_t": (0, 255), "int8_t": (-128, 127), "uint16_t": (0, 65_535), "int16_t": (-32_768, 32_767)}
LIMITS |= {"uint32_t": (0, 2**32 - 1), "int32_t": (-(2**31), 2**31 - 1)}
LIMITS |= {"uint64_t": (0, 2**64 - 1), "int64_t": (-(2**63), 2**63 - 1)}


def any_value(kind: str, rng: random.Random) -> float | int:
    if kind in ("float", "double"):
        return rng.choice((*ODD_NUMBERS, rng.uniform(-500.0, 500.0)))
    low, high = LIMITS[kind]
    return rng.choice((low, high, 0, 1, rng.randint(low, high)))


def any_message(message_class: Any, rng: random.Random) -> Any:
    """A well-formed message with any numbers in it, half of the time for vehicle 1."""
    values: list[Any] = []
    for name, kind in zip(message_class.fieldnames, message_class.fieldtypes, strict=True):
        length = message_class.array_lengths[message_class.ordered_fieldnames.index(name)]
        if kind == "char":
            values.append(bytes(rng.randrange(256) for _ in range(max(length, 1))))
        elif length:
            values.append([any_value(kind, rng) for _ in range(length)])
        elif name in ("target_system", "target_component") and rng.random() < 0.5:
            values.append(1)
        else:
            values.append(any_value(kind, rng))
    return message_class(*values)


def state_of(flown: Flown) -> tuple:
    autopilot = flown.autopilot
    plans = autopilot.navigator.mission.plan, autopilot.fence.plan, autopilot.rally
    parameters = tuple(autopilot.parameters.stored(name) for name in autopilot.parameters.names)
    return autopilot.armed, autopilot.mode, plans, parameters


@pytest.mark.parametrize("link", Link)
def test_noise_changes_nothing(link):
    flown, rng = Flown().boot(), random.Random(1)
    before = state_of(flown)
    for size in (*range(64), 280, 281, 2000, LARGEST_DATAGRAM):
        flown.simulator.receive(1, link, rng.randbytes(size))
        flown.simulator.receive(1, link, b"\xfd" * size)
        flown.simulator.receive(1, link, b"\xfe" * size)
    assert state_of(flown.run(0.1)) == before


@pytest.mark.parametrize("link", Link)
def test_frames_that_are_cut_off_or_spoilt_change_nothing(link):
    flown, rng = Flown().boot(), random.Random(2)
    before = state_of(flown)
    frame = mavlink.MAVLink_command_long_message(1, 1, 400, 0, 1, 21196, 0, 0, 0, 0, 0).pack(mavlink.MAVLink(None))
    for end in range(len(frame)):
        flown.simulator.receive(1, link, bytes(frame[:end]))
    for _ in range(300):
        spoilt = bytearray(frame)
        spoilt[rng.randrange(1, len(frame))] ^= 1 << rng.randrange(8)
        flown.simulator.receive(1, link, bytes(spoilt))
    assert state_of(flown.run(0.1)) == before
    assert flown.simulator.vehicles[1].dropped > 300
    flown.simulator.receive(1, link, bytes(frame))
    assert flown.run(0.1).armed, "what is whole is obeyed"


@pytest.mark.parametrize("link", Link)
def test_every_message_may_hold_any_number(link):
    flown, rng = Flown().take_off(5.0), random.Random(3)
    for message_class in mavlink.mavlink_map.values():
        for _ in range(4):
            try:
                message = any_message(message_class, rng)
                flown.send(message, link=link, source=(rng.randrange(256), rng.randrange(256)))
            except (struct.error, TypeError, UnicodeDecodeError):  # not even pymavlink can write it
                continue
        flown.run(0.02)
    flown.run(2.0)
    assert all(math.isfinite(number) for number in flown.simulator.truth.position_enu_m[0])


@pytest.mark.parametrize("link", Link)
def test_a_crowd_of_senders_and_commands_is_not_remembered(link):
    flown = Flown().boot()
    vehicle = flown.simulator.vehicles[1]
    for n in range(2000):
        message = mavlink.MAVLink_command_long_message(1, 1, n, 0, *[0.0] * 7)
        vehicle.receive(link, bytes(message.pack(mavlink.MAVLink(None, 2 + n % 250, n // 250))))
    vehicle.take()
    assert len(vehicle._router._heard[link]) <= MOST_HEARD
    assert len(vehicle._commands._last) <= MOST_REMEMBERED


def test_who_speaks_goes_on_to_be_heard_in_a_crowd():
    flown = Flown().boot()
    tunnel = mavlink.MAVLink_tunnel_message(1, 191, 0x8051, 1, [0] * 128)
    for n in range(2000):
        stranger = (2 + n % 250, 1 + n // 250)
        flown.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), link=Link.ONBOARD, source=stranger)
        if n % 100 == 0:
            flown.send(mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3), link=Link.ONBOARD)
    flown.send(tunnel)
    assert flown.messages("TUNNEL", link=Link.ONBOARD)


@pytest.mark.parametrize(
    "line",
    [
        b"",
        b"\n\n\n",
        b"null",
        b"[]",
        b"{}",
        b"[" * 60_000,
        b'{"type":' * 6000,
        b'{"type": "link", "vehicle": 1e999}',
        b'{"type": "link", "vehicle": 1, "loss": NaN}',
        b'{"type": "link", "vehicle": 1, "delay_s": -1}',
        b'{"type": "reboot", "vehicle": 99999999999999999999999}',
        b'{"type": "motor-failure", "vehicle": 1, "motor": 0}',
        b'{"type": "gps-loss", "vehicle": 1, "more": 1}',
        b"\xff\xfe\x00",
        b'{"type": "' + b"x" * 60_000 + b'"}',
    ],
)
def test_the_control_port_obeys_nothing_that_is_no_fault(line):
    simulator = Simulator(1, seed=1)
    for answer in obey(simulator, line).splitlines():
        assert b'"ok":false' in answer
    simulator.step()


def test_one_datagram_orders_a_hundred_faults_at_most():
    simulator = Simulator(1, seed=1)
    assert len(obey(simulator, b"x\n" * 30_000).splitlines()) == MOST_LINES


def test_a_signed_link_obeys_no_forger():
    flown = Flown().boot()
    flown.send(mavlink.MAVLink_setup_signing_message(1, 1, KEY, 0))
    arm = mavlink.MAVLink_command_long_message(1, 1, 400, 0, 1, 21196, 0, 0, 0, 0, 0)
    signer = mavlink.MAVLink(None, 255, 190)
    signer.signing.secret_key, signer.signing.sign_outgoing = bytes(32), True
    for timestamp in (0, 1, 2**47, 2**48 - 1):
        for link_id in range(64):
            signer.signing.timestamp, signer.signing.link_id = timestamp, link_id
            flown.simulator.receive(1, Link.GROUND, bytes(arm.pack(signer)))
    flown.simulator.receive(1, Link.GROUND, bytes(arm.pack(mavlink.MAVLink(None, 255, 190), force_mavlink1=True)))
    assert not flown.run(0.1).armed
    memory = flown.simulator.memories[1].signing
    assert (memory.key, memory.streams) == (KEY, {}), "nothing of a forged frame is remembered"
