"""Watching a vehicle in flight: arrival, interruption, and when the ground steps in."""

import numpy as np
import pytest

from gcs.dialect import Mode
from gcs.fleet.vehicle_state import LandedState, VehicleState
from gcs.flight.monitor import (
    COMPANION_SILENCE_S,
    HOLD_AGAIN_S,
    LOST_S,
    ORDER_AGAIN_S,
    STILL_UP_S,
    TAKEOVER_GRACE_S,
    UNATTENDED_HOLD_S,
    Phase,
    VehicleMonitor,
)
from missions.mission import OnArrival, load_mission
from missions.tunnel import CompanionState, CompanionStatus, Reason
from tests.unit.gcs import messages as mav

MISSION = load_mission("indoor")
TARGET = MISSION.targets[0]


class Flight:
    """A monitored vehicle whose state tests set by hand, second by second."""

    def __init__(
        self, *, on_arrival: OnArrival = OnArrival.LAND, companion: bool = True, unattended: bool = True
    ) -> None:
        self.now_s = 100.0
        self.state = VehicleState(1, armed=True, mode=Mode.OFFBOARD, landed=LandedState.IN_AIR)
        self.companion_alive = companion
        self.monitor = VehicleMonitor(
            target=TARGET,
            on_arrival=on_arrival,
            tolerance_m=0.5,
            endurance_s=300.0,
            flown_by_companion=companion,
            unattended=unattended,
            frame=MISSION.frame,
            ground_offset_m=0.0,
        )
        self.at([1.0, 6.5, 1.5])
        self.say(CompanionState.FLYING)
        self.wait(0.1)
        self.monitor.start(self.state, self.now_s)

    def at(self, position_m) -> None:
        self.place = self.state.place = MISSION.frame.geodetic(np.array(position_m))

    def say(self, state: CompanionState, reason: Reason = Reason.NONE) -> None:
        self.state.companion.status = CompanionStatus(state=state, reason=reason)

    def hear(self) -> None:
        """One round of telemetry; the companion's part only while it lives."""
        self.state.fold(mav.position(47.3977, 8.5456, 489.4, time_s=self.now_s), self.now_s)
        self.state.place = self.place
        if self.companion_alive:
            self.state.fold(mav.companion_heartbeat(), self.now_s)

    def wait(self, seconds: float) -> list[Mode]:
        """Let time pass with fresh heartbeats; the modes that the monitor commands."""
        orders = []
        for _ in range(round(seconds / 0.1)):
            self.now_s += 0.1
            self.hear()
            order = self.monitor.step(self.state, self.now_s)
            if order is not None:
                orders.append(order)
        return orders


def test_landing_at_the_target_is_success():
    flight = Flight()
    flight.at(TARGET.position_m)
    assert flight.wait(1.0) == []
    flight.say(CompanionState.FINISHED, Reason.TARGET_REACHED)
    flight.state.mode, flight.state.landed, flight.state.armed = Mode.LAND, LandedState.ON_GROUND, False
    flight.at([TARGET.position_m[0], TARGET.position_m[1], 0.0])
    flight.wait(0.2)
    assert (flight.monitor.phase, flight.monitor.reached) == (Phase.DONE, True)
    assert flight.monitor.reason == "landed at its target"


def test_landing_elsewhere_is_failure_and_says_how_far_off():
    flight = Flight()
    flight.at([TARGET.position_m[0] - 2.0, TARGET.position_m[1], 0.0])
    flight.state.landed, flight.state.armed = LandedState.ON_GROUND, False
    flight.wait(0.2)
    assert not flight.monitor.reached
    assert flight.monitor.reason == "landed 2.0 m from its target"


def test_a_silent_companion_in_offboard_is_answered_with_hold_and_then_with_landing():
    flight = Flight()
    flight.wait(5.0)
    flight.companion_alive = False
    orders = flight.wait(COMPANION_SILENCE_S + 0.3)
    assert orders == [Mode.HOLD]
    assert (flight.monitor.phase, flight.monitor.reason) == (Phase.INTERRUPTED, "the companion fell silent")
    assert flight.monitor.offboard_losses == 1
    flight.state.mode = Mode.HOLD
    assert flight.wait(UNATTENDED_HOLD_S + 0.5) == [Mode.LAND]
    flight.state.landed, flight.state.armed = LandedState.ON_GROUND, False
    flight.at(TARGET.position_m)
    flight.wait(0.2)
    assert (flight.monitor.reached, flight.monitor.reason) == (False, "the companion fell silent")


def test_with_an_operator_at_the_page_an_interrupted_vehicle_keeps_holding():
    flight = Flight(unattended=False)
    flight.wait(5.0)
    flight.companion_alive = False
    flight.wait(2.0)
    flight.state.mode = Mode.HOLD
    assert flight.wait(60.0) == []
    assert flight.monitor.phase is Phase.INTERRUPTED


@pytest.mark.parametrize("mode", [Mode.POSITION, Mode.ALTITUDE, Mode.RTL, Mode.MANUAL])
def test_the_ground_never_overrules_a_pilot(mode: Mode):
    flight = Flight()
    flight.wait(5.0)
    flight.state.mode = mode
    flight.say(CompanionState.RELEASED, Reason.CONTROL_TAKEN)
    assert flight.wait(30.0) == []
    assert flight.monitor.phase is Phase.INTERRUPTED
    assert "control taken" in flight.monitor.reason


def test_a_silent_companion_does_not_make_the_ground_overrule_a_pilot_either():
    flight = Flight()
    flight.wait(5.0)
    flight.state.mode, flight.companion_alive = Mode.POSITION, False
    assert flight.wait(30.0) == []


def test_a_companion_that_restarted_has_lost_control():
    flight = Flight()
    flight.wait(5.0)
    flight.say(CompanionState.READY)
    flight.state.mode = Mode.HOLD
    flight.wait(0.3)
    assert flight.monitor.phase is Phase.INTERRUPTED


def test_a_pause_by_the_operator_is_no_loss_and_can_be_resumed():
    flight = Flight(unattended=False)
    flight.wait(5.0)
    flight.monitor.pause(flight.state, flight.now_s)
    flight.state.mode = Mode.HOLD
    flight.say(CompanionState.RELEASED, Reason.CONTROL_TAKEN)
    flight.wait(10.0)
    assert (flight.monitor.phase, flight.monitor.reason) == (Phase.INTERRUPTED, "paused by the operator")
    assert flight.monitor.offboard_losses == 0
    flight.say(CompanionState.FLYING)
    flight.monitor.start(flight.state, flight.now_s)
    flight.wait(1.0)
    assert flight.monitor.phase is Phase.FLYING


def test_a_late_heartbeat_heals_by_itself():
    flight = Flight()
    flight.wait(5.0)
    flight.companion_alive = False
    flight.wait(COMPANION_SILENCE_S + 0.2)
    flight.companion_alive = True
    flight.wait(0.2)
    assert flight.monitor.phase is Phase.FLYING


def test_right_after_the_start_an_old_status_is_forgiven():
    flight = Flight()
    flight.say(CompanionState.READY)
    flight.wait(TAKEOVER_GRACE_S - 0.3)
    assert flight.monitor.phase is Phase.FLYING


def test_endurance_ends_a_flight_by_landing():
    flight = Flight()
    assert flight.wait(301.0) == [Mode.LAND]
    assert flight.monitor.phase is Phase.COMING_DOWN
    assert "endurance" in flight.monitor.reason


def test_a_vehicle_that_was_not_heard_for_longer_than_it_may_fly_is_asked_first_whether_it_has_landed():
    flight = Flight()
    flight.wait(1.0)
    for _ in range(400):
        flight.now_s += 1.0
        assert flight.monitor.step(flight.state, flight.now_s) is None
    assert flight.wait(1.0) == []
    flight.state.landed, flight.state.armed = LandedState.ON_GROUND, False
    flight.at([TARGET.position_m[0], TARGET.position_m[1], 0.0])
    assert flight.wait(5.0) == []
    assert flight.monitor.reached


def test_one_that_still_flies_then_is_landed():
    flight = Flight()
    flight.now_s += 400.0
    assert flight.wait(5.0) == [Mode.LAND]


def test_holding_at_the_target_is_arrival_where_the_mission_says_so():
    flight = Flight(on_arrival=OnArrival.HOLD)
    flight.at([TARGET.position_m[0] - 3.0, *TARGET.position_m[1:]])
    flight.say(CompanionState.HOLDING, Reason.NO_PATH)
    flight.wait(5.0)
    assert flight.monitor.phase is Phase.FLYING
    flight.at(TARGET.position_m)
    flight.say(CompanionState.HOLDING, Reason.TARGET_REACHED)
    flight.wait(0.2)
    assert flight.monitor.phase is Phase.FLYING  # for as long as the autopilot itself does not say that it holds
    flight.state.mode = Mode.HOLD
    flight.wait(0.2)
    assert (flight.monitor.phase, flight.monitor.reached) == (Phase.DONE, True)


def test_returning_home_counts_when_the_target_was_reached_before():
    flight = Flight(on_arrival=OnArrival.RTL)
    flight.at(TARGET.position_m)
    flight.wait(1.0)
    flight.at([1.0, 6.5, 0.0])
    flight.state.landed, flight.state.armed = LandedState.ON_GROUND, False
    flight.wait(0.2)
    assert flight.monitor.reached


def test_in_cloud_mode_the_autopilots_own_mode_decides():
    flight = Flight(companion=False, unattended=False)
    flight.state.mode = Mode.MISSION
    flight.wait(5.0)
    assert flight.monitor.phase is Phase.FLYING
    flight.state.mode = Mode.POSITION
    assert flight.wait(1.0) == []
    assert "left its mission for POSITION" in flight.monitor.reason


def test_a_lost_ground_link_is_no_reason_to_step_in():
    flight = Flight()
    flight.wait(5.0)
    orders = [flight.monitor.step(flight.state, flight.now_s + late) for late in np.arange(0.1, 20.0, 0.1)]
    assert orders == [None] * len(orders)
    assert flight.monitor.phase is Phase.FLYING


def test_when_the_link_returns_the_companion_is_given_time_to_be_heard():
    flight = Flight()
    flight.wait(5.0)
    flight.now_s += 20.0  # nothing at all is heard
    flight.companion_alive = False  # the autopilot's telemetry is back first
    assert flight.wait(COMPANION_SILENCE_S - 0.2) == []
    flight.companion_alive = True
    assert flight.wait(10.0) == []
    assert flight.monitor.phase is Phase.FLYING


def test_an_operators_hold_is_repeated_to_a_companion_that_takes_over_after_it():
    flight = Flight(unattended=False)
    flight.say(CompanionState.ENGAGING)
    flight.state.mode = Mode.HOLD
    flight.monitor.pause(flight.state, flight.now_s)
    assert flight.wait(2.0) == []  # it holds, as was ordered
    flight.state.mode = Mode.OFFBOARD
    flight.say(CompanionState.FLYING)
    assert flight.wait(0.3) == [Mode.HOLD]
    assert flight.wait(2 * HOLD_AGAIN_S) == [Mode.HOLD, Mode.HOLD]  # as long as it has no effect
    flight.state.mode = Mode.HOLD
    flight.say(CompanionState.RELEASED, Reason.CONTROL_TAKEN)
    assert flight.wait(10.0) == []
    assert (flight.monitor.phase, flight.monitor.reason) == (Phase.INTERRUPTED, "paused by the operator")


def test_a_hold_that_has_just_been_ordered_has_time_to_be_seen():
    flight = Flight(unattended=False)
    flight.wait(5.0)
    flight.monitor.pause(flight.state, flight.now_s)
    assert flight.wait(HOLD_AGAIN_S - 0.2) == []  # HEARTBEAT, with the mode, comes once a second


def test_what_another_station_resumes_is_not_held_again():
    flight = Flight(unattended=False)
    flight.wait(5.0)
    flight.monitor.pause(flight.state, flight.now_s)
    flight.state.mode = Mode.HOLD
    flight.say(CompanionState.RELEASED, Reason.CONTROL_TAKEN)
    flight.wait(5.0)
    flight.state.mode = Mode.OFFBOARD
    flight.say(CompanionState.FLYING)
    assert flight.wait(10.0) == []
    assert flight.monitor.phase is Phase.FLYING


def refuse(flight: Flight) -> None:
    """What the flight does when its order is not answered."""
    flight.monitor.order_failed(flight.now_s)


def test_a_landing_that_was_not_carried_out_is_ordered_again_when_the_vehicle_is_heard():
    flight = Flight()
    flight.companion_alive, flight.state.mode = False, Mode.HOLD
    assert flight.wait(COMPANION_SILENCE_S + UNATTENDED_HOLD_S + 1.0) == [Mode.LAND]
    flight.now_s += 30.0  # the link is gone
    refuse(flight)
    for _ in range(600):
        flight.now_s += 0.1
        assert flight.monitor.step(flight.state, flight.now_s) is None
    assert flight.wait(ORDER_AGAIN_S + 1.0) == [Mode.LAND]
    assert flight.wait(10.0) == [], "it was accepted: once is enough"


def test_a_landing_that_somebodys_late_order_has_ended_is_ordered_again():
    flight = Flight()
    flight.companion_alive, flight.state.mode = False, Mode.HOLD
    assert flight.wait(COMPANION_SILENCE_S + UNATTENDED_HOLD_S + 1.0) == [Mode.LAND]
    flight.state.mode = Mode.LAND
    assert flight.wait(2.0 * STILL_UP_S) == []
    flight.state.mode = Mode.HOLD
    assert flight.wait(STILL_UP_S + 1.0) == [Mode.LAND]


def test_a_landing_that_was_refused_is_not_ordered_again_against_a_pilot():
    flight = Flight()
    flight.companion_alive, flight.state.mode = False, Mode.HOLD
    assert flight.wait(COMPANION_SILENCE_S + UNATTENDED_HOLD_S + 1.0) == [Mode.LAND]
    refuse(flight)
    flight.state.mode = Mode.POSITION
    assert flight.wait(ORDER_AGAIN_S + 10.0) == []


def test_who_is_not_heard_for_longer_than_it_can_fly_is_given_up_and_nobody_before():
    flight = Flight()
    while flight.monitor.phase.in_flight:
        flight.now_s += 1.0
        assert flight.now_s < 1000.0
        flight.monitor.step(flight.state, flight.now_s)
    assert flight.monitor.endurance_s + LOST_S < flight.now_s - flight.state.telemetry_s < 320.0 + LOST_S
    assert flight.monitor.phase is Phase.DONE
    assert not flight.monitor.reached
    assert "not heard for" in flight.monitor.reason


def test_who_is_heard_now_and_then_is_not_given_up():
    flight = Flight()
    for _ in range(5):
        for _ in range(300):
            flight.now_s += 1.0
            flight.monitor.step(flight.state, flight.now_s)
        flight.monitor.started_s = flight.now_s
        flight.wait(0.5)
    assert flight.monitor.phase.in_flight
