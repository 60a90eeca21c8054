"""Vehicles on open ground, for when no mission is named."""

from missions.frames import GeodeticPoint
from missions.mission import Limits, Mission, OnArrival, Site, Target, Vehicle
from missions.world import Bounds, World

PAD_SPACING_M = 3.0
SIH_HOME = GeodeticPoint(latitude_deg=47.3977432, longitude_deg=8.5455942, altitude_amsl_m=489.4)
"""Where PX4's simulation in hardware stands."""


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
