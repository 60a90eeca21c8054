"""QGroundControl's `.plan`: JSON with a mission, a geofence and rally points.

Of complex items (surveys, corridor scans) the simple items are used that QGroundControl has written down beside them;
a complex item without them is refused. https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html
"""

import math
from typing import Any, TypeVar, cast

import msgspec

from gcs.errors import BadFile
from gcs.files.document import (
    FILE_FRAME,
    MOST_ITEMS,
    Circle,
    ItemCommand,
    Place,
    PlanDocument,
    Polygon,
    RallyPoint,
    item_from_file,
    params_for_file,
)
from missions.frames import GeodeticPoint
from missions.mission_items import MAV_FRAME_MISSION, MissionItem

T = TypeVar("T")

PX4, QUADROTOR = 12, 2
Params = tuple[float | None, float | None, float | None, float | None, float | None, float | None, float | None]


class _SimpleItem(msgspec.Struct, rename="camel"):
    """One mission item."""

    command: int
    frame: int
    params: Params
    auto_continue: bool = True
    do_jump_id: int | None = None


class _Circle(msgspec.Struct):
    """Centre and radius."""

    center: tuple[float, float]
    radius: float


class _FenceCircle(msgspec.Struct):
    """A round fence."""

    circle: _Circle
    inclusion: bool


class _FencePolygon(msgspec.Struct):
    """A fence with corners."""

    polygon: list[tuple[float, float]]
    inclusion: bool


class _Fence(msgspec.Struct, rename="camel"):
    """The geofence."""

    circles: list[_FenceCircle] = []
    polygons: list[_FencePolygon] = []
    breach_return: tuple[float, float, float] | None = None
    version: int = 2


class _Rally(msgspec.Struct):
    """Rally points."""

    points: list[tuple[float, float, float]] = []
    version: int = 2


class _Mission(msgspec.Struct, rename="camel"):
    """The mission; its items are simple or complex."""

    items: list[dict[str, Any]]
    version: int
    planned_home_position: tuple[float, float, float] | None = None
    cruise_speed: float | None = None
    hover_speed: float | None = None


class _Plan(msgspec.Struct, rename="camel"):
    """The file."""

    file_type: str
    version: int
    mission: _Mission
    geo_fence: _Fence = msgspec.field(default_factory=_Fence)
    rally_points: _Rally = msgspec.field(default_factory=_Rally)


def parse_plan(data: bytes, name: str) -> PlanDocument:
    """Read a `.plan`.

    Raises:
        BadFile: naming the place, what was expected and what was found.
    """
    try:
        plan = msgspec.json.decode(data, type=_Plan)
    except (msgspec.DecodeError, msgspec.ValidationError, UnicodeDecodeError, RecursionError) as wrong:
        raise BadFile(name, "", f"{wrong}".replace("`", "")) from None
    expected = [("fileType", plan.file_type, "Plan"), ("version", plan.version, 1)]
    expected += [("mission.version", plan.mission.version, 2), ("geoFence.version", plan.geo_fence.version, 2)]
    expected += [("rallyPoints.version", plan.rally_points.version, 2)]
    for key, found, wanted in expected:
        if found != wanted:
            raise BadFile(name, key, f"expected {wanted!r}, found {found!r}")
    return _Reader(name).document(plan)


def format_plan(document: PlanDocument) -> str:
    """The text of a `.plan`."""
    home = document.home
    mission = {
        "cruiseSpeed": document.cruise_speed_m_s or 15.0,
        "firmwareType": PX4,
        "globalPlanAltitudeMode": 1,
        "hoverSpeed": document.hover_speed_m_s or 5.0,
        "items": [_item(index, item) for index, item in enumerate(document.items)],
        "plannedHomePosition": _triple(home) if home is not None else [0.0, 0.0, 0.0],
        "vehicleType": QUADROTOR,
        "version": 2,
    }
    fence: dict[str, Any] = {
        "circles": [_circle(circle) for circle in document.circles],
        "polygons": [_polygon(polygon) for polygon in document.polygons],
        "version": 2,
    }
    if document.breach_return is not None:
        fence["breachReturn"] = _triple(document.breach_return)
    rally = [[p.place.latitude_deg, p.place.longitude_deg, p.height_m] for p in document.rally]
    plan = {
        "fileType": "Plan",
        "geoFence": fence,
        "groundStation": "QGroundControl",
        "mission": mission,
        "rallyPoints": {"points": rally, "version": 2},
        "version": 1,
    }
    return msgspec.json.format(msgspec.json.encode(plan), indent=4).decode() + "\n"


class _Reader:
    """Turns what was decoded into a document; its errors name the key."""

    def __init__(self, name: str) -> None:
        self._name = name

    def document(self, plan: _Plan) -> PlanDocument:
        mission, fence = plan.mission, plan.geo_fence
        home = self._home(mission)
        polygons = enumerate(fence.polygons)
        return PlanDocument(
            items=self._items(mission.items),
            home=home,
            cruise_speed_m_s=self._speed("mission.cruiseSpeed", mission.cruise_speed),
            hover_speed_m_s=self._speed("mission.hoverSpeed", mission.hover_speed),
            polygons=tuple(self._polygon(f"geoFence.polygons[{index}]", one) for index, one in polygons),
            circles=tuple(self._circle(f"geoFence.circles[{index}]", c) for index, c in enumerate(fence.circles)),
            breach_return=self._point("geoFence.breachReturn", fence.breach_return) if fence.breach_return else None,
            rally=tuple(self._rally(f"rallyPoints.points[{i}]", p) for i, p in enumerate(plan.rally_points.points)),
        )

    def _home(self, mission: _Mission) -> GeodeticPoint | None:
        """0/0/0 is what is written where there is none."""
        home = mission.planned_home_position
        return self._point("mission.plannedHomePosition", home) if home is not None and any(home) else None

    def _items(self, raw: list[dict[str, Any]]) -> tuple[MissionItem, ...]:
        found = [one for index, item in enumerate(raw) for one in self._simple(f"mission.items[{index}]", item)]
        if len(found) > MOST_ITEMS:
            raise BadFile(self._name, "mission.items", f"expected at most {MOST_ITEMS} items, found {len(found)}")
        indices = {item.do_jump_id: index for index, (_, item) in enumerate(found) if item.do_jump_id is not None}
        return tuple(self._item(key, item, indices) for key, item in found)

    def _simple(self, key: str, raw: dict[str, Any]) -> list[tuple[str, _SimpleItem]]:
        """One simple item, or those that a complex one was expanded into."""
        if raw.get("type") == "SimpleItem":
            return [(key, self._decoded(key, raw, _SimpleItem))]
        kind = raw.get("complexItemType", raw.get("type"))
        if raw.get("type") != "ComplexItem":
            raise BadFile(self._name, f"{key}.type", f"expected SimpleItem or ComplexItem, found {kind!r}")
        for parent, path in ((raw.get("TransectStyleComplexItem"), "TransectStyleComplexItem.Items"), (raw, "Items")):
            items = cast(dict[str, Any], parent).get("Items") if isinstance(parent, dict) else None
            if isinstance(items, list) and items:
                expanded = [(f"{key}.{path}[{index}]", item) for index, item in enumerate(cast(list[object], items))]
                return [(place, self._decoded(place, item, _SimpleItem)) for place, item in expanded]
        problem = f"the file does not hold the items of this complex item ({kind!r}): expected them in {key}.Items"
        raise BadFile(self._name, key, f"{problem}; it cannot be flown without")

    def _item(self, key: str, item: _SimpleItem, indices: dict[int, int]) -> MissionItem:
        if not item.auto_continue:
            raise BadFile(self._name, f"{key}.autoContinue", "expected true, found false: no autopilot here waits so")
        params = [math.nan if value is None else value for value in item.params]
        if item.frame == MAV_FRAME_MISSION or item.command in {ItemCommand.NAV_RETURN_TO_LAUNCH}:
            params[4:] = [0.0 if math.isnan(value) else value for value in params[4:]]
        try:
            built = item_from_file(item.command, item.frame, tuple(params))
        except ValueError as wrong:
            raise BadFile(self._name, key, str(wrong)) from None
        if item.command != ItemCommand.DO_JUMP:
            return built
        target = item.params[0]
        if target is None or target not in indices:
            raise BadFile(self._name, f"{key}.params[0]", f"expected the doJumpId of an item, found {target}")
        return msgspec.structs.replace(built, param1=float(indices[int(target)]))

    def _decoded(self, key: str, raw: object, kind: type[_SimpleItem]) -> _SimpleItem:
        try:
            return msgspec.convert(raw, kind)
        except msgspec.ValidationError as wrong:
            raise BadFile(self._name, key, f"{wrong}".replace("`", "")) from None

    def _polygon(self, key: str, raw: _FencePolygon) -> Polygon:
        corners = [self._place(f"{key}.polygon[{index}]", corner) for index, corner in enumerate(raw.polygon)]
        return self._checked(key, Polygon, corners=tuple(corners), inclusion=raw.inclusion)

    def _circle(self, key: str, raw: _FenceCircle) -> Circle:
        centre = self._place(f"{key}.circle.center", raw.circle.center)
        return self._checked(
            f"{key}.circle", Circle, centre=centre, radius_m=raw.circle.radius, inclusion=raw.inclusion
        )

    def _rally(self, key: str, raw: tuple[float, float, float]) -> RallyPoint:
        point = self._point(key, raw)
        return RallyPoint(place=Place(point.latitude_deg, point.longitude_deg), height_m=point.altitude_amsl_m)

    def _place(self, key: str, raw: tuple[float, float]) -> Place:
        return self._checked(key, Place, latitude_deg=raw[0], longitude_deg=raw[1])

    def _point(self, key: str, raw: tuple[float, float, float]) -> GeodeticPoint:
        return self._checked(key, GeodeticPoint, latitude_deg=raw[0], longitude_deg=raw[1], altitude_amsl_m=raw[2])

    def _speed(self, key: str, speed_m_s: float | None) -> float | None:
        if speed_m_s is not None and not 0.0 < speed_m_s <= 200.0:
            raise BadFile(self._name, key, f"expected a speed in (0, 200] m/s, found {speed_m_s}")
        return speed_m_s

    def _checked(self, key: str, kind: type[T], **values: Any) -> T:
        """A struct from values that may lie outside of what it allows."""
        try:
            return msgspec.convert({name: msgspec.to_builtins(value) for name, value in values.items()}, kind)
        except msgspec.ValidationError as wrong:
            raise BadFile(self._name, key, f"{wrong}, found {list(values.values())}".replace("`", "")) from None


def _item(index: int, item: MissionItem) -> dict[str, Any]:
    params = [None if math.isnan(value) else value for value in params_for_file(item)]
    if item.command == ItemCommand.DO_JUMP:
        params[0] = item.param1 + 1.0
    return {
        "autoContinue": True,
        "command": item.command,
        "doJumpId": index + 1,
        "frame": FILE_FRAME[item.frame],
        "params": params,
        "type": "SimpleItem",
    }


def _circle(circle: Circle) -> dict[str, Any]:
    centre = [circle.centre.latitude_deg, circle.centre.longitude_deg]
    return {"circle": {"center": centre, "radius": circle.radius_m}, "inclusion": circle.inclusion, "version": 1}


def _polygon(polygon: Polygon) -> dict[str, Any]:
    corners = [[corner.latitude_deg, corner.longitude_deg] for corner in polygon.corners]
    return {"inclusion": polygon.inclusion, "polygon": corners, "version": 1}


def _triple(point: GeodeticPoint) -> list[float]:
    return [point.latitude_deg, point.longitude_deg, point.altitude_amsl_m]
