"""Closed loop without MAVSDK: pilot and planner fly the indoor mission with a vehicle that follows its setpoints."""

import itertools

import numpy as np
import pytest

from companion import events, instructions
from companion.events import FlightMode
from companion.settings import PlanningMode
from missions import obstacles
from tests.unit.companion.planner.problems import INDOOR, make_planner
from tests.unit.companion.rig import Rig, items_of, of

AROUND_THE_CRATE_M = np.array(
    [
        [3.0, 5.9, 1.5],
        [5.0, 4.7, 1.5],
        [7.0, 4.2, 1.5],
        [9.0, 4.7, 1.5],
        [12.0, 5.7, 1.5],
        [15.0, 6.4, 1.5],
        [19.0, 8.5, 1.5],
    ]
)
LIMITS = INDOOR.limits
SOLID = obstacles.pack(INDOOR.world.as_known())


class Flown:
    """One flight from take-off to the target, with the real planner."""

    def __init__(
        self, seed: int, track_m: np.ndarray = AROUND_THE_CRATE_M, mode: PlanningMode = PlanningMode.END_CLOUD
    ):
        self.rig = Rig(mode=mode, planner=make_planner(seed=seed))
        self.rig.ready(items_of(track_m))
        self.rig.feed(events.ArmingReported(True), events.LandedReported(False), events.UtcReported(0.0))
        self.rig.start()
        self.rig.run(0.1)
        self.began_s = self.rig.now_s
        self.rig.feed(events.ModeReported(FlightMode.OFFBOARD))
        self.rig.run(60.0, until=lambda: len(of(self.rig.sent, instructions.CommandMode)) > 1)
        self.time_s = self.rig.now_s - self.began_s
        sent = [i.setpoint for i in of(self.rig.sent, instructions.SendSetpoint)]
        self.positions_m = self.rig.frame.enu(np.array([s.position_m for s in sent]))
        self.speeds_m_s = np.linalg.norm([s.velocity_m_s for s in sent], axis=1)
        self.accelerations_m_s2 = np.array([s.acceleration_m_s2 for s in sent])
        self.clearance_m = obstacles.clearance(self.positions_m, SOLID)


@pytest.fixture(scope="module", params=range(3))
def flown(request: pytest.FixtureRequest) -> Flown:
    return Flown(request.param)


def test_the_target_is_reached_in_about_the_nominal_time(flown: Flown):
    np.testing.assert_allclose(flown.positions_m[-1], AROUND_THE_CRATE_M[-1], atol=0.05)
    assert flown.rig.pilot.figures.replans >= 6
    assert flown.time_s < 11.5, "a law of 3 m/s and 2 m/s2 along this track takes 9.3 s"


def test_clearance_and_speed_rule_are_kept(flown: Flown):
    near = flown.clearance_m < LIMITS.avoidance_distance_m
    assert flown.clearance_m.min() >= LIMITS.clearance_m
    assert flown.speeds_m_s.max() <= LIMITS.cruise_speed_m_s
    assert flown.speeds_m_s[near].max(initial=0.0) <= LIMITS.avoidance_speed_m_s


def test_setpoints_are_smooth_across_all_replans(flown: Flown):
    acceleration = np.linalg.norm(flown.accelerations_m_s2, axis=1)
    jerk = np.diff(flown.accelerations_m_s2, axis=0) / 0.02
    steps_m = np.linalg.norm(np.diff(flown.positions_m, axis=0), axis=1)
    assert acceleration.max() <= 1.05 * LIMITS.acceleration_m_s2
    assert steps_m.max() <= 0.02 * 1.1 * flown.speeds_m_s.max()
    assert np.sum(jerk**2) * 0.02 < 200.0


def test_every_announced_trajectory_ends_at_rest_and_begins_where_the_one_before_it_is(flown: Flown):
    announced = [i.message.trajectory for i in of(flown.rig.sent, instructions.SendTrajectory)]
    for before, after in itertools.pairwise(announced):
        joint, begin = before.at(after.start_s), after.at(after.start_s)
        for part, other in zip(joint, begin, strict=True):
            np.testing.assert_allclose(part, other, atol=1e-6)
        np.testing.assert_allclose(after.at(after.end_s).velocity_m_s, 0.0, atol=1e-9)


def test_with_the_target_alone_it_finds_its_own_way():
    flown = Flown(0, mode=PlanningMode.ONBOARD)
    np.testing.assert_allclose(flown.positions_m[-1], AROUND_THE_CRATE_M[-1], atol=0.05)
    assert flown.clearance_m.min() >= LIMITS.clearance_m
    assert flown.speeds_m_s[flown.clearance_m < LIMITS.avoidance_distance_m].max(initial=0.0) <= 1.0


def test_through_a_narrow_place_it_flies_slowly():
    """0.75 m beside the crate: more than the required clearance, far less than the avoidance distance."""
    close_m = np.array([[5.5, 4.75, 1.5], [8.5, 4.75, 1.5], [12.0, 5.0, 1.5], [19.0, 8.5, 1.5]])
    flown = Flown(1, close_m)
    near = flown.clearance_m < LIMITS.avoidance_distance_m
    assert near.sum() > 50
    assert flown.speeds_m_s[near].max() <= LIMITS.avoidance_speed_m_s
    assert flown.clearance_m.min() >= LIMITS.clearance_m
    np.testing.assert_allclose(flown.positions_m[-1], close_m[-1], atol=0.05)


def test_stopped_in_mid_flight_it_comes_to_rest_clear_of_everything():
    rig = Rig(planner=make_planner())
    rig.ready(items_of(AROUND_THE_CRATE_M))
    rig.feed(events.ArmingReported(True), events.LandedReported(False))
    rig.start()
    rig.run(0.1)
    rig.feed(events.ModeReported(FlightMode.OFFBOARD))
    rig.run(3.5)
    rig.feed(events.StopRequested())
    rig.run(4.0, until=lambda: len(of(rig.sent, instructions.CommandMode)) > 1)
    assert of(rig.sent, instructions.CommandMode)[-1].mode is FlightMode.HOLD
    stopped_m = rig.frame.enu(rig.place_ned_m)
    assert obstacles.clearance(stopped_m[None], SOLID)[0] >= LIMITS.clearance_m
