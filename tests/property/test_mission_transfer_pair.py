"""The ground station's mission client against the simulator's server, written apart, on a link that loses."""

import asyncio

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gcs.errors import MissionTransferError
from gcs.flight.upload import read, store
from gcs.microservices.mission_comparison import first_difference
from gcs.microservices.mission_messages import FENCE, MISSION
from missions.mission import LinkSettings, load_mission
from missions.mission_items import MissionItem
from tests.simulation import virtual_time
from tests.simulation.whole_system import WholeSystem

INDOOR = load_mission("indoor")


def system_with(link: LinkSettings, seed: int) -> WholeSystem:
    simulation = msgspec.structs.replace(INDOOR.simulation, ground_link=link)
    return WholeSystem(msgspec.structs.replace(INDOOR, simulation=simulation), seed=seed)


def waypoints(n: int, seed: int) -> list[MissionItem]:
    origin = INDOOR.origin
    lat_e7, lon_e7 = round(origin.latitude_deg * 1e7), round(origin.longitude_deg * 1e7)
    return [
        MissionItem(command=16, param2=0.3, x=lat_e7 + 10 * i + seed, y=lon_e7 - 7 * i, z=490.0 + i % 9)
        for i in range(n)
    ]


def vertices(n: int) -> list[MissionItem]:
    return [msgspec.structs.replace(item, command=5001, param1=float(n), param2=0.0) for item in waypoints(n, 0)]


async def transfer(
    system: WholeSystem, items: list[MissionItem], kind: int, wait_s: float = 1.5
) -> list[MissionItem] | None:
    """Store items on vehicle 1; what is really there afterwards, or None if the client gave up."""
    background = [asyncio.create_task(system.simulate()), asyncio.create_task(system.station.send_heartbeats())]
    await asyncio.sleep(wait_s)
    try:
        await store(system.station, 1, items, kind)
        return await read(system.station, 1, kind)
    except MissionTransferError:
        return None
    finally:
        for task in background:
            task.cancel()


@pytest.mark.parametrize(("kind", "items"), [(MISSION, waypoints(12, 0)), (FENCE, vertices(4))])
def test_on_a_good_link_missions_and_fences_are_stored_as_sent(kind: int, items: list[MissionItem]):
    stored = virtual_time.run(transfer(system_with(LinkSettings(), 0), items, kind))
    assert stored is not None
    assert first_difference(items, stored, kind) == ""


@given(
    n=st.integers(1, 12),
    loss=st.floats(0.0, 0.35),
    delay_s=st.sampled_from([0.0, 0.05, 0.25]),
    seed=st.integers(0, 10**6),
)
@settings(max_examples=25)
def test_what_the_client_calls_stored_is_stored_whatever_is_lost(n: int, loss: float, delay_s: float, seed: int):
    system = system_with(LinkSettings(loss=loss, delay_s=delay_s, jitter_s=delay_s / 2), seed)
    items = waypoints(n, seed % 100)
    stored = virtual_time.run(transfer(system, items, MISSION))
    if stored is not None:
        assert first_difference(items, stored) == ""


@pytest.mark.parametrize("seed", range(6))
def test_a_third_lost_and_the_rest_out_of_order_does_not_keep_a_mission_from_being_stored(seed: int):
    system = system_with(LinkSettings(loss=0.33, delay_s=0.1, jitter_s=0.1), seed)
    stored = virtual_time.run(transfer(system, waypoints(10, 0), MISSION))
    assert stored is not None


@pytest.mark.parametrize("seed", range(4))
def test_on_a_slow_link_that_loses_half_and_keeps_no_order_a_mission_takes_minutes_and_not_for_ever(seed: int):
    """Reading back went on for more than 20 minutes in soak seed 7107: one request at a time, in one copy each."""
    system = system_with(LinkSettings(loss=0.5, delay_s=1.0, jitter_s=0.2, reorder=0.1, duplicates=0.1), seed)
    stored = virtual_time.run(transfer(system, waypoints(9, 0), MISSION, wait_s=20.0))
    assert stored is not None
    assert system.simulator.time_s < 300.0


@pytest.mark.parametrize("seed", range(4))
def test_copies_that_the_link_itself_makes_and_delays_do_not_keep_a_mission_from_being_stored(seed: int):
    """Requests in copies on a quick link that doubles some of them, 50 ms later: soak seed 7212 never ended."""
    system = system_with(LinkSettings(loss=0.1, jitter_s=0.02, duplicates=0.1, corruption=0.01), seed)
    stored = virtual_time.run(transfer(system, waypoints(10, 0), MISSION, wait_s=10.0))
    assert stored is not None
    assert system.simulator.time_s < 60.0
