"""A plan of another tool as a flight of ours: by one vehicle's autopilot, the items stored exactly as they are.

The mission around it is made here: where the vehicle stands (the planned home), how fast it flies (the plan's hover
speed), its range and endurance (three times what the plan needs), and the flight range (everything the plan touches).
"""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
import shapely

from gcs.errors import BadFile
from gcs.files.document import ItemCommand, Place, PlanDocument
from gcs.files.shapes import circle_corners
from gcs.planner.plan import FleetPlan, GivenItems, VehiclePlan
from missions.frames import LocalFrame
from missions.mission import Limits, Mission, OnArrival, Site, Target, Vehicle
from missions.mission_items import Track
from missions.world import Bounds, World

Array = npt.NDArray[np.float64]

FLOWN = frozenset(
    {16, 17, 19, 20, 21, 22, 31, 93, 112, 177, 178, 195, 197, 201, 203, 205, 206, 214, 530, 531, 532}
    | {1000, 1001, 2000, 2001, 2003, 2500, 2501}
)
"""MAV_CMD numbers that a multirotor's autopilot flies or passes over."""
DEFAULT_SPEED_M_S = 5.0
FARTHEST_FIRST_M, LONGEST_LEG_M, HIGHEST_M = 900.0, 10_000.0, 1_000.0
RESERVE = 3.0
MARGIN_M = 50.0
LEAST_TAKEOFF_M, MOST_TAKEOFF_M = 2.5, 30.0
ENDINGS: dict[int, OnArrival] = {
    ItemCommand.NAV_LAND: OnArrival.LAND,
    ItemCommand.NAV_RETURN_TO_LAUNCH: OnArrival.RTL,
}


def mission_of(document: PlanDocument, name: str, sysid: int, *, set_parameters: bool) -> Mission:
    """The mission that a plan amounts to.

    Args:
        document: the plan.
        name: of its file, for errors.
        sysid: of the vehicle that flies it.
        set_parameters: consent to setting the autopilot's safety parameters.

    Raises:
        BadFile: it cannot be flown; says everything that is wrong.
    """
    wrong = list(problems(document))
    if wrong:
        raise BadFile(name, "", "; ".join(wrong))
    assert document.home is not None
    way_m = _way_m(document)
    speed_m_s = document.hover_speed_m_s or DEFAULT_SPEED_M_S
    length_m = _length_m(way_m)
    low_m, high_m = way_m.min(axis=0) - MARGIN_M, way_m.max(axis=0) + MARGIN_M
    end_m = way_m[-1]
    return Mission(
        name=f"plan-{sysid}",
        description=f"{name}, planned elsewhere",
        site=Site.OUTDOOR,
        origin=document.home,
        world=World(
            bounds=Bounds(
                east_m=(_m(low_m[0]), _m(high_m[0])),
                north_m=(_m(low_m[1]), _m(high_m[1])),
                up_m=(_m(min(low_m[2], -MARGIN_M)), _m(high_m[2])),
            )
        ),
        vehicles=(Vehicle(name=f"vehicle {sysid}", sysid=sysid, pad_m=(0.0, 0.0, 0.0)),),
        targets=(Target(name="end", position_m=(_m(end_m[0]), _m(end_m[1]), _m(end_m[2]))),),
        takeoff_height_m=_m(min(max(float(way_m[1, 2]), LEAST_TAKEOFF_M), MOST_TAKEOFF_M)),
        on_arrival=ENDINGS.get(document.items[-1].command, OnArrival.HOLD),
        limits=Limits(
            cruise_speed_m_s=speed_m_s,
            avoidance_speed_m_s=speed_m_s,
            avoidance_distance_m=0.0,
            clearance_m=0.0,
            separation_m=0.0,
            range_m=_m(RESERVE * length_m + 100.0),
            endurance_s=_m(RESERVE * (length_m / speed_m_s + _waits_s(document)) + 120.0),
        ),
        set_parameters=set_parameters,
    )


def plan_of(document: PlanDocument, mission: Mission) -> FleetPlan:
    """What is flown: the plan's way as a curve for the page, its items for the autopilot."""
    way_m = _way_m(document)
    vehicle, speed_m_s = mission.vehicles[0], mission.limits.cruise_speed_m_s
    times_s = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(way_m, axis=0), axis=1)))) / speed_m_s
    part = VehiclePlan(
        name=vehicle.name,
        sysid=vehicle.sysid,
        targets=mission.targets,
        curve_m=way_m,
        times_s=times_s,
        track=Track(way_m[1:], np.full(len(way_m) - 1, speed_m_s)),
        length_m=_length_m(way_m),
        given=GivenItems(document.items, document.fence_items(), document.rally_items()),
    )
    return FleetPlan(mission.name, "given", 0, 0, 0.0, 0.0, part.length_m, True, (), (), (part,))


def problems(document: PlanDocument) -> Iterator[str]:
    """Yield a phrase for everything that keeps a plan from being flown."""
    if document.home is None:
        yield "it does not say where home is"
        return
    for index, item in enumerate(document.items):
        if item.command not in FLOWN:
            yield f"item {index}: command {item.command} is not flown by a multirotor here"
        if item.command == ItemCommand.DO_JUMP and not 0.0 <= item.param2 <= 1000.0:
            yield f"item {index}: expected 0 to 1000 repetitions, found {item.param2:g}: the flight would never end"
    try:
        way_m = _way_m(document)
    except ValueError as wrong:
        yield str(wrong)
        return
    if len(way_m) < 2:
        yield "there is nowhere to fly to"
        return
    legs_m = np.linalg.norm(np.diff(way_m[:, :2], axis=0), axis=1)
    if legs_m[0] > FARTHEST_FIRST_M:
        yield f"expected the first place within {FARTHEST_FIRST_M:g} m of home, found {legs_m[0]:.0f} m"
    if legs_m.max() > LONGEST_LEG_M:
        yield f"expected legs of at most {LONGEST_LEG_M:g} m, found {legs_m.max():.0f} m"
    if way_m[:, 2].min() < -1.0 or way_m[:, 2].max() > HIGHEST_M:
        yield f"expected 0 to {HIGHEST_M:g} m above home, found {way_m[:, 2].min():.0f} to {way_m[:, 2].max():.0f} m"
    yield from _outside(document, way_m)


def _outside(document: PlanDocument, way_m: Array) -> Iterator[str]:
    """Yield what of the way breaks the plan's own fence."""
    line = shapely.LineString(way_m[:, :2])
    for polygon in document.polygons:
        yield from _breach(_area(document, polygon.corners), polygon.inclusion, line, "polygon")
    for circle in document.circles:
        yield from _breach(_area(document, tuple(circle_corners(circle))), circle.inclusion, line, "circle")


def _breach(area: shapely.Polygon, inclusion: bool, line: shapely.LineString, what: str) -> Iterator[str]:
    if not area.is_valid:
        yield f"a fence {what} crosses itself"
    elif inclusion and not area.covers(line):
        yield f"the way leaves a fence {what} that it must stay inside of"
    elif not inclusion and area.intersects(line):
        yield f"the way enters a fence {what} that it must keep out of"


def _area(document: PlanDocument, corners: tuple[Place, ...]) -> shapely.Polygon:
    assert document.home is not None
    frame = LocalFrame(document.home)
    latitudes, longitudes = (
        np.array(part) for part in zip(*((c.latitude_deg, c.longitude_deg) for c in corners), strict=True)
    )
    return shapely.Polygon(frame.enu(latitudes, longitudes, document.home.altitude_amsl_m)[:, :2])


def _way_m(document: PlanDocument) -> Array:
    """(n, 3) ENU around home: home itself, then every place that is flown to."""
    assert document.home is not None
    frame = LocalFrame(document.home)
    places = [place for _, place in document.way()]
    points = [frame.enu(p.latitude_deg, p.longitude_deg, p.altitude_amsl_m) for p in places]
    return np.array([np.zeros(3), *points])


def _length_m(way_m: Array) -> float:
    return float(np.linalg.norm(np.diff(way_m, axis=0), axis=1).sum())


def _waits_s(document: PlanDocument) -> float:
    """How long a plan waits at its places."""
    waits = {ItemCommand.NAV_WAYPOINT, ItemCommand.NAV_LOITER_TIME, 93, 112}
    return sum(item.param1 for item in document.items if item.command in waits and 0.0 < item.param1 < 3600.0)


def _m(value: float) -> float:
    """Millimetres are enough."""
    return round(float(value), 3)
