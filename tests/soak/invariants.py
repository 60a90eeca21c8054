"""What holds in every flight, whatever goes wrong; each violation is a sentence."""

from collections.abc import Iterator

import numpy as np

from gcs.fleet.vehicle_state import LandedState
from gcs.flight.monitor import Phase
from gcs.flight.report import FlightReport
from missions.faults import GpsLoss, MotorFailure, Reboot, SensorNoise, SimulatorFault, Weather
from tests.soak.scenario import Scenario
from tests.soak.troubled_system import TroubledSystem

FALLING = (MotorFailure, Reboot)
"""Whoever has this falls, and may fall onto anything."""
ASTRAY = (GpsLoss,)
"""Whoever has this is not where it believes to be."""
PUSHED = (SensorNoise, Weather)
"""Whoever has this is faster at times than it wants to be."""
SPEED_SHARE = 1.05
"""Of the limit: the mission's speed is commanded, gusts and estimates come on top."""
ARRIVAL_SLACK_M = 0.3
"""Estimates are wrong by so much."""


def violations(scenario: Scenario, system: TroubledSystem, report: FlightReport) -> list[str]:
    """All that should not have happened, a sentence each."""
    return [
        *_collisions(scenario, system),
        *_out_of_bounds(scenario, system),
        *_too_fast(scenario, system),
        *_beliefs(scenario, system),
        *(f"believed to be stored, and was not: {belief}" for belief in system.false_beliefs),
        *_endings(scenario, system, report),
    ]


def excused(scenario: Scenario, sysid: int, kinds: tuple[type[SimulatorFault], ...]) -> bool:
    """Whether one of these faults was its, or everybody's."""
    return any(isinstance(f, kinds) and getattr(f, "vehicle", None) in {None, sysid} for f in scenario.faults)


def _collisions(scenario: Scenario, system: TroubledSystem) -> Iterator[str]:
    for crash in system.simulator.collisions:
        involved = {crash.sysid, int(crash.other)} if crash.other.isdigit() else {crash.sysid}
        if not any(excused(scenario, sysid, FALLING + ASTRAY) for sysid in involved):
            yield f"collision: {crash}"


def _out_of_bounds(scenario: Scenario, system: TroubledSystem) -> Iterator[str]:
    bounds, margin_m = scenario.truth.world.bounds, scenario.truth.site.fence_margin_m
    for sysid, flown in system.flown().items():
        if excused(scenario, sysid, FALLING + ASTRAY):
            continue
        beyond_m = np.maximum(bounds.low_enu_m - flown.positions_m, flown.positions_m - bounds.high_enu_m)[:, :2].max()
        if beyond_m > margin_m:
            yield f"vehicle {sysid} was {beyond_m:.1f} m outside of its flight range"


def _too_fast(scenario: Scenario, system: TroubledSystem) -> Iterator[str]:
    limit_m_s = SPEED_SHARE * scenario.truth.limits.cruise_speed_m_s
    for sysid, flown in system.flown().items():
        if excused(scenario, sysid, FALLING + ASTRAY + PUSHED):
            continue
        fastest_m_s = float(np.linalg.norm(flown.velocities_m_s[:, :2], axis=1).max(initial=0.0))
        if fastest_m_s > limit_m_s:
            yield f"vehicle {sysid} flew {fastest_m_s:.2f} m/s"


def _beliefs(scenario: Scenario, system: TroubledSystem) -> Iterator[str]:
    """The ground station never believes in an arrival that was none."""
    for sysid, part in system.flight.vehicles.items():
        if not part.monitor.reached or excused(scenario, sysid, ASTRAY):
            continue
        ended_m = system.flown()[sysid].positions_m[-1]
        missed_m = float(np.linalg.norm((ended_m - np.array(part.monitor.target.position_m))[:2]))
        if missed_m > scenario.mission.site.arrival_tolerance_m + ARRIVAL_SLACK_M:
            yield f"vehicle {sysid} has arrived, says the ground station, but ended {missed_m:.1f} m from its target"


def _endings(scenario: Scenario, system: TroubledSystem, report: FlightReport) -> Iterator[str]:
    """Every flight ends, with a reason where it failed, and leaves every vehicle on the ground or at rest."""
    if not report.success and not report.reason:
        yield "failed, and nobody says why"
    for sysid, part in system.flight.vehicles.items():
        if part.monitor.phase.in_flight and system.error is None:
            yield f"vehicle {sysid} is {part.monitor.phase.value} at the end of the flight"
        if part.monitor.phase is Phase.DONE and not part.monitor.reason:
            yield f"vehicle {sysid} is done without a reason"
    for sysid in system.simulator.vehicles:
        state = system.station.fleet.vehicles.get(sysid)
        speed_m_s = float(np.linalg.norm(system.truth[-1][2][sysid - 1])) if system.truth else 0.0
        if speed_m_s > 1.0 and not excused(scenario, sysid, FALLING + ASTRAY):
            seen = "unheard" if state is None else LandedState(state.landed).name
            yield f"vehicle {sysid} still moves at {speed_m_s:.1f} m/s at the end ({seen})"
