"""The soak's own promises: seeds are drawn and flown the same way each time, and violations are found."""

from collections import deque
from dataclasses import replace

import msgspec
import pytest

from gcs.experiments.experiment import Run
from gcs.flight.monitor import Phase
from gcs.settings import PlanningMode
from missions.faults import LinkFault, MotorFailure, SimulatedLink
from sitl.dynamics.state import Crash
from sitl.simulator import Collision
from tests.soak import experiment
from tests.soak.census import crowds
from tests.soak.invariants import excused, violations
from tests.soak.scenario import Scenario, draw


def test_a_seed_is_one_scenario_and_seeds_differ():
    stories = [draw(seed).story for seed in range(40)]
    assert stories == [draw(seed).story for seed in range(40)]
    assert len(set(stories)) > 35


def test_all_kinds_of_faults_and_modes_are_drawn():
    text = " ".join(draw(seed).story for seed in range(300))
    kinds = ["companion-kill", "companion-hang", "gps-loss", "motor-failure", "battery", "reboot", "weather"]
    for word in [*kinds, "sensor-noise", "link", "pillar", "disk-full", "second-station", "namesake", "onboard"]:
        assert word in text, word


def easy(scenario: Scenario) -> bool:
    link = scenario.truth.simulation.ground_link
    return scenario.mode is PlanningMode.CLOUD and not scenario.faults and link.loss < 0.1 and link.delay_s < 0.3


@pytest.fixture(scope="module")
def flown():
    """The quickest kind of flight: the cloud's plan alone, over a good link."""
    seed = next(seed for seed in range(1000) if easy(draw(seed)))
    scenario = draw(seed)
    return scenario, *experiment.fly(scenario, seed), seed


def test_a_flight_without_trouble_arrives_and_breaks_nothing_and_is_the_same_again(flown):
    scenario, _, _, row, seed = flown
    assert (row["success"], row["violations"]) == (True, "")
    assert experiment.fly(scenario, seed)[-1]["fingerprint"] == row["fingerprint"]


def test_what_must_not_happen_is_found(flown):
    scenario, system, report, _, _ = flown
    system.truth = [(t_s, at_m + [30.0, 0.0, 0.0], v_m_s * 3.0) for t_s, at_m, v_m_s in system.truth]
    system.flight.vehicles[1].monitor.phase = Phase.FLYING
    found = " ".join(violations(scenario, system, report))
    for words in ("outside of its flight range", "m/s", "has arrived, says the ground station", "is flying at the end"):
        assert words in found


def test_what_companions_must_not_do_is_found(flown):
    scenario, system, report, _, _ = flown
    with_companions = replace(scenario, mode=PlanningMode.END_CLOUD)
    system.truth = [(t_s, at_m[[0, 0]] + [0.0, 0.0, 1.0], v_m_s * 3.0) for t_s, at_m, v_m_s in system.truth]
    found = " ".join(violations(with_companions, system, report))
    for words in ("vehicles 1 and 2 were 0.00 m apart", "its autopilot accelerated vehicle 1 by"):
        assert words in found


def test_who_has_no_radio_is_not_kept_at_a_distance_but_must_not_be_hit(flown, monkeypatch: pytest.MonkeyPatch):
    scenario, system, report, _, _ = flown
    since_s = system.simulator.first_takeoff_s
    beside = [(t_s, at_m[[0, 0]] + [0.0, 0.0, 1.0], v_m_s) for t_s, at_m, v_m_s in system.truth if t_s > since_s]
    monkeypatch.setattr(system, "truth", beside)
    for blackout_s, judged in ((600.0, False), (1.0, True)):
        dark = LinkFault(link=SimulatedLink.FLEET, vehicle=2, blackout_s=blackout_s, at_s=0.0)
        simulation = msgspec.structs.replace(scenario.truth.simulation, faults=(dark,))
        truth = msgspec.structs.replace(scenario.truth, simulation=simulation)
        mute = replace(scenario, mode=PlanningMode.END_CLOUD, truth=truth)
        assert ("0.00 m apart" in " ".join(violations(mute, system, report))) == judged
    touched = Collision(since_s + 0.5, 1, Crash.VEHICLE, (0.0, 0.0, 1.0), "2")
    monkeypatch.setattr(system.simulator, "collisions", [touched])
    assert "collision" in " ".join(violations(mute, system, report))


def test_what_piles_up_is_found_wherever_it_is(flown):
    _, system, *_ = flown
    assert not list(crowds({"station": system.station}, most=500))
    fleet = system.station.fleet
    fleet.queue, fleet.heap = deque(range(501), maxlen=501), list(range(501))
    assert list(crowds({"station": system.station}, most=500)) == [("station.fleet.heap", 501)]


def test_who_falls_by_a_fault_is_excused_and_nobody_else():
    scenario = next(draw(s) for s in range(300) if any(isinstance(f, MotorFailure) for f in draw(s).faults))
    (who,) = {fault.vehicle for fault in scenario.faults if isinstance(fault, MotorFailure)}
    assert excused(scenario, who, (MotorFailure,))
    assert not excused(scenario, 3 - who, (MotorFailure,))


def test_a_defect_that_raises_is_a_violation(monkeypatch: pytest.MonkeyPatch):
    def broken(*_: object) -> None:
        raise ZeroDivisionError("by this test")

    monkeypatch.setattr(experiment, "fly", broken)
    row = experiment.work(Run((("seed", 0),)))
    assert row["violations"] == "raised ZeroDivisionError: by this test"
    assert "seed 0" in experiment.summary([{"seed": 0, **row}])
