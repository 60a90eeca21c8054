"""What holds in every flight, whatever goes wrong; each violation is a sentence."""

from collections.abc import Iterator
from itertools import combinations, pairwise

import numpy as np
import numpy.typing as npt

from gcs.fleet.vehicle_state import LandedState
from gcs.flight.monitor import Phase
from gcs.flight.report import FlightReport
from missions.faults import (
    GpsLoss,
    LinkFault,
    MotorFailure,
    Reboot,
    SensorNoise,
    SimulatedLink,
    SimulatorFault,
    Weather,
)
from sitl.autopilot.modes import Mode
from sitl.dynamics.state import Crash
from sitl.fleet import TICK_S
from sitl.simulator import Collision
from tests.soak.census import crowds
from tests.soak.scenario import Scenario
from tests.soak.troubled_system import TroubledSystem

Array = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

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

AIRBORNE_M = 0.3
SEPARATION_SHARE = 0.8
"""Of the mission's separation: plans keep it, tracking errors come on top."""
UNANNOUNCED_S = 0.6, 3.0
"""Before and after a vehicle in motion leaves Offboard. Its setpoints may have ended half a second ago; the others rely
on its last announced plan for 1.5 s, and need the rest for braking. Collisions count at all times."""
HEARD_AGAIN_S = 3.0
"""Plans that crossed each other while a radio was dark are made anew, and flown."""
IN_MOTION_M_S = 0.3
BLIND_S = 8.0
"""After it left Offboard in motion a vehicle is braked by its autopilot, which sees nothing, for so long."""
ACCELERATION_WINDOW_S = 0.2
ACCELERATION_SHARE = 1.5
"""Of the mission's limit, which is what is planned with: in brakings the autopilot's own corrections come on top."""
AUTOPILOTS_ACCELERATION_M_S2 = 5.5
"""MPC_ACC_HOR_MAX is 5."""
TAKING_OVER_S = 0.5
MOST_KEPT = 500
"""Things in any one container of a program, after minutes of flight."""


def violations(scenario: Scenario, system: TroubledSystem, report: FlightReport) -> list[str]:
    """All that should not have happened, a sentence each."""
    return [
        *_collisions(scenario, system),
        *_out_of_bounds(scenario, system),
        *_too_fast(scenario, system),
        *_beliefs(scenario, system),
        *_too_near(scenario, system),
        *_too_hard(scenario, system),
        *(f"believed to be stored, and was not: {belief}" for belief in system.false_beliefs),
        *system.mistakes,
        *(f"{path} holds {number} things" for path, number in crowds(_kept(system), MOST_KEPT)),
        *_endings(scenario, system, report),
    ]


def excused(scenario: Scenario, sysid: int, kinds: tuple[type[SimulatorFault], ...]) -> bool:
    """Whether one of these faults was its, or everybody's."""
    return any(isinstance(f, kinds) and getattr(f, "vehicle", None) in {None, sysid} for f in scenario.faults)


def _collisions(scenario: Scenario, system: TroubledSystem) -> Iterator[str]:
    for crash in system.simulator.collisions:
        involved = [sysid for sysid in system.simulator.vehicles if _is_in(crash, sysid)]
        if not _was_blind(system, crash) and not any(excused(scenario, sysid, FALLING + ASTRAY) for sysid in involved):
            yield f"collision: {crash}"


def _is_in(crash: Collision, sysid: int) -> bool:
    """Whether this vehicle hit something, or was hit."""
    return sysid == crash.sysid or (crash.other.isdigit() and sysid == int(crash.other))


def _was_blind(system: TroubledSystem, crash: Collision) -> bool:
    """The autopilot alone flew, straight home on somebody's order or braking after its companion's end."""
    at = min(round(crash.time_s / TICK_S), len(system.truth) - 1)
    modes = [mode for since_s, mode in system.modes_in_truth[crash.sysid] if since_s <= crash.time_s]
    alone = modes[-1] is Mode.RTL or bool(_breaks_its_word(system, crash.sysid, after_s=BLIND_S)[at])
    return crash.what is Crash.OBSTACLE and alone


def _out_of_bounds(scenario: Scenario, system: TroubledSystem) -> Iterator[str]:
    bounds, margin_m = scenario.truth.world.bounds, scenario.truth.site.fence_margin_m
    for sysid, flown in system.flown().items():
        if excused(scenario, sysid, FALLING + ASTRAY):
            continue
        beyond_m = np.maximum(bounds.low_enu_m - flown.positions_m, flown.positions_m - bounds.high_enu_m)[:, :2].max()
        if beyond_m > margin_m:
            yield f"vehicle {sysid} was {beyond_m:.1f} m outside of its flight range"
        above_m = float(flown.positions_m[:, 2].max() - bounds.high_enu_m[2])
        if above_m > 0.0:
            yield f"vehicle {sysid} was {above_m:.1f} m above its flight range"


def _too_fast(scenario: Scenario, system: TroubledSystem) -> Iterator[str]:
    limit_m_s = SPEED_SHARE * scenario.truth.limits.cruise_speed_m_s
    for sysid, flown in system.flown().items():
        if excused(scenario, sysid, FALLING + ASTRAY + PUSHED):
            continue
        fastest_m_s = float(np.linalg.norm(flown.velocities_m_s[:, :2], axis=1).max(initial=0.0))
        if fastest_m_s > limit_m_s:
            yield f"vehicle {sysid} flew {fastest_m_s:.2f} m/s"


def _too_near(scenario: Scenario, system: TroubledSystem) -> Iterator[str]:
    """Companions keep their vehicles apart in the air; autopilots that fly missions by themselves see nobody."""
    if not scenario.mode.needs_companions:
        return
    least_m = SEPARATION_SHARE * scenario.truth.limits.separation_m
    for (one, there), (other, here) in combinations(system.flown().items(), 2):
        if any(excused(scenario, sysid, FALLING + ASTRAY + PUSHED) for sysid in (one, other)):
            continue
        judged = np.minimum(there.positions_m[:, 2], here.positions_m[:, 2]) > AIRBORNE_M
        for sysid in (one, other):
            judged &= ~(_breaks_its_word(system, sysid) | _says_nothing(scenario, system, sysid))
        apart_m = np.linalg.norm(there.positions_m - here.positions_m, axis=1)[judged]
        if apart_m.min(initial=np.inf) < least_m:
            yield f"vehicles {one} and {other} were {apart_m.min():.2f} m apart"


def _breaks_its_word(system: TroubledSystem, sysid: int, after_s: float = UNANNOUNCED_S[1]) -> BoolArray:
    """When a vehicle does not fly any more what its companion announced, and the others cannot have noticed."""
    flown, before_s = system.flown()[sysid], UNANNOUNCED_S[0]
    broken = np.zeros(len(flown.times_s), bool)
    for (_, mode), (left_s, _) in pairwise(system.modes_in_truth[sysid]):
        velocity_m_s = flown.velocities_m_s[min(np.searchsorted(flown.times_s, left_s), len(broken) - 1)]
        if mode is Mode.OFFBOARD and np.linalg.norm(velocity_m_s) > IN_MOTION_M_S:
            broken |= (flown.times_s > left_s - before_s) & (flown.times_s < left_s + after_s)
    return broken


def _says_nothing(scenario: Scenario, system: TroubledSystem, sysid: int) -> BoolArray:
    """When a vehicle's radio is dark, and until it is heard again: what it plans meanwhile nobody can keep clear of."""
    times_s, taken_off_s = system.flown()[sysid].times_s, system.simulator.first_takeoff_s
    mute = np.zeros(len(times_s), bool)
    for fault in scenario.faults:
        if isinstance(fault, LinkFault) and fault.link is SimulatedLink.FLEET and fault.vehicle in {None, sysid}:
            since_s = (fault.at_s or 0.0) + (taken_off_s or 0.0)
            mute |= (times_s > since_s) & (times_s < since_s + fault.blackout_s + HEARD_AGAIN_S)
    return mute


def _too_hard(scenario: Scenario, system: TroubledSystem) -> Iterator[str]:
    """What companions order stays within the mission's acceleration, what autopilots do by themselves within theirs."""
    window = round(ACCELERATION_WINDOW_S / TICK_S)
    for sysid, flown in system.flown().items():
        if excused(scenario, sysid, FALLING + ASTRAY + PUSHED):
            continue
        change_m_s = flown.velocities_m_s[window:] - flown.velocities_m_s[:-window]
        pushed_m_s2 = np.linalg.norm(change_m_s[:, :2], axis=1) / ACCELERATION_WINDOW_S
        pushed_m_s2[flown.positions_m[window:, 2] < AIRBORNE_M] = 0.0  # the ground pushes as hard as it likes
        crashed_s = min((crash.time_s for crash in system.simulator.collisions if _is_in(crash, sysid)), default=np.inf)
        pushed_m_s2[flown.times_s[window:] >= crashed_s] = 0.0  # and so does what it has hit: see `_collisions`
        by_companion = _in_offboard(system, sysid, flown.times_s[window:])
        limits_m_s2 = ACCELERATION_SHARE * scenario.truth.limits.acceleration_m_s2, AUTOPILOTS_ACCELERATION_M_S2
        for whose, flies, limit_m_s2 in zip(
            ("its companion", "its autopilot"), (by_companion, ~by_companion), limits_m_s2, strict=True
        ):
            hardest_m_s2 = pushed_m_s2[flies].max(initial=0.0)
            if hardest_m_s2 > limit_m_s2:
                yield f"{whose} accelerated vehicle {sysid} by {hardest_m_s2:.1f} m/s^2"


def _in_offboard(system: TroubledSystem, sysid: int, times_s: Array) -> BoolArray:
    """When a companion flew, from half a second after it took over until it gave back."""
    changes = system.modes_in_truth[sysid]
    ends_s = [*(time_s for time_s, _ in changes[1:]), np.inf]
    spans = [(begin_s, end_s) for (begin_s, mode), end_s in zip(changes, ends_s, strict=True) if mode is Mode.OFFBOARD]
    inside = [(times_s > begin_s + TAKING_OVER_S) & (times_s < end_s) for begin_s, end_s in spans]
    return np.any(inside, axis=0) if inside else np.zeros(len(times_s), bool)


def _kept(system: TroubledSystem) -> dict[str, object]:
    """Where something could pile up."""
    companions = {f"companion {sysid}": companion for sysid, companion in system.companions.items()}
    return {"station": system.station, "flight": system.flight, "simulator": system.simulator, **companions}


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
