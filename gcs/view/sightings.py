"""The fleet as it is drawn: who is where, in the frame of the page; pure."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from types import MappingProxyType
from typing import NamedTuple, overload

import numpy as np
import numpy.typing as npt

from gcs.desk import Desk
from gcs.fleet.vehicle_state import VehicleState
from gcs.flight.vehicle_flight import VehicleFlight
from gcs.view.colours import Rgb, vehicle_colour
from missions.frames import LocalFrame, quaternion_enu_from_flu

Array = npt.NDArray[np.float64]


class Sighting(NamedTuple):
    """One vehicle that has a place.

    Args:
        position_m: (3,) ENU.
        wxyz: (4,) rotation of its body (x forward, y left, z up) to ENU.
    """

    state: VehicleState
    name: str
    colour: Rgb
    position_m: Array
    wxyz: Array

    @property
    def sysid(self) -> int:
        return self.state.sysid


@dataclass(frozen=True, eq=False)
class Sightings(Sequence[Sighting]):
    """All vehicles that have a place, in the fleet's order: as arrays for what draws them all, and one by one.

    Args:
        positions_m: (n, 3) ENU.
        wxyz: (n, 4) rotations of their bodies to ENU.
    """

    states: list[VehicleState] = field(default_factory=list[VehicleState])
    names: list[str] = field(default_factory=list[str])
    colours: list[Rgb] = field(default_factory=list[Rgb])
    positions_m: Array = field(default_factory=lambda: np.zeros((0, 3)))
    wxyz: Array = field(default_factory=lambda: np.zeros((0, 4)))
    sysids: list[int] = field(default_factory=list[int])

    def __len__(self) -> int:
        return len(self.states)

    def __iter__(self) -> Iterator[Sighting]:
        return map(Sighting, self.states, self.names, self.colours, self.positions_m, self.wxyz)

    @overload
    def __getitem__(self, index: int) -> Sighting: ...
    @overload
    def __getitem__(self, index: slice) -> list[Sighting]: ...
    def __getitem__(self, index: int | slice) -> Sighting | list[Sighting]:
        return list(self)[index]


def frame_of(desk: Desk) -> LocalFrame | None:
    """The frame of the page: that of the trails, which may have been moved, or the mission's; None if there is none."""
    if desk.trails is not None:
        return desk.trails.frame
    return desk.mission.frame if desk.mission is not None else None


def vehicle_order(desk: Desk) -> list[int]:
    """System ids in the fleet's order: those of the mission first, then whoever else was heard."""
    planned = [vehicle.sysid for vehicle in desk.mission.vehicles] if desk.mission is not None else []
    return planned + sorted(desk.vehicles.keys() - set(planned))


def vehicle_names(desk: Desk) -> Mapping[int, str]:
    """What to call each vehicle, by system id, in the fleet's order."""
    vehicles = desk.mission.vehicles if desk.mission is not None else ()
    return _names(tuple((vehicle.sysid, vehicle.name) for vehicle in vehicles), tuple(desk.vehicles))


def vehicle_colours(sysids: Iterable[int]) -> Mapping[int, Rgb]:
    """One colour per vehicle of an order."""
    return _colours(tuple(sysids))


def sightings(desk: Desk) -> Sightings:
    """All vehicles that have told where they are, in the fleet's order; none before there is a frame."""
    frame, names, vehicles = frame_of(desk), vehicle_names(desk), desk.vehicles
    sysids = [sysid for sysid in names if sysid in vehicles and vehicles[sysid].place is not None]
    if frame is None or not sysids:
        return Sightings()
    states = [vehicles[sysid] for sysid in sysids]
    parts = desk.flight.vehicles if desk.flight is not None else {}
    places = [state.place for state in states if state.place is not None]
    positions_m = frame.enu(
        [place.latitude_deg for place in places],
        [place.longitude_deg for place in places],
        [p.altitude_amsl_m - _ground_offset_m(parts.get(sysid)) for p, sysid in zip(places, sysids, strict=True)],
    )
    colours = vehicle_colours(names)
    return Sightings(
        states,
        [names[sysid] for sysid in sysids],
        [colours[sysid] for sysid in sysids],
        positions_m,
        quaternion_enu_from_flu(np.array([state.attitude_wxyz for state in states])),
        sysids,
    )


@lru_cache(maxsize=8)
def _names(planned: tuple[tuple[int, str], ...], heard: tuple[int, ...]) -> Mapping[int, str]:
    """The names, which are asked for many times before a vehicle joins."""
    named = dict(planned)
    return MappingProxyType(named | {sysid: f"vehicle {sysid}" for sysid in sorted(set(heard) - set(named))})


@lru_cache(maxsize=8)
def _colours(sysids: tuple[int, ...]) -> Mapping[int, Rgb]:
    return MappingProxyType({sysid: vehicle_colour(index) for index, sysid in enumerate(sysids)})


def _ground_offset_m(part: VehicleFlight | None) -> float:
    return part.monitor.ground_offset_m if part is not None else 0.0
