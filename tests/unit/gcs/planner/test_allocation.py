"""Who flies to which target."""

import itertools

import msgspec
import pytest

from gcs.planner.allocation import allocate, path_costs
from missions.errors import InfeasibleMission, MissionError
from missions.mission import load_mission
from tests.unit.gcs.planner.worlds import room, wall

COLUMN_M = tuple((1.0, 3.0 + 3.0 * i, 0.0) for i in range(4))
SHUFFLED_M = tuple((19.0, 3.0 + 3.0 * i, 1.5) for i in (2, 0, 3, 1))


def targets_of(mission) -> list[str]:
    return [route.target.name for route in allocate(mission)]


def test_an_allocation_in_the_mission_is_followed():
    assert targets_of(load_mission("indoor")) == ["north-east", "south-east"]


def test_without_one_every_vehicle_gets_the_target_across_the_room():
    assert targets_of(room(pads_m=COLUMN_M, targets_m=SHUFFLED_M)) == ["t2", "t4", "t1", "t3"]


def test_the_allocation_is_the_cheapest_of_all():
    mission = room(wall(10.0, (1.0, 4.0)), pads_m=COLUMN_M, targets_m=SHUFFLED_M)
    costs = path_costs(mission)
    chosen = [mission.targets.index(route.target) for route in allocate(mission)]
    cheapest = min(sum(costs[i, j] for i, j in enumerate(order)) for order in itertools.permutations(range(4)))
    assert sum(costs[i, j] for i, j in enumerate(chosen)) == pytest.approx(cheapest)


def test_from_a_common_launch_point_targets_are_taken_in_order():
    assert targets_of(load_mission("terrain-1-5uav")) == [f"target-{i}" for i in range(1, 6)]


def test_too_few_targets_are_refused_with_what_was_expected_and_found():
    mission = load_mission("terrain-1-5uav")
    fewer = msgspec.structs.replace(mission, targets=mission.targets[:3])
    with pytest.raises(InfeasibleMission, match=r"terrain-1-5uav: expected as many .* found 5 vehicles and 3 targets"):
        allocate(fewer)
    assert issubclass(InfeasibleMission, MissionError)
