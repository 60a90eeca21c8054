"""How a simulation is run."""

from dataclasses import dataclass
from pathlib import Path

from missions.frames import GeodeticPoint
from missions.mission import (
    Limits,
    Mission,
    OnArrival,
    Site,
    Target,
    Vehicle,
)
from missions.world import Bounds, World
from sitl.dynamics.airframe import AirframeName

GROUND_PORT, GCS_PORT = 18570, 14550
ONBOARD_PORT, COMPANION_PORT = 14580, 14540
HIGHEST_INSTANCE_BASE = 65535 - GROUND_PORT - 250
PAD_SPACING_M = 3.0
SIH_HOME = GeodeticPoint(latitude_deg=47.3977432, longitude_deg=8.5455942, altitude_amsl_m=489.4)
"""Where PX4's simulation in hardware stands."""


@dataclass(frozen=True)
class Settings:
    """What the command line says."""

    speed: float = 1.0
    """Simulated seconds per wall-clock second; fewer when the CPU cannot keep up."""
    seed: int = 1
    truth: Path | None = None
    """CSV file for where the vehicles really are."""
    instance_base: int = 0
    """Added to all ports."""
    airframe: AirframeName = AirframeName.X500_LIKE
    supervised: bool = False
    """End when standard input does."""
    host: str = "127.0.0.1"


def open_field(n_vehicles: int, origin: GeodeticPoint = SIH_HOME) -> Mission:
    """A mission that is nothing but vehicles on pads in a row of rows, on open ground without obstacles."""
    per_row = 10
    pads = [(PAD_SPACING_M * (i % per_row), PAD_SPACING_M * (i // per_row), 0.0) for i in range(n_vehicles)]
    return Mission(
        name="open-field",
        site=Site.OUTDOOR,
        origin=origin,
        world=World(bounds=Bounds(east_m=(-1e5, 1e5), north_m=(-1e5, 1e5), up_m=(0.0, 1e4))),
        vehicles=tuple(Vehicle(name=f"vehicle-{i + 1}", sysid=i + 1, pad_m=pad) for i, pad in enumerate(pads)),
        targets=(Target(name="home", position_m=(0.0, 0.0, 10.0)),),
        takeoff_height_m=2.5,
        on_arrival=OnArrival.LAND,
        limits=Limits(
            cruise_speed_m_s=5.0,
            avoidance_speed_m_s=5.0,
            avoidance_distance_m=0.0,
            clearance_m=0.0,
            separation_m=0.0,
            range_m=1e5,
            endurance_s=1e5,
        ),
    )
