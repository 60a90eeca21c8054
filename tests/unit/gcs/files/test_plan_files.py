"""Plans of other tools: what is in them is flown as it stands there, or refused with place and reason."""

import json
from typing import Any

import pytest

from gcs.errors import BadFile
from gcs.files.document import Circle, Place, PlanDocument, Polygon
from gcs.files.kml import parse_kml
from gcs.files.qgc_plan import format_plan, parse_plan
from gcs.files.waypoints import format_waypoints, parse_waypoints
from missions.mission_items import MissionItem

HOME = [47.3977, 8.5456, 488.0]


def simple(command: int = 16, frame: int = 3, params: list[Any] | None = None, number: int = 1) -> dict[str, Any]:
    params = [0, 0, 0, None, 47.398, 8.546, 25] if params is None else params
    return {
        "AMSLAltAboveTerrain": None, "Altitude": 25, "AltitudeMode": 1, "autoContinue": True, "command": command,
        "doJumpId": number, "frame": frame, "params": params, "type": "SimpleItem",
    }  # fmt: skip


def plan(*items: dict[str, Any], **changes: Any) -> dict[str, Any]:
    """As QGroundControl writes it."""
    mission = {
        "cruiseSpeed": 15, "firmwareType": 12, "globalPlanAltitudeMode": 1, "hoverSpeed": 5, "items": list(items),
        "plannedHomePosition": HOME, "vehicleType": 2, "version": 2,
    }  # fmt: skip
    written = {
        "fileType": "Plan", "geoFence": {"circles": [], "polygons": [], "version": 2},
        "groundStation": "QGroundControl", "mission": mission,
        "rallyPoints": {"points": [], "version": 2}, "version": 1,
    }  # fmt: skip
    return written | changes


def read(content: Any) -> PlanDocument:
    return parse_plan(json.dumps(content).encode(), "x.plan")


def survey(*items: dict[str, Any]) -> dict[str, Any]:
    return {
        "TransectStyleComplexItem": {"CameraCalc": {}, "Items": list(items), "VisualTransectPoints": [], "version": 1},
        "complexItemType": "survey", "polygon": [], "type": "ComplexItem", "version": 5,
    }  # fmt: skip


def test_a_plan_of_qgroundcontrol_is_understood():
    found = read(plan(simple(22), simple(178, 2, [1, 5, -1, 0, 0, 0, 0]), simple(number=3), simple(20, 2, [0] * 7)))
    assert [item.command for item in found.items] == [22, 178, 16, 20]
    first = found.items[0]
    assert (first.frame, first.x, first.y, first.z) == (6, 473980000, 85460000, 25.0)
    assert first.param4 != first.param4
    assert found.home is not None
    assert found.home.altitude_amsl_m == 488.0
    assert (found.cruise_speed_m_s, found.hover_speed_m_s) == (15.0, 5.0)


def test_fences_and_rally_points_are_understood():
    fence = {
        "circles": [{"circle": {"center": [47.4, 8.5], "radius": 30.5}, "inclusion": False, "version": 1}],
        "polygons": [{"inclusion": True, "polygon": [[47.3, 8.4], [47.5, 8.4], [47.5, 8.6]], "version": 1}],
        "breachReturn": [47.4, 8.5, 50.0],
        "version": 2,
    }
    found = read(plan(geoFence=fence, rallyPoints={"points": [[47.4, 8.5, 20.0]], "version": 2}))
    assert found.circles == (Circle(centre=Place(47.4, 8.5), radius_m=30.5, inclusion=False),)
    corners = (Place(47.3, 8.4), Place(47.5, 8.4), Place(47.5, 8.6))
    assert found.polygons == (Polygon(corners=corners, inclusion=True),)
    assert [item.command for item in found.fence_items()] == [5001, 5001, 5001, 5004, 5000]
    assert [item.param1 for item in found.fence_items()] == [3.0, 3.0, 3.0, 30.5, 0.0]
    assert [(item.command, item.frame, item.z) for item in found.rally_items()] == [(5100, 6, 20.0)]


def test_a_survey_is_flown_by_its_expanded_items():
    found = read(plan(simple(22), survey(simple(16, number=2), simple(206, 2, [10, 0, 1, 0, 0, 0, 0], 3)), simple(21)))
    assert [item.command for item in found.items] == [22, 16, 206, 21]


@pytest.mark.parametrize("complex_item", [survey(), {"type": "ComplexItem", "complexItemType": "fwLandingPattern"}])
def test_a_complex_item_without_its_items_is_refused_not_dropped(complex_item: dict[str, Any]):
    with pytest.raises(BadFile, match=r"mission\.items\[1\]: the file does not hold the items of this complex item"):
        read(plan(simple(), complex_item))


def test_a_jump_goes_to_the_item_that_bears_its_number():
    jump = simple(177, 2, [7, 3, 0, 0, 0, 0, 0], number=9)
    assert read(plan(simple(number=5), simple(number=7), jump)).items[2].param1 == 1.0
    with pytest.raises(BadFile, match=r"mission\.items\[1\]\.params\[0\]: expected the doJumpId of an item, found 7"):
        read(plan(simple(number=5), jump))


def changed(key: str, value: Any) -> dict[str, Any]:
    content: Any = plan(simple())
    at = content
    *way, last = key.split(".")
    for step in way:
        at = at[int(step) if step.isdigit() else step]
    at[last if not last.isdigit() else int(last)] = value
    return content


@pytest.mark.parametrize(
    ("key", "value", "says"),
    [
        ("fileType", "Mission", "fileType: expected 'Plan', found 'Mission'"),
        ("version", 2, "version: expected 1, found 2"),
        ("mission.version", 1, "mission.version: expected 2, found 1"),
        ("mission.items", "none", r"Expected array, got str - at \$.mission.items"),
        ("mission.items.0.command", "16", r"mission.items\[0\]: Expected int, got str"),
        ("mission.items.0.frame", 1, r"mission.items\[0\]: expected a global frame .* found frame 1"),
        ("mission.items.0.params", [0, 0, 0], r"mission.items\[0\]: Expected array of length 7, got 3"),
        ("mission.items.0.params.4", 91.0, r"expected a latitude of -90 to 90 deg, found 91.0"),
        ("mission.items.0.params.5", None, r"expected a longitude"),
        ("mission.items.0.params.6", None, r"expected parameter 7"),
        ("mission.items.0.params.0", 1e12, r"expected parameter 1"),
        ("mission.items.0.autoContinue", False, r"autoContinue: expected true, found false"),
        ("mission.items.0.type", "Other", r"items\[0\].type: expected SimpleItem or ComplexItem"),
        ("mission.plannedHomePosition", [100.0, 0.0, 0.0], r"plannedHomePosition: .*found \[100.0"),
        ("mission.cruiseSpeed", -1.0, r"cruiseSpeed: expected a speed in \(0, 200\] m/s, found -1.0"),
        ("geoFence.polygons", [{"inclusion": True, "polygon": [[1, 2]]}], r"polygons\[0\]: .*length >= 3"),
        ("geoFence.circles", [{"inclusion": True, "circle": {"center": [1, 2], "radius": 0}}], r"circles\[0\].circle"),
        ("rallyPoints.points", [[1, 2, 1e9]], r"rallyPoints.points\[0\]"),
    ],
)
def test_what_cannot_be_flown_is_refused_with_place_and_reason(key: str, value: Any, says: str):
    with pytest.raises(BadFile, match=says):
        read(changed(key, value))


@pytest.mark.parametrize("data", [b"", b"{", b"[]", b"\xff\xfe", b"[" * 100_000, b'{"fileType": "Plan"}', b"1e999"])
def test_what_is_no_plan_is_refused(data: bytes):
    with pytest.raises(BadFile, match=r"^x\.plan: "):
        parse_plan(data, "x.plan")


@pytest.mark.parametrize("encoding", ["UTN-8", "rot13", "cp037", "utf-7"])
def test_kml_in_an_encoding_that_is_none_is_refused(encoding: str):
    with pytest.raises(BadFile, match=r"^x\.kml: line \d+: expected"):
        parse_kml(f'<?xml version="1.0" encoding="{encoding}"?><kml></kml>'.encode(), "x.kml")


WPL = (
    "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t47.3977\t8.5456\t488\t1\n"
    "1\t0\t3\t22\t0\t0\t0\tnan\t47.3977\t8.5456\t10\t1\n2\t0\t3\t16\t0\t2.5\t0\t0\t47.398\t8.546\t20\t1\n"
    "3\t0\t2\t177\t2\t-1\t0\t0\t0\t0\t0\t1\n"
)


def test_waypoints_begin_with_home():
    found = parse_waypoints(WPL.encode(), "x.waypoints")
    assert found.home is not None
    assert found.home.altitude_amsl_m == 488.0
    assert [item.command for item in found.items] == [22, 16, 177]
    assert found.items[1].param2 == 2.5
    assert found.items[2].param1 == 1.0  # the second item


def test_waypoints_without_home_are_all_mission():
    rows = ["0\t1\t3\t22\t0\t0\t0\t0\t47.3977\t8.5456\t10\t1", "1\t0\t3\t16\t0\t0\t0\t0\t47.398\t8.546\t20\t1"]
    found = parse_waypoints("\n".join(["QGC WPL 110", *rows]).encode(), "x.waypoints")
    assert (found.home, [item.command for item in found.items]) == (None, [22, 16])


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("WPL 110", "WPL 100", "line 1: expected 'QGC WPL 110'"),
        ("2\t0\t3\t16", "5\t0\t3\t16", "line 4: expected item number 2, found 5"),
        ("\t20\t1", "\t20\t0", "line 4: expected autocontinue 1, found 0"),
        ("\t20\t1", "\t20", "line 4: expected 12 columns, found 11"),
        ("47.398\t", "north\t", "line 4: expected numbers, found could not convert string to float: 'north'"),
        ("47.398\t", "97.398\t", "line 4: expected a latitude of -90 to 90 deg, found 97.398"),
        ("47.398\t", "nan\t", "line 4: expected a latitude"),
        ("\t20\t1", "\tinf\t1", "line 4: expected parameter 7"),
        ("2\t0\t3\t16", "2\t0\t1\t16", "line 4: expected a global frame"),
        ("488\t1", "99999\t1", "line 2: home:"),
    ],
)
def test_a_line_that_cannot_be_flown_is_refused_by_its_number(old: str, new: str, says: str):
    with pytest.raises(BadFile, match=says):
        parse_waypoints(WPL.replace(old, new, 1).encode(), "x.waypoints")


def test_waypoints_cannot_hold_a_fence_and_say_so():
    fence = Polygon(corners=(Place(1.0, 1.0), Place(1.0, 2.0), Place(2.0, 2.0)))
    with pytest.raises(ValueError, match="a mission alone, and there is more: 1 fence polygon"):
        format_waypoints(PlanDocument(items=(MissionItem(command=16),), polygons=(fence,)))


def test_a_plan_has_what_qgroundcontrol_asks_for():
    written = json.loads(format_plan(PlanDocument(items=(MissionItem(command=16, param4=float("nan")),))))
    item = written["mission"]["items"][0]
    assert (item["frame"], item["params"][3], item["type"], item["autoContinue"]) == (0, None, "SimpleItem", True)
    assert written["mission"]["plannedHomePosition"] == [0.0, 0.0, 0.0]
