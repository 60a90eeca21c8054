"""The fleet as it is drawn: who is where, in the frame of the page; pure."""

from collections.abc import Iterable
from typing import NamedTuple

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


def frame_of(desk: Desk) -> LocalFrame | None:
    """The frame of the page: that of the trails, which may have been moved, or the mission's; None if there is none."""
    if desk.trails is not None:
        return desk.trails.frame
    return desk.mission.frame if desk.mission is not None else None


def vehicle_order(desk: Desk) -> list[int]:
    """System ids in the fleet's order: those of the mission first, then whoever else was heard."""
    planned = [vehicle.sysid for vehicle in desk.mission.vehicles] if desk.mission is not None else []
    return planned + sorted(desk.vehicles.keys() - set(planned))


def vehicle_names(desk: Desk) -> dict[int, str]:
    """What to call each vehicle, by system id, in the fleet's order."""
    named = {vehicle.sysid: vehicle.name for vehicle in desk.mission.vehicles} if desk.mission is not None else {}
    return {sysid: named.get(sysid, f"vehicle {sysid}") for sysid in vehicle_order(desk)}


def vehicle_colours(sysids: Iterable[int]) -> dict[int, Rgb]:
    """One colour per vehicle of an order."""
    return {sysid: vehicle_colour(index) for index, sysid in enumerate(sysids)}


def sightings(desk: Desk) -> list[Sighting]:
    """All vehicles that have told where they are, in the fleet's order; none before there is a frame."""
    frame, names = frame_of(desk), vehicle_names(desk)
    colours = vehicle_colours(names)
    vehicles = desk.vehicles
    placed = [(state, state.place) for sysid in names if (state := vehicles.get(sysid)) is not None]
    seen = [(state, place) for state, place in placed if place is not None]
    if frame is None or not seen:
        return []
    parts = desk.flight.vehicles if desk.flight is not None else {}
    offsets_m = np.array([_ground_offset_m(parts.get(state.sysid)) for state, _ in seen])
    geodetic = np.array([(p.latitude_deg, p.longitude_deg, p.altitude_amsl_m) for _, p in seen]).T
    positions_m = frame.enu(geodetic[0], geodetic[1], geodetic[2] - offsets_m)
    rotations = quaternion_enu_from_flu(np.array([state.attitude_wxyz for state, _ in seen]))
    return [
        Sighting(state, names[state.sysid], colours[state.sysid], position_m, wxyz)
        for (state, _), position_m, wxyz in zip(seen, positions_m, rotations, strict=True)
    ]


def _ground_offset_m(part: VehicleFlight | None) -> float:
    return part.monitor.ground_offset_m if part is not None else 0.0
