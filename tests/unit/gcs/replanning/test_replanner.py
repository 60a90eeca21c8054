"""When the cloud plans anew in flight, what for, and which answers it flies."""

import msgspec
import numpy as np
import pytest

from gcs.mapping.observed_map import ObservedMap
from gcs.planner import plan_mission
from gcs.planner.plan import FleetPlan
from gcs.replanning.remaining import Aloft, remaining_mission
from gcs.replanning.replanner import Cause, Replanner
from missions import obstacles
from missions.mission import contradictions, load_mission
from missions.occupancy import OccupancyBlock, blocks_of, voxels_of
from missions.world import World

INDOOR = load_mission("indoor")
PLAN = plan_mission(INDOOR, seed=1)


def part_way(plan: FleetPlan = PLAN, share: float = 0.2) -> list[Aloft]:
    """All vehicles at a share of their curves."""
    aloft = []
    for part in plan.vehicles:
        begin = int(share * (len(part.curve_m) - 1))
        left_s = float(part.times_s[-1] - part.times_s[begin])
        aloft.append(Aloft(part.sysid, part.curve_m[begin], part.targets, part.curve_m[begin:], left_s))
    return aloft


def pillar(observed: ObservedMap, middle_m: np.ndarray, revision: int = 1) -> None:
    """A pillar of half a metre around (2,) a place, up to 4 m, as a vehicle would report it."""
    side = np.arange(-0.25, 0.26, 0.1)
    east, north, up = (grid.ravel() for grid in np.meshgrid(side, side, np.arange(0.1, 4.0, 0.1)))
    points_m = np.column_stack((middle_m[0] + east, middle_m[1] + north, up))
    for index, occupied in blocks_of(voxels_of(points_m, 0.2)).items():
        observed.fold(1, OccupancyBlock(index, 0.2, revision, occupied))


def on_the_way() -> ObservedMap:
    """A pillar stands in the first vehicle's way."""
    observed = ObservedMap(INDOOR.world.bounds)
    curve_m = PLAN.vehicles[0].curve_m
    pillar(observed, curve_m[int(0.7 * len(curve_m))][:2])
    return observed


def aside() -> ObservedMap:
    """A pillar stands in nobody's way."""
    observed = ObservedMap(INDOOR.world.bounds)
    pillar(observed, np.array([10.0, 14.5]))
    return observed


def test_without_news_there_is_no_cause():
    assert Replanner(INDOOR, ObservedMap(INDOOR.world.bounds)).look(part_way(), 10.0) is None


def test_what_was_seen_in_the_way_is_a_cause_and_what_was_passed_is_none():
    observed = on_the_way()
    assert Replanner(INDOOR, observed).look(part_way(share=0.2), 10.0) is Cause.BLOCKED
    passed = Replanner(INDOOR, observed)
    assert not passed.is_blocked(part_way(share=0.9)[0].curve_m)


def test_nobody_in_flight_needs_no_plan():
    assert Replanner(INDOOR, on_the_way()).look([], 10.0) is None


def test_the_new_plan_leads_every_vehicle_from_where_it_is_to_its_target_around_what_was_seen():
    observed, aloft = on_the_way(), part_way()
    rest = remaining_mission(INDOOR, aloft, observed.boxes())
    plan = plan_mission(rest, seed=0)
    assert plan.feasible, plan.violations
    solid = obstacles.pack(World(bounds=INDOOR.world.bounds, boxes=observed.boxes()))
    for part, vehicle in zip(plan.vehicles, aloft, strict=True):
        np.testing.assert_allclose(part.curve_m[0], vehicle.position_m, atol=0.01)
        assert part.targets == vehicle.targets
        assert obstacles.clearance(part.curve_m, solid).min() >= INDOOR.limits.clearance_m - 1e-6


def test_a_vehicle_in_front_of_something_is_given_room_to_get_away():
    observed, aloft = on_the_way(), part_way()
    curve_m = PLAN.vehicles[0].curve_m
    place_m = curve_m[int(0.7 * len(curve_m))] - np.array([0.7, 0.0, 0.0])
    near = [Aloft(1, place_m, aloft[0].targets, aloft[0].curve_m, 5.0), *aloft[1:]]
    rest = remaining_mission(INDOOR, near, observed.boxes())
    assert rest.launch_zone_radius_m > 0.0
    assert plan_mission(rest, seed=0).feasible


def test_what_is_left_is_a_mission_that_contradicts_nothing_but_the_pads():
    rest = remaining_mission(INDOOR, part_way(), on_the_way().boxes())
    assert [key for key, _ in contradictions(rest) if "pad_m" not in key] == []


def test_a_vehicle_that_has_arrived_is_left_out():
    rest = remaining_mission(INDOOR, part_way()[1:], ())
    assert [vehicle.name for vehicle in rest.vehicles] == ["bravo"]
    assert rest.routes == {"bravo": ("south-east",)}


def test_a_vehicle_that_strayed_out_of_the_flight_range_is_planned_for_from_its_edge():
    aloft = part_way()
    strayed = Aloft(1, np.array([10.0, -0.2, 1.5]), aloft[0].targets, aloft[0].curve_m, 5.0)
    rest = remaining_mission(INDOOR, [strayed], ())
    assert 0.0 < rest.vehicles[0].pad_m[1] < 0.01


def test_a_feasible_plan_around_a_block_is_flown_and_not_asked_for_again():
    observed, aloft = on_the_way(), part_way()
    replanner = Replanner(INDOOR, observed)
    plan = plan_mission(remaining_mission(INDOOR, aloft, observed.boxes()), seed=0)
    assert replanner.judge(Cause.BLOCKED, plan, aloft, replanner.basis, 10.0) == ""
    assert replanner.look(part_way(plan, 0.0), 100.0) is None


def test_an_infeasible_plan_is_not_flown_and_is_tried_again_later():
    observed, aloft = on_the_way(), part_way()
    replanner = Replanner(INDOOR, observed)
    plan = plan_mission(remaining_mission(INDOOR, aloft, observed.boxes()), seed=0)
    impossible = type(plan)(**{**vars(plan), "feasible": False, "violations": ("no room",)})
    assert replanner.judge(Cause.BLOCKED, impossible, aloft, replanner.basis, 10.0) == "no room"
    assert replanner.look(aloft, 10.5) is None
    assert replanner.look(aloft, 11.1) is Cause.BLOCKED


def test_a_plan_that_is_hardly_better_is_not_worth_a_change():
    observed, aloft = aside(), part_way()
    replanner = Replanner(INDOOR, observed)
    assert replanner.look(aloft, 10.0) is Cause.REVIEW
    plan = plan_mission(remaining_mission(INDOOR, aloft, observed.boxes()), seed=0)
    assert "not materially better" in replanner.judge(Cause.REVIEW, plan, aloft, replanner.basis, 10.0)
    assert replanner.look(aloft, 20.0) is None


def test_the_map_is_reviewed_again_when_it_has_changed_but_not_too_often():
    observed, aloft = aside(), part_way()
    replanner = Replanner(INDOOR, observed)
    plan = plan_mission(remaining_mission(INDOOR, aloft, observed.boxes()), seed=0)
    replanner.judge(Cause.REVIEW, plan, aloft, replanner.basis, 10.0)
    pillar(observed, np.array([4.0, 14.5]))
    assert replanner.look(aloft, 12.0) is None
    assert replanner.look(aloft, 15.1) is Cause.REVIEW


def test_a_plan_that_is_much_better_is_flown():
    observed, aloft = aside(), part_way()
    replanner = Replanner(INDOOR, observed)
    slow = [Aloft(each.sysid, each.position_m, each.targets, each.curve_m, 60.0) for each in aloft]
    plan = plan_mission(remaining_mission(INDOOR, aloft, observed.boxes()), seed=0)
    assert replanner.judge(Cause.REVIEW, plan, slow, replanner.basis, 10.0) == ""


def test_an_edit_by_the_operator_is_a_cause_at_once():
    replanner = Replanner(INDOOR, ObservedMap(INDOOR.world.bounds))
    moved = msgspec.structs.replace(INDOOR.targets[0], position_m=(18.0, 9.0, 1.5))
    replanner.edit(msgspec.structs.replace(INDOOR, targets=(moved, *INDOOR.targets[1:])))
    assert replanner.look(part_way(), 10.0) is Cause.EDITED
    assert replanner.mission.targets[0].position_m == pytest.approx((18.0, 9.0, 1.5))


def test_an_edit_that_comes_while_a_plan_is_made_is_not_lost():
    observed, aloft = on_the_way(), part_way()
    replanner = Replanner(INDOOR, observed)
    basis = replanner.basis
    plan = plan_mission(remaining_mission(INDOOR, aloft, observed.boxes()), seed=0)
    replanner.edit(INDOOR)
    assert "meanwhile" in replanner.judge(Cause.BLOCKED, plan, aloft, basis, 10.0)
    assert replanner.look(aloft, 10.0) is Cause.EDITED


def test_what_is_seen_while_a_plan_is_made_is_looked_at_when_it_is_flown():
    observed, aloft = on_the_way(), part_way()
    replanner = Replanner(INDOOR, observed)
    basis = replanner.basis
    plan = plan_mission(remaining_mission(INDOOR, aloft, observed.boxes()), seed=0)
    pillar(observed, plan.vehicles[1].curve_m[len(plan.vehicles[1].curve_m) // 2][:2])
    assert replanner.judge(Cause.BLOCKED, plan, aloft, basis, 10.0) == ""
    assert replanner.look(part_way(plan, 0.0), 11.0) is Cause.BLOCKED


def test_an_edit_that_did_not_reach_every_vehicle_is_planned_for_again():
    observed, aloft = ObservedMap(INDOOR.world.bounds), part_way()
    replanner = Replanner(INDOOR, observed)
    replanner.edit(INDOOR)
    plan = plan_mission(remaining_mission(INDOOR, aloft, ()), seed=0)
    assert replanner.judge(Cause.EDITED, plan, aloft, replanner.basis, 10.0) == ""
    assert replanner.look(aloft, 20.0) is None
    replanner.forget_plan()
    assert replanner.look(aloft, 20.0) is Cause.EDITED
