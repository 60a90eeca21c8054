"""What goes wrong in the flight of a seed: links, vehicles, companions, the ground station, weather, a wrong map."""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import TypeVar

import msgspec
import numpy as np

from gcs.flight.monitor import Phase
from gcs.settings import PlanningMode
from missions.faults import (
    BatteryLevel,
    ClockJump,
    CompanionHang,
    CompanionKill,
    Fault,
    GpsLoss,
    LinkFault,
    MotorFailure,
    Reboot,
    SensorNoise,
    SimulatedLink,
    SimulatorFault,
    Weather,
)
from missions.mission import Blackout, LinkSettings, Mission, contradictions, load_mission
from missions.world import Cylinder
from tests.soak.mishaps import (
    CompanionRestart,
    DiskFull,
    GroundCrash,
    GroundHang,
    LidarSilence,
    Mishap,
    Namesake,
    OtherOrder,
    SecondStation,
    Timed,
    WallClockJump,
)

T = TypeVar("T")
Rng = np.random.Generator

LOSSES = (0.0, 0.0, 0.02, 0.1, 0.3, 0.5)
DELAYS_S = (0.0, 0.0, 0.0, 0.05, 0.05, 0.05, 0.3, 0.3, 0.3, 0.3, 1.0, 2.0)
"""Long ones are rare: an upload takes minutes on them, with everybody on the ground."""
CORRUPTIONS = (0.0, 0.0, 0.01, 0.1)
FLEETS = (2,) * 12 + (3, 4)
"""How many fly."""
BLACKOUTS_S = (1.0, 10.0, 60.0)
MOST_FAULTS = 2
FLIGHT_S = 18.0
"""Faults come between the take-off and about when vehicles that nothing happens to have arrived."""


@dataclass(frozen=True)
class Scenario:
    """One flight.

    Args:
        mode: who plans.
        mission: what everybody reads.
        truth: what the simulator flies in.
        companion_faults: what ends companions.
        mishaps: what else goes wrong.
    """

    mode: PlanningMode
    mission: Mission
    truth: Mission
    companion_faults: tuple[Fault, ...]
    mishaps: tuple[Mishap, ...]

    @property
    def faults(self) -> tuple[Fault | SimulatorFault, ...]:
        return (*self.truth.simulation.faults, *self.companion_faults)

    @property
    def story(self) -> str:
        """What goes wrong, in one line."""
        simulated = self.truth.simulation
        links = {"ground": simulated.ground_link, "onboard-link": simulated.onboard_link, "fleet": simulated.fleet_link}
        disturbed = [f"{kind} {_named(link)}" for kind, link in links.items() if link != LinkSettings()]
        unmapped = [thing.name for thing in self.truth.world.cylinders if not thing.known]
        fleet = [f"fleet-of {len(self.mission.vehicles)}"] if len(self.mission.vehicles) > 2 else []
        told = [_named(trouble) for trouble in (*self.faults, *self.mishaps)]
        return "; ".join([self.mode.value, *fleet, *disturbed, *unmapped, *told])


def draw(seed: int) -> Scenario:
    """The scenario of a seed."""
    rng = np.random.default_rng([seed, 77])
    mode = _one_of(rng, (PlanningMode.END_CLOUD,) * 3 + (PlanningMode.CLOUD, PlanningMode.ONBOARD))
    n = _one_of(rng, FLEETS)
    mission = _room(rng, n)
    with_companions = mode.needs_companions
    truth = _with_a_pillar(mission, rng) if with_companions and rng.random() < 0.5 else mission
    drawn = [_one_of(rng, FAULTS)(rng, n) for _ in range(int(rng.integers(0, MOST_FAULTS + 1)))]
    ends = tuple(fault for fault in drawn if isinstance(fault, Fault)) if with_companions else ()
    simulation = msgspec.structs.replace(
        mission.simulation,
        ground_link=_ground_link(rng),
        onboard_link=LinkSettings(corruption=_one_of(rng, (0.0, 0.0, 0.0, 0.01))),
        fleet_link=_fleet_link(rng),
        faults=tuple(fault for fault in drawn if isinstance(fault, SimulatorFault)),
    )
    return Scenario(
        mode,
        msgspec.structs.replace(mission, simulation=simulation),
        msgspec.structs.replace(truth, simulation=simulation),
        ends,
        (*_restarts(rng, ends), *_mishaps(rng, n, with_companions)),
    )


@functools.cache
def _fleet_of(n: int) -> Mission:
    """The paper's two vehicles, or as many of the ten that cross its room to permuted targets."""
    if n == 2:
        return load_mission("indoor")
    mission = load_mission("fleet-10")
    vehicles, routes = mission.vehicles[:n], mission.routes
    assert routes is not None
    flown = {vehicle.name: routes[vehicle.name] for vehicle in vehicles}
    targets = tuple(target for target in mission.targets if any(target.name in route for route in flown.values()))
    return msgspec.structs.replace(mission, vehicles=vehicles, targets=targets, allocation=flown)


def _room(rng: Rng, n: int) -> Mission:
    """The paper's room with its two obstacles somewhat elsewhere."""
    mission = _fleet_of(n)
    (crate,), (column,) = mission.world.boxes, mission.world.cylinders
    while True:
        east_m, north_m = rng.uniform(-1.0, 1.0, 2)
        here = (crate.centre_m[0] + float(east_m), crate.centre_m[1] + float(north_m), crate.centre_m[2])
        there = (column.centre_m[0] + float(rng.uniform(-1, 1)), column.centre_m[1] + float(rng.uniform(-1, 1)))
        world = msgspec.structs.replace(
            mission.world,
            boxes=(msgspec.structs.replace(crate, centre_m=here),),
            cylinders=(msgspec.structs.replace(column, centre_m=there),),
        )
        moved = msgspec.structs.replace(mission, world=world, sensor=_coarse(mission))
        if not list(contradictions(moved)):
            return moved


def _coarse(mission: Mission):
    """Fewer rays less often, so that more flights fit into an hour."""
    return msgspec.structs.replace(mission.sensor, spacing_deg=6.0, rate_hz=5.0)


def _with_a_pillar(mission: Mission, rng: Rng) -> Mission:
    """An obstacle that no map shows, anywhere between pads and targets, away from what is there."""
    while True:
        centre_m = (float(rng.uniform(4.0, 16.0)), float(rng.uniform(3.0, 12.0)))
        pillar = Cylinder(name="pillar", centre_m=centre_m, radius_m=0.5, top_m=4.0, known=False)
        world = msgspec.structs.replace(mission.world, cylinders=(*mission.world.cylinders, pillar))
        placed = msgspec.structs.replace(mission, world=world)
        if not list(contradictions(placed)):
            return placed


def _ground_link(rng: Rng) -> LinkSettings:
    dark = rng.random() < 0.3
    return LinkSettings(
        loss=_one_of(rng, LOSSES),
        delay_s=_one_of(rng, DELAYS_S),
        jitter_s=_one_of(rng, (0.0, 0.02, 0.2)),
        duplicates=_one_of(rng, (0.0, 0.1)),
        reorder=_one_of(rng, (0.0, 0.1)),
        corruption=_one_of(rng, CORRUPTIONS),
        blackouts=(Blackout(from_s=_moment(rng), duration_s=_one_of(rng, BLACKOUTS_S)),) if dark else (),
    )


def _fleet_link(rng: Rng) -> LinkSettings:
    return LinkSettings(loss=_one_of(rng, (0.0, 0.2)), delay_s=_one_of(rng, (0.0, 0.1)))


def _moment(rng: Rng) -> float:
    return float(np.round(rng.uniform(0.0, FLIGHT_S), 1))


def _who(rng: Rng, n: int) -> int:
    return int(rng.integers(1, n + 1))


def _restarts(rng: Rng, ends: tuple[Fault, ...]) -> list[Mishap]:
    """Every second companion that a fault ends is started again."""
    vehicles = sorted({fault.vehicle for fault in ends})
    return [
        CompanionRestart(vehicle=sysid, down_s=_one_of(rng, (0.5, 3.0))) for sysid in vehicles if rng.random() < 0.5
    ]


def _mishaps(rng: Rng, n: int, with_companions: bool) -> list[Mishap]:
    """One in some flights; a sensor fails only where there is one."""
    if rng.random() > MISHAPS_SHARE:
        return []
    phase, after_s = _one_of(rng, MISHAP_PHASES), float(np.round(rng.uniform(0.0, 6.0), 1))
    mishap = _one_of(rng, MISHAPS)(rng, n, phase, after_s)
    return [] if isinstance(mishap, LidarSilence) and not with_companions else [mishap]


MISHAPS_SHARE = 0.5
MISHAP_PHASES = (Phase.WAITING, Phase.PREPARED, Phase.TAKING_OFF, Phase.FLYING, Phase.FLYING, Phase.DONE)
MISHAPS: tuple[Callable[[Rng, int, Phase, float], Timed], ...] = (
    lambda rng, n, phase, after_s: GroundCrash(phase=phase, after_s=after_s, down_s=_one_of(rng, (1.0, 5.0, 20.0))),
    lambda rng, n, phase, after_s: GroundHang(phase=phase, after_s=after_s, lasts_s=_one_of(rng, (0.5, 2.0, 8.0))),
    lambda rng, n, phase, after_s: WallClockJump(phase=phase, after_s=after_s, by_s=_one_of(rng, CLOCK_JUMPS_S)),
    lambda rng, n, phase, after_s: LidarSilence(
        vehicle=_who(rng, n), phase=phase, after_s=after_s, lasts_s=_one_of(rng, (0.3, 1.0, 5.0))
    ),
    lambda rng, n, phase, after_s: DiskFull(phase=phase, after_s=after_s),
    lambda rng, n, phase, after_s: SecondStation(
        vehicle=_who(rng, n), phase=phase, after_s=after_s, order=_one_of(rng, tuple(OtherOrder))
    ),
    lambda rng, n, phase, after_s: Namesake(
        vehicle=_who(rng, n), phase=phase, after_s=after_s, lasts_s=_one_of(rng, (2.0, 10.0))
    ),
)
CLOCK_JUMPS_S = (-3600.0, -2.0, 0.5, 2.0, 1e5)

FAULTS: tuple[Callable[[Rng, int], Fault | SimulatorFault], ...] = (
    lambda rng, n: CompanionKill(vehicle=_who(rng, n), at_s=_moment(rng)),
    lambda rng, n: CompanionHang(vehicle=_who(rng, n), at_s=_moment(rng)),
    lambda rng, n: GpsLoss(vehicle=_who(rng, n), duration_s=_one_of(rng, (0.5, 3.0, None)), at_s=_moment(rng)),
    lambda rng, n: MotorFailure(vehicle=_who(rng, n), motor=int(rng.integers(1, 5)), at_s=_moment(rng)),
    lambda rng, n: BatteryLevel(vehicle=_who(rng, n), remaining=_one_of(rng, (0.03, 0.08, 0.2)), at_s=_moment(rng)),
    lambda rng, n: ClockJump(vehicle=_who(rng, n), by_s=_one_of(rng, CLOCK_JUMPS_S), at_s=_moment(rng)),
    lambda rng, n: Reboot(vehicle=_who(rng, n), at_s=_moment(rng)),
    lambda rng, n: Weather(east_m_s=float(rng.normal(0, 2)), north_m_s=float(rng.normal(0, 2)), gust_std_m_s=0.5),
    lambda rng, n: SensorNoise(horizontal_std_m=0.08, vertical_std_m=0.08, velocity_std_m_s=0.08, at_s=_moment(rng)),
    lambda rng, n: LinkFault(
        link=_one_of(rng, tuple(SimulatedLink)),
        vehicle=_who(rng, n),
        blackout_s=_one_of(rng, BLACKOUTS_S),
        at_s=_moment(rng),
    ),
)
"""Each as likely as the others."""


def _one_of(rng: Rng, choices: tuple[T, ...]) -> T:
    return choices[int(rng.integers(len(choices)))]


def _named(settings: msgspec.Struct) -> str:
    """What differs from the defaults."""
    values = ((field, getattr(settings, field.name)) for field in msgspec.structs.fields(settings))
    said = ((field.name, value) for field, value in values if value != field.default)
    words = [f"{name}={_told(value)}" for name, value in said]
    tag = settings.__struct_config__.tag
    return " ".join([str(tag), *words] if tag is not None else words)


def _told(value: object) -> str:
    if isinstance(value, Enum):
        return str(value.value)
    return f"{value:g}" if isinstance(value, float) else str(value)
