"""Whole flights of fleets that no cloud plan keeps apart: companions that talk to each other, in process."""

import msgspec
import pytest

from gcs.settings import PlanningMode
from missions.faults import LinkFault, SimulatedLink
from missions.mission import LinkSettings, Mission, Target, Vehicle, load_mission
from missions.world import World
from tests.simulation.whole_system import WholeSystem

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


def test_a_companion_without_a_radio_flies_on_and_is_kept_clear_of_as_it_was_last_heard():
    system = WholeSystem(INDOOR, seed=1)
    system.simulator.order(LinkFault(link=SimulatedLink.FLEET, vehicle=2, blackout_s=600.0, at_s=6.0))
    report = system.fly()
    assert report.success, report.reason
    assert not system.simulator.collisions
    desks = {sysid: app.fleet for sysid, app in system.companions.items()}
    assert all(desk is not None and 3 - sysid in desk.exchange.roster.known for sysid, desk in desks.items())


@pytest.mark.slow
def test_ten_drones_cross_the_room_to_permuted_targets():
    system = WholeSystem(load_mission("fleet-10"))
    report = system.fly()
    assert report.success, report.reason
    assert report.min_separation_m is not None
    assert report.min_separation_m >= 0.6
    assert not system.simulator.collisions
