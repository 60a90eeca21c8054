"""Whole flights of fleets that no cloud plan keeps apart: companions that talk to each other, in process."""

import itertools

import msgspec
import numpy as np
import numpy.typing as npt
import pytest

from companion.fleet.reports import PositionReport
from companion.link.fleet_frames import FleetFrames
from gcs.settings import PlanningMode
from missions.faults import LinkFault, SimulatedLink
from missions.mission import LinkSettings, Mission, Target, Vehicle, load_mission
from missions.world import World
from tests.simulation.whole_system import WholeSystem

Array = npt.NDArray[np.float64]

INDOOR = load_mission("indoor")


def head_on(**fleet_link: float) -> Mission:
    """Two drones at the ends of an empty room, each with the other's place as its target."""
    places = {"alpha": (2.0, 7.5), "bravo": (16.0, 7.5)}
    (alpha, west), (bravo, east) = places.items()
    simulation = msgspec.structs.replace(INDOOR.simulation, fleet_link=LinkSettings(**fleet_link))
    return msgspec.structs.replace(
        INDOOR,
        world=World(bounds=INDOOR.world.bounds),
        vehicles=tuple(
            Vehicle(name=name, sysid=sysid, pad_m=(*place, 0.0))
            for sysid, (name, place) in enumerate(places.items(), start=1)
        ),
        targets=(
            Target(name="west", position_m=(*west, 1.5)),
            Target(name="east", position_m=(*east, 1.5)),
        ),
        allocation={alpha: "east", bravo: "west"},
        simulation=simulation,
    )


@pytest.mark.parametrize("fleet_link", [{}, {"delay_s": 0.3, "loss": 0.2}], ids=["ideal", "bad"])
def test_two_drones_head_on_pass_each_other_by_what_they_say_alone(fleet_link: dict[str, float]):
    mission = head_on(**fleet_link)
    system = WholeSystem(mission, PlanningMode.ONBOARD)
    report = system.fly()
    assert report.success, report.reason
    assert report.min_separation_m is not None
    assert report.min_separation_m >= 0.6
    assert not system.simulator.collisions


@pytest.mark.slow
def test_a_companion_without_a_radio_flies_on_and_is_kept_clear_of_as_it_was_last_heard():
    system = WholeSystem(INDOOR, seed=1)
    system.simulator.order(LinkFault(link=SimulatedLink.FLEET, vehicle=2, blackout_s=600.0, at_s=6.0))
    report = system.fly()
    assert report.success, report.reason
    assert not system.simulator.collisions
    desks = {sysid: app.fleet for sysid, app in system.companions.items()}
    assert all(desk is not None and 3 - sysid in desk.exchange.roster.known for sysid, desk in desks.items())


def beside_a_stranger(system: WholeSystem, place_m: Array) -> None:
    """A vehicle without plans hovers at a (3,) place and says so four times a second; nobody's sensor sees it."""
    report = PositionReport(77, None, place_m, np.zeros(3), error_m=0.1, on_ground=False)
    datagram = FleetFrames(77, system.mission.frame).pack(report)
    assert datagram is not None
    heard, radio = itertools.count(), system.simulator.radio_datagrams

    def with_the_stranger() -> list[tuple[int, bytes]]:
        said = [(sysid, datagram) for sysid in system.radio_inboxes] if next(heard) % 12 == 0 else []
        return radio() + said

    system.simulator.radio_datagrams = with_the_stranger  # type: ignore[method-assign]


def test_a_vehicle_that_says_only_where_it_is_is_flown_around():
    place_m = np.array([9.0, 7.5, 1.5])
    system = WholeSystem(head_on(), PlanningMode.ONBOARD, seed=2)
    beside_a_stranger(system, place_m)
    report = system.fly()
    assert report.success, report.reason
    for flown in system.flown().values():
        off_m = np.linalg.norm(flown.in_flight().positions_m - place_m, axis=1)
        assert 0.9 < off_m.min() < 3.0


@pytest.mark.slow
def test_ten_drones_cross_the_room_to_permuted_targets():
    system = WholeSystem(load_mission("fleet-10"))
    report = system.fly()
    assert report.success, report.reason
    assert report.min_separation_m is not None
    assert report.min_separation_m >= 0.6
    assert not system.simulator.collisions
