"""What plan files hold, whatever their format: a mission, fences, rally points, and where home is meant to be."""

import math
from collections.abc import Iterator
from enum import IntEnum
from typing import Annotated

import msgspec

from missions.frames import GeodeticPoint, Latitude, Longitude
from missions.mission_items import DEG_E7, MAV_FRAME_GLOBAL_INT, MAV_FRAME_MISSION, MissionItem

MAV_FRAME_GLOBAL, MAV_FRAME_RELATIVE, MAV_FRAME_TERRAIN = 0, 3, 10
MAV_FRAME_RELATIVE_INT, MAV_FRAME_TERRAIN_INT = 6, 11
WIRE_FRAME = {
    MAV_FRAME_GLOBAL: MAV_FRAME_GLOBAL_INT,
    MAV_FRAME_RELATIVE: MAV_FRAME_RELATIVE_INT,
    MAV_FRAME_TERRAIN: MAV_FRAME_TERRAIN_INT,
    MAV_FRAME_GLOBAL_INT: MAV_FRAME_GLOBAL_INT,
    MAV_FRAME_RELATIVE_INT: MAV_FRAME_RELATIVE_INT,
    MAV_FRAME_TERRAIN_INT: MAV_FRAME_TERRAIN_INT,
    MAV_FRAME_MISSION: MAV_FRAME_MISSION,
}
"""Frames as files have them -> frames as MISSION_ITEM_INT has them; others are not flown."""
FILE_FRAME = {wire: file for file, wire in WIRE_FRAME.items() if file not in {5, 6, 11}}
"""The way back."""

MOST_ITEMS = 10_000
MOST_VERTICES = 10_000
CIRCLE_CORNERS = 72


class ItemCommand(IntEnum):
    """The MAV_CMD numbers that files of plans give a meaning of their own."""

    NAV_WAYPOINT = 16
    NAV_LOITER_UNLIM = 17
    NAV_LOITER_TURNS = 18
    NAV_LOITER_TIME = 19
    NAV_RETURN_TO_LAUNCH = 20
    NAV_LAND = 21
    NAV_TAKEOFF = 22
    NAV_LOITER_TO_ALT = 31
    NAV_SPLINE_WAYPOINT = 82
    NAV_VTOL_TAKEOFF = 84
    NAV_VTOL_LAND = 85
    DO_JUMP = 177
    DO_CHANGE_SPEED = 178
    FENCE_RETURN_POINT = 5000
    FENCE_POLYGON_INCLUSION = 5001
    FENCE_POLYGON_EXCLUSION = 5002
    FENCE_CIRCLE_INCLUSION = 5003
    FENCE_CIRCLE_EXCLUSION = 5004
    RALLY_POINT = 5100


NOT_ON_THE_WAY = frozenset({20, 177, 178, 195, 197, 201})
"""Commands of items that have a global frame in some files, and are not flown to."""


class Place(msgspec.Struct, frozen=True, order=True):
    """A place on the ground (WGS84)."""

    latitude_deg: Latitude
    longitude_deg: Longitude


class Polygon(msgspec.Struct, frozen=True, kw_only=True):
    """A fence that must not be left, or not be entered; its corners are not repeated at the end."""

    corners: Annotated[tuple[Place, ...], msgspec.Meta(min_length=3, max_length=MOST_VERTICES)]
    inclusion: bool = True
    name: str = ""


class Circle(msgspec.Struct, frozen=True, kw_only=True):
    """The same, round."""

    centre: Place
    radius_m: Annotated[float, msgspec.Meta(gt=0.0, le=1e6)]
    inclusion: bool = True


class RallyPoint(msgspec.Struct, frozen=True, kw_only=True):
    """Where to go in need, at a height above home."""

    place: Place
    height_m: float


class Way(msgspec.Struct, frozen=True, kw_only=True):
    """A line that was, or is to be flown."""

    name: str
    points: tuple[GeodeticPoint, ...]


class PlanDocument(msgspec.Struct, frozen=True, kw_only=True):
    """The content of a plan file.

    `items` are as MISSION_ITEM_INT carries them, and a DO_JUMP names its target by index. `tracks` are flown ways: no
    plan, but what goes with one onto a map.
    """

    items: tuple[MissionItem, ...] = ()
    home: GeodeticPoint | None = None
    cruise_speed_m_s: float | None = None
    hover_speed_m_s: float | None = None
    polygons: tuple[Polygon, ...] = ()
    circles: tuple[Circle, ...] = ()
    breach_return: GeodeticPoint | None = None
    rally: tuple[RallyPoint, ...] = ()
    tracks: tuple[Way, ...] = ()

    @property
    def contents(self) -> list[str]:
        """What is in it, in words."""
        counts = [
            (len(self.items), "mission item"),
            (len(self.polygons), "fence polygon"),
            (len(self.circles), "fence circle"),
            (int(self.breach_return is not None), "fence return point"),
            (len(self.rally), "rally point"),
            (len(self.tracks), "track"),
        ]
        return [f"{count} {what}{'s' if count > 1 else ''}" for count, what in counts if count]

    def way(self) -> Iterator[tuple[int, GeodeticPoint]]:
        """Yield index and place of every item that is flown to; heights above home are added to home's altitude.

        Raises:
            ValueError: an altitude counts from home, or from the terrain, and it is not known where that is.
        """
        for index, item in enumerate(self.items):
            if item.frame == MAV_FRAME_MISSION or item.command in NOT_ON_THE_WAY or (item.x, item.y) == (0, 0):
                continue
            yield index, self._place(index, item)

    def _place(self, index: int, item: MissionItem) -> GeodeticPoint:
        altitude_m = item.z
        if item.frame == MAV_FRAME_TERRAIN_INT:
            raise ValueError(f"item {index}: its altitude counts from the terrain, which is not known here")
        if item.frame == MAV_FRAME_RELATIVE_INT:
            if self.home is None:
                raise ValueError(
                    f"item {index}: its altitude counts from home, and the file does not say where that is"
                )
            altitude_m += self.home.altitude_amsl_m
        return GeodeticPoint(latitude_deg=item.x / DEG_E7, longitude_deg=item.y / DEG_E7, altitude_amsl_m=altitude_m)

    def fence_items(self) -> tuple[MissionItem, ...]:
        """The fence as MAVLink stores it."""
        items: list[MissionItem] = []
        for polygon in self.polygons:
            inside = ItemCommand.FENCE_POLYGON_INCLUSION, ItemCommand.FENCE_POLYGON_EXCLUSION
            command, count = inside[not polygon.inclusion], float(len(polygon.corners))
            items += [item_at(command, corner, param1=count) for corner in polygon.corners]
        for circle in self.circles:
            inside = ItemCommand.FENCE_CIRCLE_INCLUSION, ItemCommand.FENCE_CIRCLE_EXCLUSION
            items.append(item_at(inside[not circle.inclusion], circle.centre, param1=circle.radius_m))
        if self.breach_return is not None:
            back = self.breach_return
            place = Place(back.latitude_deg, back.longitude_deg)
            items.append(item_at(ItemCommand.FENCE_RETURN_POINT, place, z=back.altitude_amsl_m))
        return tuple(items)

    def rally_items(self) -> tuple[MissionItem, ...]:
        """The rally points as MAVLink stores them."""
        return tuple(item_at(ItemCommand.RALLY_POINT, point.place, z=point.height_m) for point in self.rally)


def item_at(command: int, place: Place, *, param1: float = 0.0, z: float = 0.0) -> MissionItem:
    """An item at a place, its altitude above home."""
    return MissionItem(
        command=command,
        frame=MAV_FRAME_RELATIVE_INT,
        param1=param1,
        x=round(place.latitude_deg * DEG_E7),
        y=round(place.longitude_deg * DEG_E7),
        z=z,
    )


def item_from_file(command: int, frame: int, params: tuple[float, ...]) -> MissionItem:
    """An item from a file's seven parameters, those of a place in degrees.

    Raises:
        ValueError: it cannot be flown; says what was expected and found.
    """
    if frame not in WIRE_FRAME:
        raise ValueError(f"expected a global frame or MAV_FRAME_MISSION ({sorted(WIRE_FRAME)}), found frame {frame}")
    if not 0 <= command <= 0xFFFF:
        raise ValueError(f"expected a command of 0 to 65535, found {command}")
    x, y = (_coordinate(value, name, frame) for value, name in zip(params[4:6], ("latitude", "longitude"), strict=True))
    for number, value in enumerate(params, start=1):
        if math.isinf(value) or (math.isnan(value) and number > 4) or abs(value) > 1e9:
            raise ValueError(f"expected parameter {number} to be a number that can be flown, found {value}")
    return MissionItem(
        command=command,
        frame=WIRE_FRAME[frame],
        param1=params[0],
        param2=params[1],
        param3=params[2],
        param4=params[3],
        x=x,
        y=y,
        z=params[6],
    )


def params_for_file(item: MissionItem) -> tuple[float, ...]:
    """The way back: seven parameters, those of a place in degrees."""
    scale = 1.0 if item.frame == MAV_FRAME_MISSION else DEG_E7
    x, y = (item.x, item.y) if scale == 1.0 else (item.x / scale, item.y / scale)
    return (item.param1, item.param2, item.param3, item.param4, float(x), float(y), item.z)


def _coordinate(value: float, name: str, frame: int) -> int:
    limit = 90.0 if name == "latitude" else 180.0
    if frame == MAV_FRAME_MISSION:
        if not (math.isfinite(value) and value.is_integer() and abs(value) < 2**31):
            raise ValueError(f"expected a whole number in the place of the {name} in MAV_FRAME_MISSION, found {value}")
        return int(value)
    if not abs(value) <= limit:
        raise ValueError(f"expected a {name} of -{limit:g} to {limit:g} deg, found {value}")
    return round(value * DEG_E7)
