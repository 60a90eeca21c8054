"""What goes wrong in the flight of a seed: links, faults of vehicles and companions, weather, an unmapped pillar."""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import msgspec
import numpy as np

from gcs.settings import PlanningMode
from missions.faults import (
    BatteryLevel,
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

T = TypeVar("T")
Rng = np.random.Generator

LOSSES = (0.0, 0.0, 0.02, 0.1, 0.3, 0.5)
DELAYS_S = (0.0, 0.05, 0.3, 1.0, 2.0)
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
    """

    mode: PlanningMode
    mission: Mission
    truth: Mission
    companion_faults: tuple[Fault, ...]

    @property
    def faults(self) -> tuple[Fault | SimulatorFault, ...]:
        return (*self.truth.simulation.faults, *self.companion_faults)

    @property
    def story(self) -> str:
        """What goes wrong, in one line."""
        links = {kind: getattr(self.truth.simulation, f"{kind}_link") for kind in ("ground", "onboard", "fleet")}
        disturbed = [f"{kind} {_named(link)}" for kind, link in links.items() if link != LinkSettings()]
        unmapped = [thing.name for thing in self.truth.world.cylinders if not thing.known]
        return "; ".join([self.mode.value, *disturbed, *unmapped, *(_named(fault) for fault in self.faults)])


def draw(seed: int) -> Scenario:
    """The scenario of a seed."""
    rng = np.random.default_rng([seed, 77])
    mode = _one_of(rng, (PlanningMode.END_CLOUD,) * 3 + (PlanningMode.CLOUD, PlanningMode.ONBOARD))
    mission = _room(rng)
    with_companions = mode.needs_companions
    truth = _with_a_pillar(mission, rng) if with_companions and rng.random() < 0.5 else mission
    drawn = [_one_of(rng, FAULTS)(rng) for _ in range(int(rng.integers(0, MOST_FAULTS + 1)))]
    ends = tuple(fault for fault in drawn if isinstance(fault, Fault)) if with_companions else ()
    simulation = msgspec.structs.replace(
        mission.simulation,
        ground_link=_ground_link(rng),
        fleet_link=_fleet_link(rng),
        faults=tuple(fault for fault in drawn if isinstance(fault, SimulatorFault)),
    )
    return Scenario(
        mode,
        msgspec.structs.replace(mission, simulation=simulation),
        msgspec.structs.replace(truth, simulation=simulation),
        ends,
    )


@functools.cache
def _indoor() -> Mission:
    return load_mission("indoor")


def _room(rng: Rng) -> Mission:
    """The paper's room with its two obstacles somewhat elsewhere."""
    mission = _indoor()
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
        blackouts=(Blackout(from_s=_moment(rng), duration_s=_one_of(rng, BLACKOUTS_S)),) if dark else (),
    )


def _fleet_link(rng: Rng) -> LinkSettings:
    return LinkSettings(loss=_one_of(rng, (0.0, 0.2)), delay_s=_one_of(rng, (0.0, 0.1)))


def _moment(rng: Rng) -> float:
    return float(np.round(rng.uniform(0.0, FLIGHT_S), 1))


def _who(rng: Rng) -> int:
    return int(rng.integers(1, 3))


FAULTS: tuple[Callable[[Rng], Fault | SimulatorFault], ...] = (
    lambda rng: CompanionKill(vehicle=_who(rng), at_s=_moment(rng)),
    lambda rng: CompanionHang(vehicle=_who(rng), at_s=_moment(rng)),
    lambda rng: GpsLoss(vehicle=_who(rng), duration_s=_one_of(rng, (0.5, 3.0, None)), at_s=_moment(rng)),
    lambda rng: MotorFailure(vehicle=_who(rng), motor=int(rng.integers(1, 5)), at_s=_moment(rng)),
    lambda rng: BatteryLevel(vehicle=_who(rng), remaining=_one_of(rng, (0.03, 0.08, 0.2)), at_s=_moment(rng)),
    lambda rng: Reboot(vehicle=_who(rng), at_s=_moment(rng)),
    lambda rng: Weather(east_m_s=float(rng.normal(0, 2)), north_m_s=float(rng.normal(0, 2)), gust_std_m_s=0.5),
    lambda rng: SensorNoise(horizontal_std_m=0.08, vertical_std_m=0.08, velocity_std_m_s=0.08, at_s=_moment(rng)),
    lambda rng: LinkFault(
        link=_one_of(rng, tuple(SimulatedLink)),
        vehicle=_who(rng),
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
    words = [f"{name}={value:g}" if isinstance(value, float) else f"{name}={value}" for name, value in said]
    tag = settings.__struct_config__.tag
    return " ".join([str(tag), *words] if tag is not None else words)
