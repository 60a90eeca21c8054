"""The swarms of a fleet improve one plan together."""

import numpy as np
import pytest

from gcs.planner.allocation import allocate
from gcs.planner.cooperation import Cooperation
from gcs.planner.ecpso import EcpsoSettings
from gcs.planner.fleet_cost import fleet_cost
from gcs.planner.problem import guides, pose
from missions.mission import Mission, load_mission
from tests.unit.gcs.planner.worlds import room, wall

CROSSING = room(wall(10.0, (5.0, 10.0)), targets_m=((19.0, 8.0, 1.5), (19.0, 6.0, 1.5)))


def cooperation(mission: Mission, seed: int = 1) -> Cooperation:
    routes = allocate(mission)
    return Cooperation(pose(mission, routes, guides(mission, routes)), EcpsoSettings(), np.random.default_rng(seed))


def cost(swarms: Cooperation) -> float:
    objective, violation = fleet_cost(swarms.problem, swarms.offsets, np.empty_like(swarms.offsets))
    return objective + swarms.problem.terms.penalty_weight * violation


@pytest.mark.parametrize("mission", [CROSSING, load_mission("terrain-3-5uav")], ids=["a room", "a terrain"])
def test_the_first_particles_make_a_better_plan_than_straight_lines_and_each_round_a_better_one_than_before(mission):
    swarms = cooperation(mission)
    costs = [cost(swarms)]
    swarms.start()
    costs.append(cost(swarms))
    for _ in range(8):
        swarms.round()
        costs.append(cost(swarms))
    assert np.all(np.diff(costs) <= 1e-9)
    assert costs[1] < costs[0]
    assert costs[-1] < costs[1]


def test_a_plan_found_elsewhere_is_taken_over_and_kept_unless_something_better_is_found():
    swarms, elsewhere = cooperation(CROSSING), cooperation(CROSSING, seed=2)
    elsewhere.start()
    for _ in range(12):
        elsewhere.round()
    swarms.start()
    swarms.adopt(elsewhere.offsets)
    assert cost(swarms) == pytest.approx(cost(elsewhere))
    swarms.round()
    assert cost(swarms) <= cost(elsewhere) + 1e-9


def test_every_look_at_a_curve_is_counted():
    swarms = cooperation(CROSSING)
    before, expected = swarms.curve_evaluations, swarms.curves_per_round
    swarms.round()
    assert swarms.curve_evaluations - before == expected
