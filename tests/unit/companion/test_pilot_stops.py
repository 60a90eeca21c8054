"""The pilot is stopped, or loses its autopilot: it leaves the vehicle in a state that was chosen on purpose."""

import numpy as np
import pytest

from companion import events, instructions
from companion.events import FlightMode
from companion.instructions import CommandResult
from companion.states import TRANSITIONS
from missions.tunnel import CompanionState, Reason
from tests.unit.companion.rig import LEVEL, Rig, acknowledgement, acts, items_of, of

State = CompanionState

# -------------------------------------------------------------------------------- stop


def test_an_idle_companion_stops_at_once():
    rig = Rig().airborne()
    assert not acts(rig.feed(events.StopRequested()))
    assert rig.pilot.done


def test_stopped_in_flight_it_brakes_along_its_trajectory_then_commands_hold():
    rig = Rig().flying()
    rig.run(3.0)
    moving = rig.pilot.handle(events.StopRequested(), rig.now_s)
    assert of(moving, instructions.SendTrajectory) == []  # nothing is announced before UTC is known
    assert (rig.pilot.state, rig.pilot.reason) == (State.HOLDING, Reason.STOPPED_BY_OPERATOR)
    braking = rig.run(4.0, until=lambda: FlightMode.HOLD in [c.mode for c in of(rig.sent, instructions.CommandMode)])
    assert of(braking, instructions.SendSetpoint)
    assert np.linalg.norm(rig.velocity_ned_m_s) < 0.05
    assert not rig.pilot.done
    rig.feed(events.ModeReported(FlightMode.HOLD))
    assert rig.pilot.done
    assert of(rig.sent, instructions.EndSetpoints)


def test_a_start_is_denied_while_stopping():
    rig = Rig().flying()
    rig.feed(events.StopRequested())
    assert acknowledgement(rig.start()) == (CommandResult.DENIED, Reason.STOPPED_BY_OPERATOR)


def test_stopped_while_engaging_it_leaves_the_vehicle_holding():
    rig = Rig().airborne()
    rig.start()
    rig.run(0.1)
    rig.feed(events.StopRequested())
    assert of(rig.sent, instructions.CommandMode)[-1].mode is FlightMode.HOLD
    rig.feed(events.ModeCommandEnded(FlightMode.HOLD, accepted=True))
    assert rig.pilot.done


def test_stopped_while_landing_it_lets_the_autopilot_land():
    rig = Rig().at_target()
    rig.feed(events.ModeReported(FlightMode.LAND))
    assert not acts(rig.feed(events.StopRequested()))
    assert rig.pilot.done


def test_stopped_while_it_hands_over_for_landing_it_says_that_the_vehicle_lands():
    rig = Rig().at_target()
    rig.feed(events.StopRequested(), events.ModeReported(FlightMode.LAND))
    assert rig.pilot.done
    assert (rig.pilot.state, rig.pilot.reason) == (State.LANDING, Reason.TARGET_REACHED)


def test_control_taken_while_stopping_ends_it_as_well():
    rig = Rig().flying()
    rig.run(1.0)
    rig.feed(events.StopRequested(), events.ModeReported(FlightMode.RTL))
    assert rig.pilot.done


# ----------------------------------------------------------------------- lost and found


def test_a_lost_autopilot_ends_the_stream_and_it_does_not_fly_on_by_itself():
    rig = Rig().flying()
    rig.run(1.0)
    assert of(rig.feed(events.AutopilotLost()), instructions.EndSetpoints)
    assert (rig.pilot.state, rig.pilot.reason) == (State.CONNECTING, Reason.AUTOPILOT_LOST)
    rig.connect()
    rig.load(items_of())
    assert rig.pilot.state is State.READY
    assert not acts(rig.run(3.0))


def test_an_autopilot_whose_time_jumps_back_was_rebooted():
    rig = Rig().flying()
    rig.run(1.0)
    rebooted = events.Odometry(3.0, rig.place_ned_m, np.zeros(3), LEVEL)
    assert of(rig.feed(rebooted), instructions.EndSetpoints)
    assert rig.pilot.state is State.WAITING


def test_a_transition_that_is_not_in_the_table_is_an_error():
    pilot = Rig().pilot
    assert State.FLYING not in TRANSITIONS[pilot.state]
    with pytest.raises(AssertionError, match="CONNECTING to FLYING"):
        pilot._enter(State.FLYING, Reason.NONE)
