"""After a blackout, and for a ground station that comes anew: who flies which plan, and what was seen meanwhile."""

import msgspec
import numpy as np
import pytest

from gcs.flight import cloud_loop
from gcs.station import Station
from missions.faults import LinkFault, SimulatedLink
from missions.mission import load_mission
from missions.mission_items import plan_id
from missions.world import Cylinder
from sitl.microservices.outbox import Link
from tests.simulation.whole_system import WholeSystem

INDOOR = load_mission("indoor")
PILLAR = Cylinder(name="pillar", centre_m=(12.0, 10.2), radius_m=0.4, top_m=4.0, known=False)
UNMAPPED = msgspec.structs.replace(
    INDOOR, world=msgspec.structs.replace(INDOOR.world, cylinders=(*INDOOR.world.cylinders, PILLAR))
)


def known_on_board(system: WholeSystem) -> set[tuple[int, ...]]:
    """All voxels that the companions would report."""
    reported = [app.observations.voxels for app in system.companions.values()]
    return {tuple(voxel) for voxels in reported for voxel in voxels.tolist()}


def known_on_ground(station: Station) -> set[tuple[int, ...]]:
    return {tuple(voxel) for voxel in station.fleet.observed.voxels.tolist()}


class CutWhenSent(WholeSystem):
    """The ground link is cut for a while as soon as a companion has a second mission."""

    blackout_s: float = 6.0
    first_ids: dict[int, int]
    cut_s: float | None = None
    missions_begun: int = 0

    def _note_modes(self) -> None:
        super()._note_modes()
        for sysid, app in self.companions.items():
            briefing = app.pilot.briefing
            if app.pilot.in_control and self.cut_s is None:
                first = self.first_ids.setdefault(sysid, briefing.plan_id)
                if briefing.plan_id != first:
                    self.cut_s = self.simulator.time_s
                    self.simulator.order(LinkFault(link=SimulatedLink.GROUND, blackout_s=self.blackout_s))


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """A ground station that gives a swap up before the blackout is over."""
    monkeypatch.setattr(cloud_loop, "HAND_OVER_TIMEOUT_S", 2.0)
    monkeypatch.setattr(cloud_loop, "SWAP_TIMEOUT_S", 1.0)


@pytest.mark.usefixtures("impatient")
def test_a_plan_that_could_not_be_confirmed_is_taken_for_what_it_is_and_not_sent_again():
    system = CutWhenSent(UNMAPPED)
    system.first_ids = {}
    report = system.fly()
    assert report.success, report.reason
    assert system.cut_s is not None
    happened = [event.kind for event in system.events.events]
    assert "swap failed" in happened
    assert "reconciled" in happened
    sent = [event.data["plan_id"] for event in system.events.events if event.kind in {"swapped", "reconciled"}]
    assert len(sent) == len(set(sent))
    for sysid, vehicle in system.flight.vehicles.items():
        status = system.station.vehicle(sysid).companion.status
        assert status is not None
        assert status.plan_id == plan_id(vehicle.items) == system.companions[sysid].pilot.briefing.plan_id


def test_what_was_seen_during_a_blackout_is_known_on_the_ground_soon_after_it():
    system = WholeSystem(UNMAPPED, seed=3)
    system.simulator.order(LinkFault(link=SimulatedLink.GROUND, blackout_s=8.0, at_s=10.0))
    report = system.fly()
    assert report.success, report.reason
    assert len(known_on_board(system)) > 50
    assert known_on_ground(system.station) == known_on_board(system)


class SecondStation(WholeSystem):
    """In mid flight another ground station begins to listen; it knows nothing of what was."""

    listens_from_s: float = 17.0
    second: Station

    async def simulate(self) -> None:
        self.second = Station(unix_us=lambda: 0)
        transmissions = self.simulator.transmissions

        def overheard():
            for sysid, link, frame in transmissions():
                if link is Link.GROUND and self.simulator.time_s >= self.listens_from_s:
                    self.second.receive(self.wire, frame, ("simulator", sysid))
                yield sysid, link, frame

        self.simulator.transmissions = overheard  # type: ignore[method-assign]
        await super().simulate()


def test_a_ground_station_that_comes_anew_learns_what_was_seen_and_what_is_flown():
    system = SecondStation(UNMAPPED)
    report = system.fly()
    assert report.success, report.reason
    assert known_on_ground(system.second) == known_on_ground(system.station) == known_on_board(system)
    np.testing.assert_array_less(50, len(known_on_board(system)))
    for sysid, vehicle in system.flight.vehicles.items():
        status = system.second.vehicle(sysid).companion.status
        assert status is not None
        assert status.plan_id == plan_id(vehicle.items)
