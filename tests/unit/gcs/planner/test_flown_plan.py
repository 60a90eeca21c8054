"""Plans in flight begin with the plan that is flown, and change it no more than it is worth."""

import msgspec
import numpy as np
import pytest

from gcs.planner import FlownPlan, plan_mission
from gcs.planner.allocation import allocate
from gcs.planner.curves import lengths
from gcs.planner.flown_plan import CORNER_SHARE
from gcs.planner.plan import FleetPlan
from gcs.replanning.remaining import Aloft, remaining_mission
from missions import time_law
from missions.mission import Mission, load_mission
from missions.world import Box
from tests.unit.gcs.planner.worlds import round_trip

INDOOR = load_mission("indoor")
FEW_EVALUATIONS = 60
"""Enough to mend a plan, too few to find a good one."""


def left_of(mission: Mission, plan: FleetPlan, observed: tuple[Box, ...] = ()) -> tuple[Mission, FlownPlan]:
    """What is left a fifth of the way later."""
    aloft = []
    for part in plan.vehicles:
        done = len(part.curve_m) // 5
        aloft.append(Aloft(part.sysid, part.curve_m[done], part.targets, part.curve_m[done:], 10.0))
    return remaining_mission(mission, aloft, observed), FlownPlan({part.sysid: part.curve_m for part in aloft})


def crate_on(curve_m: np.ndarray) -> Box:
    """A crate in the way, on a curve."""
    east_m, north_m, _ = curve_m[int(0.6 * len(curve_m))].tolist()
    return Box(name="crate", centre_m=(east_m, north_m, 2.0), half_m=(0.3, 0.3, 2.0))


def changes_m(plan: FleetPlan, flown: FlownPlan) -> list[float]:
    """Mean distances of new curves from flown ones."""
    return [
        float(np.mean([lengths(flown.curves_m[part.sysid] - point_m).min() for point_m in part.curve_m[::4]]))
        for part in plan.vehicles
    ]


@pytest.mark.parametrize("mission", [INDOOR, round_trip()], ids=["indoor", "with stops"])
def test_ways_lead_along_the_flown_curves_through_all_targets(mission: Mission):
    rest, flown = left_of(mission, plan_mission(mission, seed=1))
    routes = allocate(rest)
    ways = flown.ways(rest, routes)
    assert ways is not None
    for way, route in zip(ways, routes, strict=True):
        np.testing.assert_allclose(way.corners_m[[0, *way.stops, len(way.corners_m) - 1]], route.places_m)
        polygon_m = time_law.resample(
            way.corners_m, arc := time_law.arc_length(way.corners_m), np.linspace(0.0, arc[-1], 200)
        )
        off_m = [lengths(polygon_m - point_m).min() for point_m in flown.curves_m[route.sysid]]
        assert max(off_m) <= CORNER_SHARE * mission.limits.clearance_m + 0.3


def test_a_curve_to_a_target_that_has_moved_is_no_beginning():
    rest, flown = left_of(INDOOR, plan_mission(INDOOR, seed=1))
    moved = [msgspec.structs.replace(target, position_m=(10.0, 13.0, 1.5)) for target in rest.targets[:1]]
    elsewhere = msgspec.structs.replace(rest, targets=(*moved, *rest.targets[1:]))
    routes = allocate(elsewhere)
    ways = flown.ways(elsewhere, routes)
    assert ways is not None
    straight = {route.name for route in routes if route.targets[-1].name == moved[0].name}
    for way, route in zip(ways, routes, strict=True):
        if route.name in straight:
            np.testing.assert_array_equal(way.corners_m, route.straight.corners_m)
        else:
            assert len(way.corners_m) > 2
    assert FlownPlan().ways(rest, routes) is None


def test_nothing_new_changes_next_to_nothing():
    rest, flown = left_of(INDOOR, plan_mission(INDOOR, seed=1))
    again = plan_mission(rest, seed=5, flown=flown)
    assert again.feasible
    assert max(changes_m(again, flown)) < 0.5 * INDOOR.limits.clearance_m


@pytest.mark.parametrize("seed", range(4))
def test_a_blocked_plan_is_mended_as_well_as_a_new_one_is_made_and_with_less_change(seed: int):
    plan = plan_mission(INDOOR, seed=seed)
    rest, flown = left_of(INDOOR, plan, (crate_on(plan.vehicles[0].curve_m),))
    anew, mended = plan_mission(rest, seed=seed), plan_mission(rest, seed=seed, flown=flown)
    assert mended.feasible, mended.violations
    assert sum(changes_m(mended, flown)) <= sum(changes_m(anew, flown)) + 0.1
    assert not anew.feasible or mended.objective <= 1.1 * anew.objective


def test_one_seed_is_one_plan():
    rest, flown = left_of(INDOOR, plan_mission(INDOOR, seed=1))
    one, other = (plan_mission(rest, seed=3, flown=flown) for _ in range(2))
    for a, b in zip(one.vehicles, other.vehicles, strict=True):
        np.testing.assert_array_equal(a.curve_m, b.curve_m)
