"""The air between companions: who hears what, and what a fault makes of it."""

import pytest

from missions.faults import LinkConditions, LinkFault, SimulatedLink, decode_simulator_fault, parse_simulator_fault
from missions.mission import LinkSettings
from sitl.fleet import TICK_S
from sitl.link.radio import FleetRadio
from sitl.simulator import Simulator
from tests.unit.sitl.flown import field


def radio(n: int = 3, **conditions: float) -> FleetRadio:
    return FleetRadio(LinkSettings(**conditions), range(1, n + 1), seed=5)


def spoken(air: FleetRadio, count: int = 400, until_s: float = 8.0) -> dict[tuple[int, bytes], list[float]]:
    """Vehicle 1 says numbers every tick; when (who, number) was heard."""
    heard: dict[tuple[int, bytes], list[float]] = {}
    for tick in range(int(until_s / TICK_S) + 1):
        now_s = tick * TICK_S
        if tick < count:
            air.send(1, str(tick).encode(), now_s, None)
        for sysid, datagram in air.arrived(now_s):
            heard.setdefault((sysid, datagram), []).append(now_s)
    return heard


def test_what_one_says_all_others_hear_at_once_and_nobody_else():
    air = radio()
    air.send(2, b"here", 0.0, None)
    assert air.arrived(0.0) == [(1, b"here"), (3, b"here")]
    assert air.arrived(0.0) == []
    air.send(9, b"a stranger", 0.0, None)
    assert air.arrived(0.0) == []


def test_losses_to_one_and_to_another_are_independent():
    heard = spoken(radio(loss=0.2))
    to_two, to_three = ({int(text) for sysid, text in heard if sysid == who} for who in (2, 3))
    assert 0.7 < len(to_two) / 400 < 0.9
    assert 0.7 < len(to_three) / 400 < 0.9
    assert 0.5 < len(to_two & to_three) / 400 < 0.75


def test_delays_jitter_and_duplicates_come_once_for_each_way():
    heard = spoken(radio(delay_s=0.3, jitter_s=0.1, duplicates=0.5))
    late_s = [times[0] - int(text) * TICK_S for (_, text), times in heard.items()]
    assert min(late_s) >= 0.3
    assert max(late_s) <= 0.4 + TICK_S
    assert 300 < sum(len(times) == 2 for times in heard.values()) < 500


def test_between_two_radios_the_worse_counts():
    air = radio()
    air.change(1, LinkConditions(delay_s=0.1, bandwidth_bytes_s=5000.0), 0.0)
    air.change(2, LinkConditions(delay_s=0.3, bandwidth_bytes_s=9000.0), 0.0)
    air.send(1, b"x", 0.0, None)
    assert air.arrived(0.28) == [(3, b"x")]
    assert air.arrived(0.32) == [(2, b"x")]


@pytest.mark.parametrize("silent", [1, 2])
def test_a_vehicle_whose_radio_is_dead_neither_hears_nor_is_heard(silent: int):
    air = radio()
    air.change(silent, LinkConditions(), black_until_s=2.0)
    air.send(1, b"x", 1.0, None)
    air.send(2, b"y", 1.0, None)
    passed = air.arrived(1.0)
    assert not [one for one in passed if one[0] == silent or one[1] == (b"x" if silent == 1 else b"y")]
    air.send(1, b"z", 2.1, None)
    assert air.arrived(2.1) == [(2, b"z"), (3, b"z")]


def test_one_seed_loses_the_same_datagrams():
    assert spoken(radio(loss=0.3, jitter_s=0.2)) == spoken(radio(loss=0.3, jitter_s=0.2))


@pytest.mark.parametrize(
    "fault",
    [
        LinkFault(link=SimulatedLink.FLEET, vehicle=2, loss=1.0),
        parse_simulator_fault("link:link=fleet,vehicle=2,loss=1"),
        decode_simulator_fault(b'{"type": "link", "link": "fleet", "vehicle": 2, "loss": 1}'),
    ],
)
def test_a_fault_at_run_time_is_of_one_vehicles_radio(fault: LinkFault):
    simulator = Simulator(3, seed=1)
    simulator.order(fault)
    simulator.receive_radio(1, b"x")
    assert simulator.radio_datagrams() == [(3, b"x")]


def test_a_mission_file_can_make_the_air_bad():
    simulator = Simulator(field(2, fleet_link=LinkSettings(delay_s=0.1)), seed=1)
    simulator.receive_radio(1, b"x")
    simulator.step()
    assert simulator.radio_datagrams() == []
    for _ in range(5):
        simulator.step()
    assert simulator.radio_datagrams() == [(2, b"x")]
