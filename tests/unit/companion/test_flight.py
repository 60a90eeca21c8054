"""A flight under control: continuity, replanning and its reasons, braking, progress, a new mission in flight."""

import numpy as np
import pytest

from companion import events, instructions
from companion.events import FlightMode
from companion.planner.planner import Outlook
from companion.settings import PilotSettings
from missions.mission_items import MissionItem, plan_id
from missions.trajectory import Trajectory
from missions.tunnel import CompanionState, Reason, TrajectoryKind
from tests.unit.companion.rig import HOME, TRACK_M, Rig, StraightPlanner, items_of, of

State = CompanionState
SETTINGS = PilotSettings()
NEW_TRACK_M = TRACK_M + np.array([0.0, -1.0, 0.3])


def setpoints(found: list) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) positions and velocities that were sent, NED."""
    sent = [instruction.setpoint for instruction in of(found, instructions.SendSetpoint)]
    return np.array([s.position_m for s in sent]), np.array([s.velocity_m_s for s in sent])


def assert_smooth(found: list) -> None:
    """No jump in position or velocity between setpoints 20 ms apart."""
    positions, velocities = setpoints(found)
    steps_m = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    assert steps_m.max() < 0.02 * (np.linalg.norm(velocities, axis=1).max() + 0.5)
    assert np.linalg.norm(np.diff(velocities, axis=0), axis=1).max() < 0.5


def test_a_committed_trajectory_is_replaced_when_it_is_a_second_old():
    rig = Rig().flying()
    wanted = of(rig.run(5.0), instructions.RequestPlan)
    begins = [request.request.start_s for request in wanted]
    gaps_s = np.diff(begins)
    assert len(wanted) >= 3
    assert np.all(gaps_s >= SETTINGS.replan_age_s)
    assert np.all(gaps_s < SETTINGS.replan_age_s + 0.2)


def test_a_plan_begins_in_the_committed_state_at_a_time_to_come():
    rig = Rig(answers_plans=True).flying()
    rig.answers_plans = False
    (wanted, *_) = of(rig.run(1.5), instructions.RequestPlan)
    request = wanted.request
    assert request.start_s > rig.now_s - 1.5 + 1.0
    expected = request.committed.at(request.start_s)
    for part, value in zip(request.start, expected, strict=True):
        np.testing.assert_allclose(part, value)


def test_setpoints_follow_one_another_without_a_jump_over_many_replans():
    rig = Rig().flying()
    flown = rig.run(12.0)
    assert rig.pilot.figures.replans > 5
    assert_smooth(flown)


def test_an_answer_that_comes_too_late_is_not_flown():
    rig = Rig().flying()
    rig.answers_plans = False
    (wanted, *_) = of(rig.run(1.3), instructions.RequestPlan)
    rig.run(0.5)
    rig.feed(rig.answer(wanted.request))
    assert rig.pilot.figures.replans == 0
    assert of(rig.run(0.1), instructions.RequestPlan), "it asks anew"


def test_an_answer_to_another_question_is_not_flown():
    rig = Rig().flying()
    (first, *_) = of(rig.sent, instructions.RequestPlan)
    rig.feed(rig.answer(first.request))
    assert rig.pilot.figures.replans == 0


def test_without_a_new_plan_it_flies_to_the_end_of_the_committed_one_hovers_and_goes_on_trying():
    rig = Rig().flying()
    rig.run(1.5)
    rig.planner.blind = True
    flown = rig.run(6.0)
    assert (rig.pilot.state, rig.pilot.reason) == (State.HOLDING, Reason.NO_PATH)
    assert_smooth(flown)
    _, velocities = setpoints(flown)
    np.testing.assert_allclose(velocities[-1], 0.0, atol=1e-9)
    assert len(of(flown, instructions.RequestPlan)) > 5
    rig.planner.blind = False
    assert_smooth(rig.run(3.0))
    assert (rig.pilot.state, rig.pilot.reason) == (State.FLYING, Reason.NONE)


def test_a_trajectory_that_is_blocked_is_braked_on_at_once():
    rig = Rig().flying()
    rig.feed(events.UtcReported(0.0))
    rig.run(1.5)
    rig.planner.clear, rig.planner.blind = False, True
    speed_m_s = np.linalg.norm(rig.velocity_ned_m_s)
    braking = rig.run(0.1)
    assert (rig.pilot.state, rig.pilot.reason) == (State.HOLDING, Reason.NO_PATH)
    kinds = [announced.message.kind for announced in of(braking, instructions.SendTrajectory)]
    assert kinds == [TrajectoryKind.BRAKING]
    flown = rig.run(3.0)
    assert_smooth(flown)
    positions, velocities = setpoints(flown)
    assert np.linalg.norm(positions[-1] - positions[0]) < speed_m_s**2 / 2.0 + 0.5
    np.testing.assert_allclose(velocities[-1], 0.0, atol=1e-9)


class SeesAhead(StraightPlanner):
    """What is flown turns out to be blocked from `conflict_at_s` on."""

    def __init__(self) -> None:
        super().__init__()
        self.blocked: Trajectory | None = None
        self.conflict_at_s = self.too_fast_at_s = np.inf

    def outlook(self, trajectory: Trajectory, now_s: float) -> Outlook:
        if trajectory is not self.blocked:
            return Outlook(np.inf, np.inf, np.inf)
        return Outlook(self.conflict_at_s, self.conflict_at_s, self.too_fast_at_s)


def blocked_ahead(in_s: float = np.inf, too_fast_in_s: float = np.inf) -> Rig:
    """A second and a half on its way, a vehicle whose trajectory turns out to be bad; it gets no answers."""
    planner = SeesAhead()
    rig = Rig(planner=planner).flying()
    rig.run(1.5)
    assert rig.pilot._flight is not None
    rig.answers_plans, planner.blocked = False, rig.pilot._flight.course.latest
    planner.conflict_at_s, planner.too_fast_at_s = rig.now_s + in_s, rig.now_s + too_fast_in_s
    return rig


def test_too_fast_past_what_was_not_seen_before_it_plans_at_once_but_does_not_brake():
    rig = blocked_ahead(too_fast_in_s=0.5)
    happened = rig.run(1.0)
    assert of(happened, instructions.RequestPlan)
    assert rig.pilot.state is State.FLYING


def test_blocked_ahead_it_plans_at_once_and_flies_on_while_it_could_still_stop():
    rig = blocked_ahead(in_s=2.5)
    happened = rig.run(0.3)
    (wanted,) = of(happened, instructions.RequestPlan)
    assert rig.pilot.state is State.FLYING
    rig.now_s -= 0.25
    replans = rig.pilot.figures.replans
    rig.feed(rig.answer(wanted.request))
    assert rig.pilot.figures.replans == replans + 1
    assert_smooth(happened)


def test_blocked_ahead_without_an_answer_it_brakes_before_it_is_too_late():
    rig = blocked_ahead(in_s=1.8)
    rig.run(0.2)
    assert rig.pilot.state is State.FLYING
    rig.run(1.6, until=lambda: rig.pilot.state is State.HOLDING)
    assert (rig.pilot.state, rig.pilot.reason) == (State.HOLDING, Reason.NO_PATH)
    speed_m_s = np.linalg.norm(rig.velocity_ned_m_s)
    assert speed_m_s > 1.0
    assert rig.planner.conflict_at_s - rig.now_s > speed_m_s / rig.planner.limits.acceleration_m_s2
    assert_smooth(rig.run(3.0))


def test_a_plan_that_has_not_begun_yet_is_judged_itself_and_not_replaced():
    rig = blocked_ahead(in_s=2.5)
    rig.answers_plans = True
    assert len(of(rig.run(0.2), instructions.RequestPlan)) == 1
    assert rig.pilot.state is State.FLYING


def test_when_the_sensor_falls_silent_it_brakes_and_goes_on_when_it_is_heard_again():
    rig = Rig().flying()
    rig.run(1.5)
    rig.sensor_silent = True
    silent = rig.run(3.0)
    assert (rig.pilot.state, rig.pilot.reason) == (State.HOLDING, Reason.NO_SENSOR)
    assert not of(silent, instructions.RequestPlan)
    assert "sensor silent" in [note.text for note in of(silent, instructions.Note)]
    np.testing.assert_allclose(setpoints(silent)[1][-1], 0.0, atol=1e-9)
    rig.sensor_silent = False
    assert_smooth(rig.run(3.0))
    assert rig.pilot.state is State.FLYING


def test_without_odometry_it_brakes_and_goes_on_when_there_is_some_again():
    rig = Rig().flying()
    rig.run(1.5)
    for _ in range(10):
        rig.now_s += 0.02
        rig.feed(events.Tick(odometry_age_s=1.2))
    assert (rig.pilot.state, rig.pilot.reason) == (State.HOLDING, Reason.NO_POSITION)
    rig.run(3.0)
    assert rig.pilot.state is State.FLYING


def test_a_vehicle_far_off_its_setpoint_is_planned_for_from_where_it_is():
    rig = Rig().flying()
    rig.run(0.5)
    rig.follows = False
    rig.place_ned_m = rig.place_ned_m + np.array([2.0, 0.0, 0.0])
    rig.velocity_ned_m_s = np.array([0.3, 0.0, 0.0])
    rig.answers_plans = False
    (wanted, *_) = of(rig.run(1.5), instructions.RequestPlan)
    np.testing.assert_allclose(wanted.request.start.position_m[:2], rig.frame.enu(rig.place_ned_m)[:2], atol=0.1)
    np.testing.assert_allclose(wanted.request.start.velocity_m_s, [0.0, 0.3, 0.0], atol=1e-3)
    assert wanted.request.committed is None


def test_its_tracking_error_is_part_of_the_status():
    rig = Rig().flying()
    rig.follows = False
    rig.run(2.0)
    assert of(rig.sent, instructions.SendStatus)[-1].status.tracking_error_p99_m > 0.5


def test_it_tells_the_autopilot_the_next_mission_item_as_it_passes_track_points():
    rig = Rig().at_target()
    announced = [instruction.seq for instruction in of(rig.sent, instructions.SetCurrentItem)]
    waypoints = [seq for seq, item in enumerate(items_of()) if item.command == 16]
    assert announced == waypoints
    assert of(rig.sent, instructions.SendStatus)[-1].status.track_index == len(waypoints) - 1


# ---------------------------------------------------------------- a new mission in flight


def test_a_new_mission_is_blended_over_without_a_jump_and_named_once_it_is_flown():
    rig = Rig().flying()
    rig.run(2.0)
    rig.answers_plans = False
    swapped = rig.load(items_of(NEW_TRACK_M), identity=8, current_seq=0)
    swapped += rig.run(0.1)
    (wanted,) = of(swapped, instructions.RequestPlan)
    assert rig.pilot._flight.order.plan_id == plan_id(items_of())
    rig.answers_plans = True
    swapped += rig.feed(rig.answer(wanted.request))
    assert of(swapped, instructions.SendStatus)[-1].status.plan_id == plan_id(items_of(NEW_TRACK_M))
    swapped += rig.run(30.0, until=lambda: len(of(rig.sent, instructions.CommandMode)) > 1)
    assert_smooth(swapped)
    np.testing.assert_allclose(rig.frame.enu(rig.place_ned_m), NEW_TRACK_M[-1], atol=0.3)


def test_a_new_mission_begins_where_the_vehicle_is_not_at_its_first_point():
    rig = Rig().flying()
    rig.run(5.0)
    passed = rig.frame.enu(rig.place_ned_m)
    rig.answers_plans = False
    (wanted,) = of(rig.load(items_of(NEW_TRACK_M), identity=8) + rig.run(0.1), instructions.RequestPlan)
    assert passed[0] > NEW_TRACK_M[0, 0] + 1.0
    assert np.all(wanted.request.guide.way.points_m[:, 0] > passed[0] - 0.3)


def test_a_new_mission_that_is_not_understood_leaves_the_old_one_flying():
    rig = Rig().flying()
    rig.run(1.0)
    rig.load((MissionItem(command=99),), identity=8)
    rig.run(2.0)
    assert rig.pilot.state is State.FLYING
    assert of(rig.sent, instructions.SendStatus)[-1].status.plan_id == plan_id(items_of())


def test_a_mission_that_is_cleared_in_flight_is_flown_to_its_end():
    rig = Rig().flying()
    rig.run(1.0)
    rig.feed(events.MissionReported(0, 0))
    rig.run(60.0, until=lambda: len(of(rig.sent, instructions.CommandMode)) > 1)
    assert of(rig.sent, instructions.CommandMode)[-1].mode is FlightMode.LAND


def test_the_same_mission_stored_again_changes_nothing():
    rig = Rig().flying()
    rig.run(1.2)
    before = rig.pilot._flight.newest_order
    rig.load(items_of(), identity=8)
    assert rig.pilot._flight.newest_order is before


@pytest.mark.parametrize("age_s", [0.0, 0.9])
def test_home_may_be_reported_again_and_again(age_s: float):
    rig = Rig().flying()
    flown = rig.run(1.0)
    rig.feed(events.HomeReported(HOME))
    assert_smooth(flown + rig.run(1.0 + age_s))
