"""The ground link is gone for long, or the ground station itself: vehicles go on, and nothing is sent twice after."""

import asyncio
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest

from companion.report_budget import LEAST_SHARE
from gcs.flight.events import EventLog
from gcs.flight.journal import JOURNAL_FILE, JournalKeeper, read_story
from gcs.flight.rejoining import rejoin, told_flight
from gcs.flight.report import min_clearance_m
from gcs.flight.sequence import FleetFlight
from gcs.security.audit import Audit
from gcs.station import Station
from missions.faults import LinkFault, SimulatedLink
from missions.mission import load_mission
from missions.mission_items import plan_id
from missions.world import Cylinder
from tests.simulation.whole_system import GroundWire, WholeSystem

INDOOR = load_mission("indoor")
PILLAR = Cylinder(name="pillar", centre_m=(12.0, 10.2), radius_m=0.4, top_m=4.0, known=False)
UNMAPPED = msgspec.structs.replace(
    INDOOR, world=msgspec.structs.replace(INDOOR.world, cylinders=(*INDOOR.world.cylinders, PILLAR))
)
SEVERAL = {"PARAM_SET", "MAV_CMD_SET_MESSAGE_INTERVAL"}
"""Orders with several things to set."""
LISTENS_S = 8.0
CUT_AT_S = 9.0
"""After the first take-off."""
REST_OF_THE_FLIGHT_S = INDOOR.limits.endurance_s + 100.0


async def fly_and_listen(flight: FleetFlight) -> None:
    """The whole flight, and a turn of the companions' repetitions after it."""
    await flight.fly()
    await asyncio.sleep(LISTENS_S)


class Audited(WholeSystem):
    """What the ground station orders is noted, and how large the budgets of the companions' reports are."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.operate = fly_and_listen
        self.orders: list[dict[str, Any]] = []
        self.budgets_bytes_s: list[tuple[float, float]] = []
        self.station.audit = Audit(self._note, lambda: 0)

    def _note(self, line: bytes) -> None:
        entry = msgspec.json.decode(line)
        if entry["type"] == "order":
            self.orders.append(entry)

    def _note_modes(self) -> None:
        super()._note_modes()
        for app in self.companions.values():
            self.budgets_bytes_s.append((self.simulator.time_s, app.budget.bytes_s(self.simulator.time_s)))

    def least_budget_bytes_s(self, from_s: float, to_s: float) -> float:
        return min(bytes_s for time_s, bytes_s in self.budgets_bytes_s if from_s <= time_s <= to_s)


def sent(system: Audited) -> Counter[tuple[int, str]]:
    """How often each vehicle was given each order, repetitions of one that was not answered not counted."""
    return Counter((entry["vehicle"], entry["order"]) for entry in system.orders)


def assert_flown_and_seen(system: WholeSystem) -> None:
    """Every vehicle kept clear of everything; the ground knows what it flew and saw."""
    assert not system.simulator.collisions
    for sysid, flown in system.flown().items():
        assert min_clearance_m(UNMAPPED, flown.in_flight()) > 0.3
        status = system.station.vehicle(sysid).companion.status
        assert status is not None
        assert status.plan_id == system.companions[sysid].pilot.briefing.plan_id
    on_board = {tuple(v) for app in system.companions.values() for v in app.observations.voxels.tolist()}
    assert len(on_board) > 50
    assert {tuple(v) for v in system.station.fleet.observed.voxels.tolist()} == on_board


@pytest.mark.parametrize(
    "blackout_s", [10.0, *(pytest.param(s, marks=pytest.mark.slow) for s in (60.0, REST_OF_THE_FLIGHT_S))]
)
def test_vehicles_fly_on_through_a_blackout_and_nothing_is_sent_twice(blackout_s: float):
    system = Audited(UNMAPPED, seed=1)
    system.simulator.order(LinkFault(link=SimulatedLink.GROUND, blackout_s=blackout_s, at_s=CUT_AT_S))
    report = system.fly()
    assert report.success, report.reason
    assert_flown_and_seen(system)
    for sysid, vehicle in system.flight.vehicles.items():
        assert plan_id(vehicle.items) == system.companions[sysid].pilot.briefing.plan_id
    swaps = Counter(event.vehicle for event in system.events.events if event.kind in {"swapped", "swap failed"})
    for (sysid, order), times in sent(system).items():
        name = UNMAPPED.vehicle(sysid).name
        if order in {"upload of a mission", "MISSION_SET_CURRENT"}:
            assert times <= 1 + swaps[name]
        elif order not in SEVERAL:
            assert times == 1, (name, order)


def test_reports_shrink_in_a_blackout_and_grow_back_after_it():
    system = Audited(UNMAPPED, seed=1)
    system.simulator.order(LinkFault(link=SimulatedLink.GROUND, blackout_s=8.0, at_s=CUT_AT_S))
    system.fly()
    full_bytes_s = system.companions[1].settings.report_bytes_s
    begun_s = next(time_s for time_s, sizes, _ in system.truth if sizes[:, 2].max() > 0.1) + CUT_AT_S
    assert system.least_budget_bytes_s(0.0, begun_s) == full_bytes_s
    assert system.least_budget_bytes_s(begun_s, begun_s + 9.0) == pytest.approx(LEAST_SHARE * full_bytes_s)
    assert system.budgets_bytes_s[-1][1] >= 0.5 * full_bytes_s


class Connection(GroundWire):
    """A connection that ends with its program."""

    open = True

    def send(self, datagram: bytes, address: tuple[str, int]) -> None:
        if self.open:
            super().send(datagram, address)


class Crashing(Audited):
    """The ground station dies in flight; another one takes its place 5 s later, and has nothing but the journal."""

    journal: Path
    is_time: Callable[["Crashing"], bool]
    """To die; asked every 50 ms."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.connection = self.wire = Connection(self.simulator)
        self.station.connections[:] = [self.connection]
        self.operate = self._die_and_come_again
        self.orders_before = 0

    async def _die_and_come_again(self, flight: FleetFlight) -> None:
        keeper = JournalKeeper(self.journal)
        keeper.begin(flight, 0)
        flying = asyncio.create_task(flight.fly())
        while not self.is_time(self):
            await asyncio.sleep(0.05)
            keeper.look(flight, 0)
        self.connection.open = False
        flying.cancel()
        await asyncio.gather(flying, return_exceptions=True)
        keeper.close()
        self.orders_before = len(self.orders)
        self.station, self.wire = Station(unix_us=lambda: 0), Connection(self.simulator)
        await asyncio.sleep(5.0)
        await self._take_over()

    async def _take_over(self) -> None:
        self.station.audit = Audit(self._note, lambda: 0)
        self.station.connections.append(self.wire)
        self.events = EventLog(asyncio.get_running_loop().time)
        story = read_story(self.journal)
        assert story is not None
        self.flight = told_flight(story, self.station, self.events)
        heartbeats = asyncio.create_task(self.station.send_heartbeats())
        await rejoin(self.flight, self.events, self.flight.watch)
        await asyncio.sleep(LISTENS_S)
        heartbeats.cancel()


def in_mid_flight(system: Crashing) -> bool:
    return system.simulator.time_s > 16.0


def while_a_new_plan_is_handed_over(system: Crashing) -> bool:
    """It is being sent, and nobody has said yet that it is flown."""
    kinds = [event.kind for event in system.events.events]
    return "replanned" in kinds and sum(entry["order"] == "upload of a mission" for entry in system.orders) > 2


@pytest.mark.parametrize("is_time", [in_mid_flight, while_a_new_plan_is_handed_over])
def test_a_ground_station_that_crashes_in_the_loop_finds_back_and_orders_nothing(
    is_time: Callable[[Crashing], bool], tmp_path: Path
):
    system = Crashing(UNMAPPED)
    system.journal, system.is_time = tmp_path / JOURNAL_FILE, is_time
    report = system.fly()
    assert report.success, report.reason
    assert_flown_and_seen(system)
    assert len(system.orders) == system.orders_before > 0
