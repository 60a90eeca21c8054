"""Flights whose ground station crashes or hangs, and whose companions come back, in process."""

import resource

import pytest

from gcs.dialect import Mode
from gcs.flight import actions
from gcs.flight.monitor import Phase
from gcs.flight.report import Flown
from gcs.settings import PlanningMode
from missions.faults import CompanionKill, Fault, LinkFault, SimulatedLink
from missions.mission import load_mission
from tests.soak import troubled_system
from tests.soak.experiment import fly, runs, work
from tests.soak.invariants import violations
from tests.soak.mishaps import (
    CompanionRestart,
    DiskFull,
    GroundCrash,
    GroundHang,
    Mishap,
    Namesake,
    OtherOrder,
    SecondStation,
    WallClockJump,
)
from tests.soak.scenario import Scenario, draw
from tests.soak.troubled_system import TroubledSystem

INDOOR = load_mission("indoor")


def flown(*mishaps: Mishap, mode: PlanningMode = PlanningMode.CLOUD, faults: tuple[Fault, ...] = ()) -> TroubledSystem:
    system = TroubledSystem(INDOOR, mode, seed=1, mishaps=mishaps, faults=faults)
    system.fly()
    return system


def flown_by(system: TroubledSystem, sysid: int) -> Flown:
    return system.flown()[sysid]


def kinds(system: TroubledSystem) -> list[str]:
    return [event.kind for event in system.events.events]


def test_a_ground_station_that_crashes_in_flight_finds_back_and_sees_the_arrival():
    system = flown(GroundCrash(phase=Phase.FLYING, after_s=3.0, down_s=2.0))
    assert [what for _, what in system.restarts] == ["ground station"]
    assert kinds(system).count("plan") == 1
    assert "rejoin" in kinds(system)
    assert system.flight.passive
    assert system.flight.success, [part.monitor.reason for part in system.flight.vehicles.values()]


def test_a_ground_station_that_crashes_before_the_take_off_begins_anew():
    system = flown(GroundCrash(phase=Phase.WAITING, after_s=1.0, down_s=5.0))
    assert [what for _, what in system.restarts] == ["ground station"]
    assert not system.flight.passive
    assert system.flight.success, system.error


def test_after_a_crash_at_the_take_off_who_hovers_waits_for_the_operator():
    system = flown(GroundCrash(phase=Phase.TAKING_OFF, after_s=3.0, down_s=2.0))
    assert system.flight.passive
    assert "started" not in kinds(system)
    assert not system.flight.success
    assert all(flown_by(system, sysid).positions_m[-1, 2] < 0.2 for sysid in system.simulator.vehicles)
    assert all(part.monitor.reason == "landed by the operator" for part in system.flight.vehicles.values())


def test_a_link_that_is_dark_at_first_delays_the_flight():
    system = TroubledSystem(INDOOR, PlanningMode.CLOUD, seed=1)
    system.simulator.order(LinkFault(link=SimulatedLink.GROUND, blackout_s=10.0))
    assert system.fly().success
    assert system.events.events[0].t_s >= 10.0


def test_a_link_that_goes_dark_at_the_take_off_ends_with_all_on_the_ground():
    system = TroubledSystem(INDOOR, PlanningMode.CLOUD, seed=1)
    system.simulator.order(LinkFault(link=SimulatedLink.GROUND, blackout_s=60.0, at_s=0.5))
    report = system.fly()
    assert report.reason.startswith("take-off broken off: ")
    assert not any(state.armed and not state.airborne for state in system.station.fleet.vehicles.values())
    assert "command" in kinds(system)[kinds(system).index("aborted") :]


def test_a_ground_station_that_crashes_while_the_link_is_dark_goes_on_looking_for_its_vehicles():
    crash = GroundCrash(phase=Phase.FLYING, after_s=2.0, down_s=1.0)
    system = TroubledSystem(INDOOR, PlanningMode.CLOUD, seed=1, mishaps=(crash,))
    system.simulator.order(LinkFault(link=SimulatedLink.GROUND, blackout_s=60.0, at_s=9.0))
    report = system.fly()
    assert any("looked for further" in event.text for event in system.events.events)
    assert report.success, report.reason
    assert all(vehicle.landed for vehicle in report.vehicles)


def test_a_ground_station_that_never_hears_its_vehicles_again_says_so_in_its_report():
    crash = GroundCrash(phase=Phase.FLYING, after_s=2.0, down_s=1.0)
    system = TroubledSystem(INDOOR, PlanningMode.CLOUD, seed=1, mishaps=(crash,))
    system.simulator.order(LinkFault(link=SimulatedLink.GROUND, blackout_s=3000.0, at_s=9.0))
    report = system.fly()
    assert not report.success
    assert all("not heard for" in vehicle.reason and not vehicle.landed for vehicle in report.vehicles)


def test_a_landing_that_a_dark_link_swallowed_is_ordered_again():
    system = TroubledSystem(INDOOR, PlanningMode.END_CLOUD, seed=1, faults=(CompanionKill(vehicle=1, at_s=2.0),))
    system.simulator.order(LinkFault(link=SimulatedLink.GROUND, vehicle=1, blackout_s=60.0, at_s=14.0))
    system.fly()
    told = [(event.kind, event.text) for event in system.events.events if event.vehicle == "alpha"]
    assert told.count(("command", "land")) == 2
    assert "no answer" in dict(told)["refused"]
    assert system.flight.vehicles[1].monitor.phase is Phase.DONE
    assert flown_by(system, 1).positions_m[-1, 2] < 0.2


def test_what_the_ground_station_says_to_be_stored_is_looked_up_on_the_vehicle():
    system = flown()
    assert kinds(system).count("uploaded") == 2
    assert not system.false_beliefs
    system.events.add("uploaded", "another mission than is stored", "alpha", plan_id=77)
    (belief,) = system.false_beliefs
    assert "alpha uploaded 0000004d" in belief


def test_a_crashed_ground_station_sends_nothing_any_more():
    system = TroubledSystem(INDOOR, PlanningMode.CLOUD, seed=1)
    system.process.ended = True
    system.wire.send(b"anything", ("simulator", 1))
    assert system.wire.bytes == 0


@pytest.mark.parametrize("phase", [Phase.WAITING, Phase.FLYING])
def test_a_ground_station_that_hangs_for_a_while_goes_on(phase: Phase):
    system = flown(GroundHang(phase=phase, after_s=1.0, lasts_s=2.0), WallClockJump(phase=phase, after_s=0.5, by_s=-50))
    assert system.flight.success, system.error
    assert not system.restarts


def test_a_companion_that_comes_back_does_not_take_over_by_itself():
    ends, back = (CompanionKill(vehicle=1, at_s=2.0),), CompanionRestart(vehicle=1, down_s=1.0)
    system = flown(back, mode=PlanningMode.END_CLOUD, faults=ends)
    assert [what for _, what in system.restarts] == ["companion 1"]
    assert not system.flight.success
    died_s = system.deaths[1]
    held_s = next(at_s for at_s, mode in system.modes[1] if at_s > died_s and mode is Mode.HOLD)
    landed_s = float(flown_by(system, 1).times_s[flown_by(system, 1).positions_m[:, 2] > 0.3][-1])
    assert [mode for at_s, mode in system.modes[1] if held_s < at_s < landed_s] == [Mode.LAND]
    assert system.flight.vehicles[2].monitor.reached


def test_on_a_full_disk_a_flight_goes_on_and_it_is_said_once():
    system = flown(DiskFull(phase=Phase.FLYING, after_s=1.0))
    assert system.flight.success, system.error
    (said,) = system.unwritten
    assert "the journal" in said
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[0] != 0


def test_what_a_second_ground_station_orders_is_followed():
    system = flown(SecondStation(vehicle=1, phase=Phase.FLYING, after_s=1.0, order=OtherOrder.LAND))
    one, other = system.flight.vehicles[1].monitor, system.flight.vehicles[2].monitor
    assert (one.reached, one.phase, other.reached) == (False, Phase.DONE, True)
    assert one.reason
    assert flown_by(system, 1).positions_m[-1, 2] < 0.2


def test_who_is_held_by_a_second_ground_station_and_let_go_on_flies_to_its_target(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(troubled_system, "GOING_ON_AFTER_S", 3.0)  # later, the first station lands it
    visit = SecondStation(vehicle=1, phase=Phase.FLYING, after_s=3.0, order=OtherOrder.HOLD_AND_GO_ON)
    system = flown(visit)
    assert not system.mistakes
    assert flown_by(system, 1).positions_m[-1] == pytest.approx([19.0, 8.5, 0.0], abs=0.5)
    monkeypatch.setattr(actions, "CURRENT_ITEM", 0.0)
    assert "turned back" in flown(visit).mistakes[0]


def test_a_namesake_that_is_heard_in_flight_changes_nothing():
    system = flown(Namesake(vehicle=1, phase=Phase.FLYING, after_s=1.0, lasts_s=5.0))
    assert system.flight.success, system.error
    assert system.station.routes.ignored >= 5


def test_a_flight_that_does_not_end_is_a_mistake(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(troubled_system, "LONGEST_FLIGHT_S", 5.0)
    assert flown().mistakes == ["the flight has not ended after 5 s"]


def test_a_vehicle_that_still_moves_at_the_end_is_a_violation():
    system = TroubledSystem(INDOOR, PlanningMode.CLOUD, seed=1)
    report = system.fly()
    scenario = Scenario(PlanningMode.CLOUD, INDOOR, INDOOR, (), ())
    assert not violations(scenario, system, report)
    time_s, positions_m, velocities_m_s = system.truth[-1]
    system.truth.append((time_s, positions_m, velocities_m_s + 2.0))
    assert [text for text in violations(scenario, system, report) if "still moves at" in text]


def test_a_seed_is_one_scenario_and_one_flight_to_the_bit():
    seed = next(seed for seed in range(100) if draw(seed).mode is PlanningMode.CLOUD and draw(seed).mishaps)
    assert draw(seed) == draw(seed)
    assert fly(draw(seed), seed)[-1] == work(runs([seed])[0])
