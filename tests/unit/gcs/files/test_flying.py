"""A plan of another tool as a flight: what it amounts to, and what keeps it from being flown."""

import msgspec
import numpy as np
import pytest

from gcs.errors import BadFile
from gcs.files.document import MAV_FRAME_RELATIVE_INT, Circle, Place, PlanDocument, Polygon
from gcs.files.flying import mission_of, plan_of
from missions.frames import GeodeticPoint, LocalFrame
from missions.mission import Mission, OnArrival
from missions.mission_items import DEG_E7, MAV_FRAME_MISSION, MissionItem

HOME = GeodeticPoint(latitude_deg=47.3977, longitude_deg=8.5456, altitude_amsl_m=488.0)
FRAME = LocalFrame(HOME)


def place(east_m: float, north_m: float) -> Place:
    found = FRAME.geodetic(np.array([east_m, north_m, 0.0]))
    return Place(found.latitude_deg, found.longitude_deg)


def item(command: int, east_m: float, north_m: float, height_m: float, **values: float) -> MissionItem:
    where = place(east_m, north_m)
    x, y = round(where.latitude_deg * DEG_E7), round(where.longitude_deg * DEG_E7)
    return MissionItem(command=command, frame=MAV_FRAME_RELATIVE_INT, x=x, y=y, z=height_m, **values)


def other(command: int, **values: float) -> MissionItem:
    return MissionItem(command=command, frame=MAV_FRAME_MISSION, **values)


def square(size_m: float, centre_m: float = 0.0) -> tuple[Place, ...]:
    low, high = centre_m - size_m, centre_m + size_m
    return place(low, low), place(low, high), place(high, high), place(high, low)


PLAN = PlanDocument(
    items=(item(22, 0, 0, 10), item(16, 0, 30, 15, param1=2.0), item(16, 40, 30, 15), item(21, 40, 0, 0)),
    home=HOME,
    hover_speed_m_s=4.0,
    polygons=(Polygon(corners=square(100.0)),),
    circles=(Circle(centre=place(-50, -50), radius_m=20.0, inclusion=False),),
)


def flown(document: PlanDocument) -> Mission:
    return mission_of(document, "x.plan", 3, set_parameters=False)


def test_a_plan_becomes_a_flight_of_one_vehicle_from_its_home():
    mission = flown(PLAN)
    assert (mission.vehicles[0].sysid, mission.vehicles[0].pad_m, mission.origin) == (3, (0.0, 0.0, 0.0), HOME)
    assert (mission.on_arrival, mission.takeoff_height_m, mission.limits.cruise_speed_m_s) == (
        OnArrival.LAND,
        10.0,
        4.0,
    )
    np.testing.assert_allclose(mission.targets[0].position_m, [40.0, 0.0, 0.0], atol=0.05)
    assert mission.limits.endurance_s > 120.0 + 3 * (2.0 + 100.0 / 4.0)


def test_its_items_are_stored_as_they_are():
    part = plan_of(PLAN, flown(PLAN)).vehicles[0]
    assert part.given is not None
    assert part.given.items == PLAN.items
    assert [one.command for one in part.given.fence] == [5001] * 4 + [5004]
    np.testing.assert_allclose(part.curve_m[2], [0.0, 30.0, 15.0], atol=0.05)


def test_the_mission_can_be_read_by_the_programs_that_are_started():
    assert msgspec.json.decode(msgspec.json.encode(flown(PLAN)), type=Mission) == flown(PLAN)


@pytest.mark.parametrize(("last", "arrival"), [(other(20), OnArrival.RTL), (item(16, 9, 9, 9), OnArrival.HOLD)])
def test_its_last_item_says_how_it_ends(last: MissionItem, arrival: OnArrival):
    assert flown(msgspec.structs.replace(PLAN, items=(*PLAN.items[:3], last))).on_arrival is arrival


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"home": None}, "does not say where home is"),
        ({"items": ()}, "nowhere to fly to"),
        ({"items": (*PLAN.items, item(84, 0, 0, 10))}, "item 4: command 84 is not flown"),
        ({"items": (*PLAN.items, other(177, param1=0.0, param2=-1.0))}, "the flight would never end"),
        ({"items": (item(16, 0, 2000, 10),), "polygons": ()}, "first place within 900 m of home, found 2000 m"),
        ({"items": (*PLAN.items, item(16, 0, 20_000, 10)), "polygons": ()}, "legs of at most 10000 m"),
        ({"items": (item(16, 0, 20, 1500),)}, "expected 0 to 1000 m above home, found 0 to 1500 m"),
        ({"items": (item(16, 0, 20, -30),)}, "above home, found -30"),
        ({"polygons": (Polygon(corners=square(20.0)),)}, "the way leaves a fence polygon"),
        ({"polygons": (Polygon(corners=square(8.0, 35.0), inclusion=False),)}, "the way enters a fence polygon"),
        ({"circles": (Circle(centre=place(20, 30), radius_m=5.0, inclusion=False),)}, "enters a fence circle"),
        ({"circles": (Circle(centre=place(0, 0), radius_m=20.0),)}, "leaves a fence circle"),
        ({"polygons": (Polygon(corners=tuple(square(50.0)[i] for i in (0, 2, 1, 3))),)}, "crosses itself"),
    ],
)
def test_what_must_not_be_flown_is_refused_before_anything_is_sent(changes: dict, says: str):
    with pytest.raises(BadFile, match=says):
        flown(msgspec.structs.replace(PLAN, **changes))
