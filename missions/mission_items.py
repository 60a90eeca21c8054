"""Track points <-> MAVLink mission items: what the GCS uploads and what the companions read back out of it.

A track is the cloud's approximate plan for one vehicle: points to pass, each with the speed of the leg that leads
to it. On the wire it is a mission of DO_CHANGE_SPEED and NAV_WAYPOINT items, without a take-off item, so that
item 0 is right to fly also when a mission is swapped in flight. Altitudes go out as AMSL in MAV_FRAME_GLOBAL_INT.
"""

import struct
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum

import msgspec
import numpy as np
import numpy.typing as npt

from missions.errors import WireFormatError
from missions.frames import LocalFrame

Array = npt.NDArray[np.float64]

MAV_FRAME_MISSION = 2
"""The frame of items without a place; PX4 refuses a mission that has them in any other."""
MAV_FRAME_GLOBAL_INT = 5
DEG_E7 = 1e7


class Command(IntEnum):
    """The MAV_CMD numbers that a mission of ours is made of."""

    NAV_WAYPOINT = 16
    NAV_RETURN_TO_LAUNCH = 20
    NAV_LAND = 21
    DO_CHANGE_SPEED = 178


class MissionItem(msgspec.Struct, frozen=True, kw_only=True):
    """The content of one MISSION_ITEM_INT, without its addressing."""

    command: int
    frame: int = MAV_FRAME_GLOBAL_INT
    param1: float = 0.0
    param2: float = 0.0
    param3: float = 0.0
    param4: float = 0.0
    x: int = 0
    """Latitude [1e-7 deg]."""
    y: int = 0
    """Longitude [1e-7 deg]."""
    z: float = 0.0
    """Altitude AMSL [m]."""


@dataclass(frozen=True)
class Track:
    """One vehicle's approximate plan.

    Args:
        points_m: (n, 3) ENU points [m] in flying order, the last one the target.
        speeds_m_s: (n,) speed of the leg that leads to each point.
        item_seq: (n,) sequence number of each point's item in the mission, as MISSION_CURRENT counts.
    """

    points_m: Array
    speeds_m_s: Array
    item_seq: tuple[int, ...] = ()

    def index_of(self, seq: int) -> int:
        """Index of the first track point whose item is `seq` or later; the last one past the end."""
        for index, item in enumerate(self.item_seq):
            if item >= seq:
                return index
        return len(self.item_seq) - 1


def encode_track(
    track: Track,
    frame: LocalFrame,
    *,
    acceptance_radius_m: float,
    ground_offset_m: float = 0.0,
    ending: Command | None = None,
) -> tuple[MissionItem, ...]:
    """The mission items of a track.

    Args:
        track: what is to be flown; its `item_seq` is not read.
        frame: the mission's frame.
        acceptance_radius_m: how near counts as passed; the autopilots' default of 2 m cuts indoor corners.
        ground_offset_m: what this vehicle's altitude reads too high; added, since the autopilot will subtract it.
        ending: NAV_LAND or NAV_RETURN_TO_LAUNCH to append, where the autopilot itself ends the flight.
    """
    items: list[MissionItem] = []
    speed_m_s = 0.0
    for point_m, leg_m_s in zip(track.points_m, track.speeds_m_s, strict=True):
        if abs(leg_m_s - speed_m_s) > 0.01:
            speed_m_s = float(leg_m_s)
            # param1 = 1: ground speed; param3 = -1: leave the throttle alone
            items.append(
                MissionItem(
                    command=Command.DO_CHANGE_SPEED,
                    frame=MAV_FRAME_MISSION,
                    param1=1.0,
                    param2=round(speed_m_s, 2),
                    param3=-1.0,
                )
            )
        items.append(_at(point_m, frame, ground_offset_m, Command.NAV_WAYPOINT, acceptance_radius_m))
    if ending is Command.NAV_LAND:
        ground_m = track.points_m[-1] * np.array([1.0, 1.0, 0.0])
        items.append(_at(ground_m, frame, ground_offset_m, Command.NAV_LAND))
    elif ending is Command.NAV_RETURN_TO_LAUNCH:
        items.append(MissionItem(command=Command.NAV_RETURN_TO_LAUNCH, frame=MAV_FRAME_MISSION))
    return tuple(items)


def decode_track(items: Sequence[MissionItem], frame: LocalFrame, *, ground_offset_m: float = 0.0) -> Track:
    """The track that a mission's items describe.

    Raises:
        WireFormatError: no waypoint, an item that is not understood, or a number that cannot be flown.
    """
    points: list[Array] = []
    speeds: list[float] = []
    seqs: list[int] = []
    speed_m_s = np.nan
    for seq, item in enumerate(items):
        match item.command:
            case Command.DO_CHANGE_SPEED:
                if not 0.0 < item.param2 < 100.0:
                    raise WireFormatError(f"mission item {seq}: expected a speed in (0, 100) m/s, found {item.param2}")
                speed_m_s = item.param2
            case Command.NAV_WAYPOINT:
                points.append(_position(seq, item, frame, ground_offset_m))
                speeds.append(speed_m_s)
                seqs.append(seq)
            case Command.NAV_LAND | Command.NAV_RETURN_TO_LAUNCH:
                if seq != len(items) - 1:
                    raise WireFormatError(f"mission item {seq}: expected command {item.command} to be the last item")
            case _:
                raise WireFormatError(f"mission item {seq}: command {item.command} is not understood")
    if not points:
        raise WireFormatError("the mission has no waypoint")
    return Track(np.array(points), np.array(speeds), tuple(seqs))


def plan_id(items: Sequence[MissionItem]) -> int:
    """CRC-32 over what is flown: equal on both ends of a link exactly if the missions are equal; 0 for none."""
    return zlib.crc32(b"".join(_significant(items))) if items else 0


def _significant(items: Sequence[MissionItem]) -> Iterator[bytes]:
    """Command, place and the two parameters that we use, as they travel (float32); yaw NaNs are left out."""
    for item in items:
        yield struct.pack("<HBiifff", item.command, item.frame, item.x, item.y, item.z, item.param1, item.param2)


def _at(
    point_m: Array,
    frame: LocalFrame,
    ground_offset_m: float,
    command: Command,
    acceptance_radius_m: float = 0.0,
) -> MissionItem:
    place = frame.geodetic(point_m)
    return MissionItem(
        command=command,
        param2=acceptance_radius_m,
        param4=float("nan"),  # the autopilot's own choice of yaw
        x=round(place.latitude_deg * DEG_E7),
        y=round(place.longitude_deg * DEG_E7),
        z=round(place.altitude_amsl_m + ground_offset_m, 3),
    )


def _position(seq: int, item: MissionItem, frame: LocalFrame, ground_offset_m: float) -> Array:
    if item.frame != MAV_FRAME_GLOBAL_INT:
        raise WireFormatError(f"mission item {seq}: expected frame {MAV_FRAME_GLOBAL_INT} (AMSL), found {item.frame}")
    latitude_deg, longitude_deg, altitude_m = item.x / DEG_E7, item.y / DEG_E7, item.z - ground_offset_m
    if not (abs(latitude_deg) <= 90.0 and abs(longitude_deg) <= 180.0 and abs(altitude_m) < 1e5):
        raise WireFormatError(f"mission item {seq}: ({latitude_deg}, {longitude_deg}, {altitude_m} m) is no place")
    return frame.enu(latitude_deg, longitude_deg, altitude_m)
