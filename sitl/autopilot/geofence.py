"""The geofence: polygons and circles from an uploaded plan, a cylinder around home, and what lies outside of them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from missions.mission_items import MissionItem
from sitl.autopilot.craft import Craft
from sitl.autopilot.places import LocalPoint
from sitl.autopilot.plan import (
    PLACES,
    Cmd,
    Plan,
    altitude_amsl_m,
    has_place,
    latitude_deg,
    longitude_deg,
)

_POLYGONS = (Cmd.FENCE_POLYGON_INCLUSION, Cmd.FENCE_POLYGON_EXCLUSION)
_CIRCLES = (Cmd.FENCE_CIRCLE_INCLUSION, Cmd.FENCE_CIRCLE_EXCLUSION)


@dataclass(frozen=True)
class Polygon:
    """A closed polygon of (x, y) corners in the autopilot's NED frame [m]."""

    corners_m: tuple[tuple[float, float], ...]

    def contains(self, x_m: float, y_m: float) -> bool:
        """By the even-odd rule."""
        inside = False
        x0, y0 = self.corners_m[-1]
        for x1, y1 in self.corners_m:
            if (y1 > y_m) != (y0 > y_m) and x_m < (x0 - x1) * (y_m - y1) / (y0 - y1) + x1:
                inside = not inside
            x0, y0 = x1, y1
        return inside


@dataclass(frozen=True)
class Circle:
    """A disc in the autopilot's NED frame [m]."""

    x_m: float
    y_m: float
    radius_m: float

    def contains(self, x_m: float, y_m: float) -> bool:
        return math.hypot(x_m - self.x_m, y_m - self.y_m) <= self.radius_m


@dataclass(frozen=True)
class Zone:
    """An area to stay inside of, or outside of."""

    area: Polygon | Circle
    inclusion: bool


class Geofence:
    """The fence of one vehicle."""

    def __init__(self, craft: Craft) -> None:
        self._craft = craft
        self._zones: tuple[Zone, ...] = ()
        self.plan = Plan()

    def set_plan(self, plan: Plan) -> None:
        """Take a new fence; items that form no area are left out, as PX4 does."""
        self.plan = plan
        self._zones = tuple(self._read(plan.items))

    def allows(self, point: LocalPoint) -> bool:
        """Whether a point lies inside of all that the fence demands."""
        return self._in_cylinder(point) and self.zones_allow(point)

    def zones_allow(self, point: LocalPoint) -> bool:
        """Whether a point lies in one of the inclusion zones, if there are any, and in no exclusion zone."""
        within = [zone for zone in self._zones if zone.area.contains(point.x_m, point.y_m)]
        if any(not zone.inclusion for zone in within):
            return False
        return bool(within) or not any(zone.inclusion for zone in self._zones)

    def first_outside(self, items: Sequence[MissionItem]) -> int | None:
        """Index of the first mission item whose place the fence does not allow."""
        for seq, item in enumerate(items):
            if item.command not in PLACES and item.command != Cmd.NAV_LAND:
                continue
            altitude_m = altitude_amsl_m(item, self._craft.home_altitude_m)
            if has_place(item) and not self.allows(
                self._craft.frame.local(latitude_deg(item), longitude_deg(item), altitude_m)
            ):
                return seq
        return None

    def _in_cylinder(self, point: LocalPoint) -> bool:
        """GF_MAX_HOR_DIST and GF_MAX_VER_DIST around home; 0 is no limit."""
        p, home = self._craft.parameters, self._craft.home
        across_m = math.hypot(point.x_m - home.x_m, point.y_m - home.y_m)
        widest_m, highest_m = p["GF_MAX_HOR_DIST"], p["GF_MAX_VER_DIST"]
        return (widest_m <= 0.0 or across_m <= widest_m) and (highest_m <= 0.0 or home.z_m - point.z_m <= highest_m)

    def _read(self, items: Sequence[MissionItem]) -> list[Zone]:
        zones: list[Zone] = []
        index = 0
        while index < len(items):
            item = items[index]
            if item.command in _POLYGONS:
                count = int(item.param1) if math.isfinite(item.param1) else 0
                corners = items[index : index + count]
                if count >= 3 and len(corners) == count and all(c.command == item.command for c in corners):
                    area = Polygon(tuple(self._place(corner) for corner in corners))
                    zones.append(Zone(area, item.command == Cmd.FENCE_POLYGON_INCLUSION))
                index += max(count, 1)
            else:
                if item.command in _CIRCLES and item.param1 > 0.0:
                    area = Circle(*self._place(item), item.param1)
                    zones.append(Zone(area, item.command == Cmd.FENCE_CIRCLE_INCLUSION))
                index += 1
        return zones

    def _place(self, item: MissionItem) -> tuple[float, float]:
        point = self._craft.frame.local(latitude_deg(item), longitude_deg(item), 0.0)
        return point.x_m, point.y_m
