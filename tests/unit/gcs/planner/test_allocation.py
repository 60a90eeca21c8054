"""Who flies to which targets, and in which order."""

import itertools

import msgspec
import numpy as np
import pytest

from gcs.planner.allocation import UNREACHABLE_M, allocate, legs, one_each, shortest
from gcs.planner.target_order import balanced_routes, route_length, weight
from missions.mission import Mission, load_mission
from missions.world import Box
from tests.unit.gcs.planner.worlds import room, wall

COLUMN_M = tuple((1.0, 3.0 + 3.0 * i, 0.0) for i in range(4))
SHUFFLED_M = tuple((19.0, 3.0 + 3.0 * i, 1.5) for i in (2, 0, 3, 1))


def routes_of(mission: Mission) -> dict[str, list[str]]:
    return {route.name: [target.name for target in route.targets] for route in allocate(mission)}


def firsts_of(mission: Mission) -> list[str]:
    return [route[0] for route in routes_of(mission).values()]


def test_an_allocation_in_the_mission_is_followed():
    assert routes_of(load_mission("indoor")) == {"alpha": ["north-east"], "bravo": ["south-east"]}


def test_routes_in_the_mission_are_followed_and_a_vehicle_without_one_stays():
    routes = {"alpha": ("south-east", "north-east"), "bravo": ()}
    mission = msgspec.structs.replace(load_mission("indoor"), allocation=routes)
    assert routes_of(mission) == {"alpha": ["south-east", "north-east"]}


def test_without_one_every_vehicle_gets_the_target_across_the_room():
    assert firsts_of(room(pads_m=COLUMN_M, targets_m=SHUFFLED_M)) == ["t2", "t4", "t1", "t3"]


def test_the_ways_that_count_are_those_around_obstacles():
    """By straight lines each vehicle flies to the target close by; but that lies behind a wall with no gap there."""
    barrier = Box(name="barrier", centre_m=(3.0, 5.0, 2.0), half_m=(0.1, 5.0, 2.0))
    pads_m, targets_m = ((4.5, 2.0, 0.0), (1.0, 6.5, 0.0)), ((1.8, 2.0, 1.5), (4.5, 9.0, 1.5))
    assert firsts_of(room(pads_m=pads_m, targets_m=targets_m)) == ["t1", "t2"]
    assert firsts_of(room(boxes=(barrier,), pads_m=pads_m, targets_m=targets_m)) == ["t2", "t1"]


def test_a_target_that_one_vehicle_cannot_reach_is_left_to_one_that_can():
    closed = room(wall(10.0, None), pads_m=((9.0, 6.0, 0.0), (13.0, 8.0, 0.0)), targets_m=((12.0, 6.0, 1.5),))
    assert routes_of(closed) == {"v2": ["t1"]}
    pads_m, targets_m = ((5.0, 6.0, 0.0), (14.0, 6.0, 0.0)), ((7.0, 6.0, 1.5), (5.0, 13.8, 1.5))
    assert routes_of(room(pads_m=pads_m, targets_m=targets_m)) == {"v1": ["t1"], "v2": ["t2"]}
    assert routes_of(room(pads_m=pads_m, targets_m=targets_m, range_m=9.0)) == {"v1": ["t2"], "v2": ["t1"]}


def test_with_fewer_targets_than_vehicles_the_nearest_fly_and_the_others_stay():
    mission = room(pads_m=COLUMN_M, targets_m=((19.0, 12.0, 1.5), (19.0, 6.0, 1.5)))
    assert routes_of(mission) == {"v2": ["t2"], "v4": ["t1"]}


def test_with_more_targets_than_vehicles_all_are_visited_in_short_balanced_routes():
    targets_m = ((15.0, 3.0, 1.5), (5.0, 12.0, 1.5), (10.0, 3.0, 1.5), (10.0, 12.0, 1.5), (5.0, 3.0, 1.5))
    mission = room(pads_m=((1.0, 3.0, 0.0), (1.0, 12.0, 0.0)), targets_m=targets_m)
    assert routes_of(mission) == {"v1": ["t5", "t3", "t1"], "v2": ["t2", "t4"]}


def test_from_a_common_launch_point_no_two_vehicles_change_sides_on_their_way_from_their_pads():
    mission = load_mission("terrain-1-10uav")
    routes = allocate(mission)
    assert sorted(route.targets[0].name for route in routes) == sorted(target.name for target in mission.targets)
    pads_m = [np.array(vehicle.pad_m) for vehicle in mission.vehicles]
    ends_m = [route.places_m[-1] for route in routes]
    for i, j in itertools.combinations(range(10), 2):
        assert (pads_m[i] - pads_m[j]) @ (ends_m[i] - ends_m[j]) >= -1e-6


@pytest.mark.parametrize("seed", range(5))
def test_setting_only_the_used_ways_right_gives_the_best_of_all_allocations(seed: int):
    rng = np.random.default_rng(seed)
    straight_m = rng.uniform(1.0, 5.0, (8, 4))
    true_m = straight_m * rng.choice([1.0, 1.5, UNREACHABLE_M], (8, 4))
    looked_at: list[tuple[int, int]] = []

    def way_lengths(wanted: list[tuple[int, int]]) -> np.ndarray:
        looked_at.extend(wanted)
        return np.array([true_m[leg] for leg in wanted])

    routes = shortest(straight_m.copy(), one_each, way_lengths)
    best_m = min(sum(true_m[i, j] for i, j in enumerate(order)) for order in itertools.permutations(range(4)))
    assert sum(true_m[leg] for leg in legs(routes)) == pytest.approx(best_m)
    assert len(looked_at) == len(set(looked_at)) <= 16


def lengths_between(starts_m: np.ndarray, targets_m: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.concatenate((starts_m, targets_m))[:, None] - targets_m, axis=2)


@pytest.mark.parametrize("seed", range(6))
def test_balanced_routes_are_nearly_the_best_there_are(seed: int):
    rng = np.random.default_rng(seed)
    table_m = lengths_between(rng.uniform(0.0, 10.0, (2, 2)), rng.uniform(0.0, 10.0, (5, 2)))

    everything = (
        [list(order[:cut]), list(order[cut:])] for order in itertools.permutations(range(5)) for cut in range(6)
    )
    lightest = min(weight(table_m, routes) for routes in everything)
    found = balanced_routes(table_m)
    assert sorted(itertools.chain(*found)) == list(range(5))
    assert weight(table_m, found) ** (1 / 8) <= 1.05 * lightest ** (1 / 8)


def test_a_hundred_targets_are_shared_among_five_vehicles_evenly():
    rng = np.random.default_rng(2)
    table_m = lengths_between(rng.uniform(0.0, 10.0, (5, 2)), rng.uniform(0.0, 10.0, (100, 2)))
    routes = balanced_routes(table_m)
    lengths_m = [route_length(table_m, vehicle, 5, route) for vehicle, route in enumerate(routes)]
    assert max(lengths_m) < 1.3 * min(lengths_m)
    assert sum(lengths_m) < 95.0  # a random order is 500 long
