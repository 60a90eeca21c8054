"""Plans as they may come from anywhere, for property tests."""

import math

import msgspec
from hypothesis import strategies as st

from gcs.files.document import Circle, ItemCommand, Place, PlanDocument, Polygon, RallyPoint
from missions.frames import GeodeticPoint
from missions.mission_items import MAV_FRAME_MISSION, MissionItem

E7 = 10_000_000
latitudes_e7, longitudes_e7 = st.integers(-85 * E7, 85 * E7), st.integers(-180 * E7, 180 * E7)
numbers = st.floats(-1e6, 1e6, width=32)
altitudes = st.floats(-500.0, 9000.0, width=32)
places = st.builds(lambda x, y: Place(x / E7, y / E7), latitudes_e7, longitudes_e7)
points = st.builds(
    lambda place, z: GeodeticPoint(
        latitude_deg=place.latitude_deg, longitude_deg=place.longitude_deg, altitude_amsl_m=z
    ),
    places,
    altitudes,
)
known_points = points.filter(lambda p: (p.latitude_deg, p.longitude_deg, p.altitude_amsl_m) != (0.0, 0.0, 0.0))
placed_items = st.builds(
    MissionItem,
    command=st.sampled_from([16, 17, 19, 21, 22, 31, 201]),
    frame=st.sampled_from([5, 6, 11]),
    param1=numbers,
    param2=numbers,
    param3=numbers,
    param4=numbers | st.just(math.nan),
    x=latitudes_e7,
    y=longitudes_e7,
    z=altitudes,
)
other_items = st.builds(
    MissionItem,
    command=st.sampled_from([20, 93, 178, 206]),
    frame=st.just(MAV_FRAME_MISSION),
    param1=numbers,
    param2=numbers,
    param3=numbers,
    x=st.integers(-1000, 1000),
    y=st.integers(-1000, 1000),
    z=numbers,
)


@st.composite
def missions(draw: st.DrawFn) -> tuple[MissionItem, ...]:
    items = draw(st.lists(placed_items | other_items, max_size=8))
    if items and draw(st.booleans()):
        target = draw(st.integers(0, len(items) - 1))
        items.append(
            MissionItem(command=ItemCommand.DO_JUMP, frame=MAV_FRAME_MISSION, param1=float(target), param2=2.0)
        )
    return tuple(items)


polygons = st.builds(
    Polygon, corners=st.lists(places, min_size=3, max_size=6, unique=True).map(tuple), inclusion=st.booleans()
)
circles = st.builds(Circle, centre=places, radius_m=st.floats(0.5, 1e5, width=32), inclusion=st.booleans())
rallies = st.builds(RallyPoint, place=places, height_m=st.floats(-500.0, 500.0, width=32))
speeds = st.floats(0.5, 100.0, width=32)

plans = st.builds(
    PlanDocument,
    items=missions(),
    home=st.none() | known_points,
    cruise_speed_m_s=speeds,
    hover_speed_m_s=speeds,
    polygons=st.lists(polygons, max_size=3).map(tuple),
    circles=st.lists(circles, max_size=3).map(tuple),
    breach_return=st.none() | points,
    rally=st.lists(rallies, max_size=3).map(tuple),
)
bare_missions = st.builds(PlanDocument, items=missions(), home=st.none() | known_points)


def same(one: PlanDocument, other: PlanDocument) -> bool:
    """Equal, with every NaN equal to every other."""
    return msgspec.json.encode(one) == msgspec.json.encode(other)
