"""The pilot's states, and every rule of taking and handing over control."""

import msgspec
import numpy as np
import pytest

from companion import events, instructions
from companion.events import FlightMode
from companion.instructions import CommandResult
from companion.settings import PilotSettings, PlanningMode
from missions.mission import OnArrival
from missions.mission_items import Command, MissionItem, plan_id
from missions.tunnel import CompanionState, Reason, TrajectoryKind
from tests.unit.companion.rig import (
    ACTING,
    HOME,
    INDOOR,
    START_M,
    TRACK_M,
    Rig,
    acknowledgement,
    acts,
    items_of,
    moved,
    of,
    with_home,
)

State = CompanionState


# ------------------------------------------------------------------------- getting ready


def test_it_waits_for_position_then_for_a_mission_and_is_then_ready():
    rig = Rig()
    assert rig.pilot.state is State.CONNECTING
    rig.feed(events.AutopilotFound())
    assert (rig.pilot.state, rig.pilot.reason) == (State.WAITING, Reason.NO_POSITION)
    rig.feed(events.OriginReported(HOME), events.HomeReported(HOME))
    assert rig.pilot.reason is Reason.NO_POSITION
    rig.feed(rig.odometry())
    assert rig.pilot.reason is Reason.NO_MISSION
    wanted = rig.feed(events.MissionReported(7, 0))
    assert of(wanted, instructions.DownloadMission) == [instructions.DownloadMission(7)]
    rig.feed(events.MissionDownloaded(7, items_of()))
    assert (rig.pilot.state, rig.pilot.reason) == (State.READY, Reason.NONE)


def test_its_status_names_the_mission_file_and_the_plan():
    status = of(Rig().ready().sent, instructions.SendStatus)[-1].status
    assert (status.state, status.mission_digest) == (State.READY, INDOOR.digest)
    assert status.plan_id == plan_id(items_of())


def test_its_status_comes_five_times_a_second_and_at_every_change():
    rig = Rig().connect()
    rig.sent.clear()
    rig.run(2.0)
    assert len(of(rig.sent, instructions.SendStatus)) in {9, 10, 11}
    changed = rig.load(items_of())
    assert of(changed, instructions.SendStatus)[-1].status.state is State.READY


def test_a_download_that_failed_is_tried_again():
    rig = Rig().connect()
    rig.feed(events.MissionReported(7, 0), events.MissionDownloaded(7, None))
    again = rig.run(1.2)
    assert of(again, instructions.DownloadMission) == [instructions.DownloadMission(7)]


def test_a_mission_that_is_not_understood_is_reported_and_a_later_one_flown():
    rig = Rig().ready((MissionItem(command=99),))
    assert (rig.pilot.state, rig.pilot.reason) == (State.WAITING, Reason.MISSION_NOT_UNDERSTOOD)
    rig.load(items_of(), identity=8)
    assert rig.pilot.state is State.READY


def test_a_mission_that_was_cleared_is_flown_no_more():
    rig = Rig().ready()
    rig.feed(events.MissionReported(0, 0))
    assert (rig.pilot.state, rig.pilot.reason) == (State.WAITING, Reason.NO_MISSION)


# ------------------------------------------------------------------------ MISSION_START


def test_nothing_is_streamed_or_commanded_before_mission_start():
    rig = Rig().airborne()
    rig.run(5.0)
    assert not acts(rig.sent)


def without_odometry() -> Rig:
    rig = Rig()
    rig.feed(events.AutopilotFound(), events.OriginReported(HOME), events.HomeReported(HOME))
    rig.load(items_of())
    return rig


@pytest.mark.parametrize(
    ("rig", "answer"),
    [
        (Rig(), (CommandResult.TEMPORARILY_REJECTED, Reason.AUTOPILOT_LOST)),
        (Rig().connect(), (CommandResult.DENIED, Reason.NO_MISSION)),
        (without_odometry(), (CommandResult.TEMPORARILY_REJECTED, Reason.NO_POSITION)),
        (Rig().ready((MissionItem(command=99),)), (CommandResult.DENIED, Reason.MISSION_NOT_UNDERSTOOD)),
        (Rig().ready(), (CommandResult.TEMPORARILY_REJECTED, Reason.NOT_AIRBORNE)),
    ],
)
def test_a_start_that_cannot_be_obeyed_is_refused_with_its_reason(rig: Rig, answer: tuple):
    refused = rig.start()
    assert acknowledgement(refused) == answer
    assert not acts(refused + rig.run(2.0))


def test_a_start_is_obeyed_once_however_often_it_comes():
    rig = Rig().airborne()
    assert acknowledgement(rig.start()) == (CommandResult.ACCEPTED, Reason.NONE)
    assert rig.pilot.state is State.ENGAGING
    assert acknowledgement(rig.start()) == (CommandResult.ACCEPTED, Reason.NONE)
    rig.run(0.2)
    assert len(of(rig.sent, instructions.RequestPlan)) == 1
    assert [command.mode for command in of(rig.sent, instructions.CommandMode)] == [FlightMode.OFFBOARD]
    rig.feed(events.ModeReported(FlightMode.OFFBOARD))
    assert acknowledgement(rig.start()) == (CommandResult.ACCEPTED, Reason.NONE)
    assert rig.pilot.state is State.FLYING


def test_the_stream_is_there_before_offboard_is_commanded():
    rig = Rig().airborne()
    rig.start()
    acting = [instruction for instruction in rig.run(0.2) if isinstance(instruction, ACTING)]
    assert isinstance(acting[0], instructions.SendSetpoint)
    assert isinstance(acting[1], instructions.CommandMode)
    np.testing.assert_allclose(acting[0].setpoint.position_m, rig.frame.ned(START_M), atol=0.01)


def test_it_waits_until_the_vehicle_stands():
    rig = Rig(follows=False).airborne()
    rig.velocity_ned_m_s = np.array([2.0, 0.0, 0.0])
    rig.start()
    assert not of(rig.run(3.0), instructions.RequestPlan)
    rig.velocity_ned_m_s = np.zeros(3)
    assert of(rig.run(0.1), instructions.RequestPlan)


def test_a_vehicle_that_does_not_come_to_rest_is_not_taken_over():
    rig = Rig(follows=False).airborne()
    rig.velocity_ned_m_s = np.array([2.0, 0.0, 0.0])
    rig.start()
    rig.run(10.0)
    assert (rig.pilot.state, acts(rig.sent)) == (State.READY, False)


@pytest.mark.parametrize(
    "refusal", [(events.ModeCommandEnded(FlightMode.OFFBOARD, accepted=False),), ()], ids=["refused", "silent"]
)
def test_when_offboard_is_refused_the_stream_ends_and_all_is_as_before(refusal: tuple):
    rig = Rig().airborne()
    rig.start()
    rig.run(0.1)
    rig.feed(*refusal)
    rig.run(4.0)
    assert (rig.pilot.state, rig.pilot.reason) == (State.READY, Reason.OFFBOARD_REFUSED)
    assert of(rig.sent, instructions.EndSetpoints)
    assert not acts(rig.run(1.0))


def test_without_a_first_path_control_is_not_taken():
    rig = Rig().airborne()
    rig.planner.blind = True
    rig.start()
    rig.run(PilotSettings().standing_timeout_s + 0.1)
    assert (rig.pilot.state, rig.pilot.reason) == (State.READY, Reason.NO_PATH)
    assert not acts(rig.sent)


def test_a_path_that_is_free_a_little_later_is_flown():
    rig = Rig().airborne()
    rig.planner.blind = True
    rig.start()
    rig.run(2.0)
    assert rig.pilot.state is State.ENGAGING
    rig.planner.blind = False
    rig.run(PilotSettings().retry_s + 0.1)
    assert acts(rig.sent)


def test_a_vehicle_that_is_in_offboard_already_is_flown_as_well():
    rig = Rig().airborne()
    rig.feed(events.ModeReported(FlightMode.OFFBOARD))
    rig.start()
    rig.run(0.1)
    rig.feed(events.ModeCommandEnded(FlightMode.OFFBOARD, accepted=True))
    assert rig.pilot.state is State.FLYING


# --------------------------------------------------------------------------- hand-over


@pytest.mark.parametrize("mode", [FlightMode.HOLD, FlightMode.LAND, FlightMode.RTL, FlightMode.OTHER])
def test_a_mode_that_was_not_asked_for_ends_control_without_a_command(mode: FlightMode):
    rig = Rig().flying()
    rig.run(1.0)
    released = rig.feed(events.ModeReported(mode))
    assert of(released, instructions.EndSetpoints)
    assert not acts(released)
    assert (rig.pilot.state, rig.pilot.reason) == (State.RELEASED, Reason.CONTROL_TAKEN)
    assert not acts(rig.run(5.0))


def test_a_mode_taken_while_engaging_ends_control():
    rig = Rig().airborne()
    rig.start()
    rig.run(0.1)
    rig.feed(events.ModeReported(FlightMode.RTL))
    assert rig.pilot.state is State.RELEASED
    late = rig.feed(events.ModeCommandEnded(FlightMode.OFFBOARD, accepted=False))
    assert not acts(late)
    assert rig.pilot.state is State.RELEASED


def test_a_take_off_may_end_while_engaging():
    rig = Rig(follows=False).airborne()
    rig.feed(events.ModeReported(FlightMode.TAKEOFF))
    rig.velocity_ned_m_s = np.array([0.0, 0.0, -1.0])
    rig.start()
    rig.feed(events.ModeReported(FlightMode.HOLD))
    assert rig.pilot.state is State.ENGAGING


def test_a_copy_of_the_start_that_was_on_its_way_does_not_take_control_back():
    rig = Rig().flying()
    rig.feed(events.ModeReported(FlightMode.HOLD))
    rig.run(0.5)
    assert acknowledgement(rig.start()) == (CommandResult.TEMPORARILY_REJECTED, Reason.CONTROL_TAKEN)
    assert rig.pilot.state is State.RELEASED


def test_resume_is_a_new_start_from_where_the_vehicle_is_along_the_rest_of_the_track():
    rig = Rig().flying()
    rig.run(20.0, until=lambda: rig.pilot.figures.replans >= 4)
    seq = of(rig.sent, instructions.SetCurrentItem)[-1].seq
    rig.feed(events.ModeReported(FlightMode.HOLD), events.MissionReported(7, seq))
    rig.velocity_ned_m_s = np.zeros(3)
    rig.run(1.5)
    assert acknowledgement(rig.start()) == (CommandResult.ACCEPTED, Reason.NONE)
    (wanted,) = of(rig.run(0.1), instructions.RequestPlan)
    np.testing.assert_allclose(wanted.request.start.position_m, rig.frame.enu(rig.place_ned_m), atol=1e-6)
    left_m = np.linalg.norm(wanted.request.guide.point(0.0) - TRACK_M[-1])
    assert wanted.request.guide.length_m < 1.2 * left_m + 2.0
    np.testing.assert_allclose(wanted.request.guide.end_m, TRACK_M[-1], atol=0.02)


def test_a_pilot_may_take_over_a_landing_too():
    rig = Rig().at_target()
    rig.feed(events.ModeReported(FlightMode.LAND))
    assert rig.pilot.state is State.LANDING
    rig.feed(events.ModeReported(FlightMode.HOLD))
    assert (rig.pilot.state, rig.pilot.reason) == (State.RELEASED, Reason.CONTROL_TAKEN)


def test_a_released_vehicle_that_was_landed_by_hand_is_ready_again():
    rig = Rig().flying()
    rig.feed(events.ModeReported(FlightMode.LAND), events.LandedReported(True), events.ArmingReported(False))
    assert rig.pilot.state is State.READY


# ----------------------------------------------------------------------------- arrival


@pytest.mark.parametrize(
    ("on_arrival", "mode", "state"),
    [
        (OnArrival.LAND, FlightMode.LAND, State.LANDING),
        (OnArrival.RTL, FlightMode.RTL, State.LANDING),
        (OnArrival.HOLD, FlightMode.HOLD, State.HOLDING),
    ],
)
def test_at_the_target_the_mission_says_what_happens(on_arrival: OnArrival, mode: FlightMode, state: State):
    rig = Rig(msgspec.structs.replace(INDOOR, on_arrival=on_arrival)).at_target()
    np.testing.assert_allclose(rig.frame.enu(rig.place_ned_m), TRACK_M[-1], atol=0.3)
    assert of(rig.sent, instructions.CommandMode)[-1].mode is mode
    still = rig.run(0.5)
    assert of(still, instructions.SendSetpoint), "the stream goes on until the autopilot is in its new mode"
    rig.feed(events.ModeReported(mode))
    assert (rig.pilot.state, rig.pilot.reason) == (state, Reason.TARGET_REACHED)
    assert not acts(rig.run(1.0))


def test_a_landing_that_was_refused_is_commanded_again_while_the_vehicle_hovers():
    rig = Rig().at_target()
    rig.feed(events.ModeCommandEnded(FlightMode.LAND, accepted=False))
    again = rig.run(1.5)
    assert [command.mode for command in of(again, instructions.CommandMode)] == [FlightMode.LAND]
    assert of(again, instructions.SendSetpoint)


def test_on_the_ground_the_flight_is_finished_and_a_new_mission_makes_ready():
    rig = Rig().at_target()
    rig.feed(events.ModeReported(FlightMode.LAND), events.LandedReported(True))
    assert (rig.pilot.state, rig.pilot.reason) == (State.FINISHED, Reason.TARGET_REACHED)
    rig.feed(events.ArmingReported(False), events.ModeReported(FlightMode.OFFBOARD))
    assert rig.pilot.state is State.FINISHED
    assert acknowledgement(rig.start()) == (CommandResult.TEMPORARILY_REJECTED, Reason.NOT_AIRBORNE)
    rig.load(items_of(TRACK_M[::-1]), identity=8)
    assert rig.pilot.state is State.READY


def test_a_vehicle_that_does_not_quite_reach_its_target_has_arrived_after_a_while():
    rig = Rig().flying()
    rig.run(60.0, until=lambda: rig.place_ned_m[1] > 17.5)
    rig.follows = False
    rig.run(20.0, until=lambda: len(of(rig.sent, instructions.CommandMode)) > 1)
    assert of(rig.sent, instructions.CommandMode)[-1].mode is FlightMode.LAND


# ------------------------------------------------------------------ frames and missions


def test_home_does_not_move_under_a_vehicle_that_is_flown():
    rig = Rig().flying()
    rig.run(1.0)
    before = rig.place_ned_m[2]
    rig.feed(with_home(HOME.altitude_amsl_m + 0.8))
    rig.run(0.1)
    assert rig.place_ned_m[2] == pytest.approx(before, abs=0.05)


def test_on_the_ground_a_new_home_changes_the_ground_offset():
    rig = Rig().ready()
    rig.feed(with_home(HOME.altitude_amsl_m + 0.8))
    offset = of(rig.sent, instructions.Note)[-1].fields["ground_offset_m"]
    assert offset == pytest.approx(HOME.altitude_amsl_m + 0.8 - INDOOR.origin.altitude_amsl_m, abs=1e-3)


def test_when_the_autopilots_origin_moves_setpoints_move_against_it():
    rig = Rig(follows=False).flying()
    rig.run(0.5)
    (before,) = of(rig.feed(events.Tick(0.0)), instructions.SendSetpoint)
    north_deg = 1e-5  # 1.11 m
    rig.feed(events.OriginReported(moved(HOME, north_deg)))
    (after,) = of(rig.feed(events.Tick(0.0)), instructions.SendSetpoint)
    shift_m = after.setpoint.position_m - before.setpoint.position_m
    np.testing.assert_allclose(shift_m, [-1.112, 0.0, 0.0], atol=0.01)


def test_in_onboard_mode_only_the_target_of_the_mission_is_flown_to():
    rig = Rig(mode=PlanningMode.ONBOARD).airborne()
    rig.start()
    (wanted,) = of(rig.run(0.1), instructions.RequestPlan)
    assert wanted.request.guide.length_m == pytest.approx(np.linalg.norm(TRACK_M[-1] - START_M), abs=0.05)


def test_a_mission_with_nothing_but_a_landing_is_not_understood():
    landing = (MissionItem(command=Command.NAV_LAND),)
    assert Rig().ready(landing).pilot.reason is Reason.MISSION_NOT_UNDERSTOOD


def test_trajectories_are_announced_in_utc():
    rig = Rig().airborne()
    rig.feed(events.UtcReported(1.7e9))
    rig.start()
    rig.run(0.1)
    rig.feed(events.ModeReported(FlightMode.OFFBOARD))
    (first,) = of(rig.sent, instructions.SendTrajectory)
    assert first.message.kind is TrajectoryKind.COMMITTED
    assert first.message.trajectory.start_s == pytest.approx(rig.now_s + 1.7e9)
    assert first.message.plan_id == plan_id(items_of())


def test_a_vehicle_that_cannot_see_is_not_ready_and_refuses_to_start():
    rig = Rig(sensor_silent=True).airborne()
    rig.run(0.1)
    assert (rig.pilot.state, rig.pilot.reason) == (State.WAITING, Reason.NO_SENSOR)
    (answer,) = of(rig.start(), instructions.AcknowledgeStart)
    assert (answer.result, answer.reason) == (CommandResult.TEMPORARILY_REJECTED, Reason.NO_SENSOR)
    rig.sensor_silent = False
    rig.run(0.1)
    assert (rig.pilot.state, rig.pilot.reason) == (State.READY, Reason.NONE)
