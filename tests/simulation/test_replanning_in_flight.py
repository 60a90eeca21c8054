"""The cloud plans anew while the fleet flies, and missions are swapped without a pause."""

import msgspec
import numpy as np
import pytest

from gcs.flight.report import min_clearance_m
from gcs.mapping.observed_map import ObservedMap
from gcs.planner import plan_mission
from gcs.settings import PlanningMode
from missions import obstacles
from missions.mission import Mission, load_mission
from missions.occupancy import OccupancyBlock, blocks_of, voxels_of
from missions.world import Cylinder, World
from tests.experiments.modes.scenarios import Difference, Link, scenario
from tests.simulation.whole_system import WholeSystem

INDOOR = load_mission("indoor")
PILLAR = Cylinder(name="pillar", centre_m=(10.0, 4.5), radius_m=0.4, top_m=4.0, known=False)


def seen(observed: ObservedMap, pillar: Cylinder) -> None:
    """What a companion reports of a pillar."""
    angle, up = (grid.ravel() for grid in np.meshgrid(np.linspace(0, 2 * np.pi, 60), np.arange(0.1, pillar.top_m, 0.1)))
    east, north = pillar.centre_m
    points_m = np.column_stack((east + pillar.radius_m * np.cos(angle), north + pillar.radius_m * np.sin(angle), up))
    for index, occupied in blocks_of(voxels_of(points_m, 0.2)).items():
        observed.fold(2, OccupancyBlock(index, 0.2, 1, occupied))


class Rehearsal(WholeSystem):
    """One vehicle has seen a pillar in the other's way when the flight is so old."""

    pillar: Cylinder = PILLAR
    seen_at_s: float = 9.0

    def _note_modes(self) -> None:
        super()._note_modes()
        observed = self.station.fleet.observed
        if self.simulator.time_s >= self.seen_at_s and not observed.changes:
            seen(observed, self.pillar)


def in_the_way_of(sysid: int, share: float) -> Cylinder:
    """A pillar on the curve of a vehicle, at a share of it."""
    probe = WholeSystem(INDOOR)
    report = probe.fly()
    assert report.success, report.reason
    assert probe.flight.plan is not None
    curve_m = next(part.curve_m for part in probe.flight.plan.vehicles if part.sysid == sysid)
    place_m = curve_m[int(share * len(curve_m))]
    return Cylinder(
        name="pillar", centre_m=(float(place_m[0]), float(place_m[1])), radius_m=0.4, top_m=4.0, known=False
    )


def with_pillar(mission: Mission, pillar: Cylinder) -> Mission:
    return msgspec.structs.replace(
        mission, world=msgspec.structs.replace(mission.world, cylinders=(*mission.world.cylinders, pillar))
    )


@pytest.fixture(scope="module")
def rehearsal() -> Rehearsal:
    pillar = in_the_way_of(1, 0.62)
    system = Rehearsal(with_pillar(INDOOR, pillar))
    system.pillar = pillar
    return system


def test_a_vehicle_is_led_around_what_another_has_seen(rehearsal: Rehearsal):
    report = rehearsal.fly()
    assert report.success, report.reason
    assert report.cloud_replans >= 1
    assert report.swap_s_p50 is not None
    assert report.swap_s_p50 <= 1.0
    solid = obstacles.pack(World(bounds=INDOOR.world.bounds, cylinders=(rehearsal.pillar,)))
    flown = rehearsal.flown()[1].in_flight()
    assert obstacles.clearance(flown.positions_m, solid).min() >= 0.4
    accelerations = np.diff(flown.velocities_m_s, axis=0) / np.diff(flown.times_s)[:, None]
    assert np.linalg.norm(accelerations, axis=1).max() < 6.0


@pytest.mark.slow
def test_ten_vehicles_fly_a_new_plan_within_three_seconds():
    ten = load_mission("fleet-10")
    curve_m = plan_mission(ten, seed=0).vehicles[4].curve_m
    east_m, north_m, _ = curve_m[int(0.65 * len(curve_m))].tolist()
    pillar = Cylinder(name="pillar", centre_m=(east_m, north_m), radius_m=0.3, top_m=4.0, known=False)
    system = Rehearsal(with_pillar(ten, pillar))
    system.pillar, system.seen_at_s = pillar, 20.0
    report = system.fly()
    assert report.success, report.reason
    assert report.cloud_replans >= 1
    assert report.swap_s_p50 is not None
    assert report.swap_s_p50 <= 3.0
    assert not system.simulator.collisions


def test_what_stands_in_nobodys_way_changes_nothing():
    system = Rehearsal(INDOOR)
    system.pillar = Cylinder(name="pillar", centre_m=(10.0, 14.0), radius_m=0.4, top_m=4.0)
    report = system.fly()
    assert report.success, report.reason
    assert report.cloud_replans == 0


@pytest.mark.slow
def test_the_cloud_leads_vehicles_out_of_a_dead_end():
    caught = scenario(Difference.DEAD_END, Link.GOOD, 0)
    together = WholeSystem(caught.mission, PlanningMode.END_CLOUD, truth_mission=caught.truth)
    report = together.fly()
    assert report.success, report.reason
    assert report.cloud_replans >= 1
    for flown in together.flown().values():
        assert min_clearance_m(caught.truth, flown.in_flight()) > INDOOR.limits.body_radius_m
