"""Plans survive every way through a file, and no bytes make a reader do anything but read or refuse."""

import math

from hypothesis import given
from hypothesis import strategies as st

from gcs.errors import BadFile
from gcs.files.conversion import WRITABLE, Format, format_document, parse_document
from gcs.files.document import PlanDocument
from gcs.files.geojson import format_geojson, parse_geojson
from gcs.files.kml import format_kml, parse_kml
from gcs.files.qgc_plan import format_plan, parse_plan
from gcs.files.waypoints import format_waypoints, parse_waypoints
from tests.unit.gcs.files.documents import bare_missions, plans, polygons, same


@given(plans)
def test_a_plan_is_read_as_it_was_written(document: PlanDocument):
    assert same(parse_plan(format_plan(document).encode(), "x.plan"), document)


@given(bare_missions)
def test_a_mission_is_read_from_waypoints_as_it_was_written(document: PlanDocument):
    assert same(parse_waypoints(format_waypoints(document).encode(), "x.waypoints"), document)


@given(bare_missions)
def test_a_mission_keeps_its_items_through_both_formats(document: PlanDocument):
    there = parse_waypoints(format_waypoints(document).encode(), "x.waypoints")
    back = parse_plan(format_plan(there).encode(), "x.plan")
    assert same(PlanDocument(items=back.items, home=back.home), document)


@given(st.lists(polygons, min_size=1, max_size=4).map(tuple))
def test_areas_are_read_from_geojson_as_they_were_written(areas: tuple):
    read, notes = parse_geojson(format_geojson(PlanDocument(polygons=areas)).encode(), "x.geojson")
    assert notes == []
    assert [(a.corners, a.inclusion) for a in read.polygons] == [(a.corners, a.inclusion) for a in areas]


@given(st.lists(polygons, min_size=1, max_size=4).map(tuple))
def test_areas_are_read_from_kml_as_they_were_written(areas: tuple):
    read, notes = parse_kml(format_kml(PlanDocument(polygons=areas)).encode(), "x.kml")
    assert notes == []
    assert [a.corners for a in read.polygons] == [a.corners for a in areas]


@given(st.binary(max_size=300), st.sampled_from(sorted(WRITABLE, key=lambda kind: kind.value)))
def test_any_bytes_are_read_or_refused(data: bytes, kind: Format):
    _read_or_refuse(data, kind)


@given(plans, st.data())
def test_a_damaged_plan_is_read_or_refused(document: PlanDocument, chance: st.DataObject):
    for kind in (Format.PLAN, Format.GEOJSON):
        try:
            text = format_document(document, "x", kind)[0]
        except BadFile:
            continue
        at = chance.draw(st.integers(0, len(text)))
        spoilt = text[:at] + chance.draw(st.text('{}[]",:0123456789-.eNaInfulltrs ', max_size=6)) + text[at + 3 :]
        _read_or_refuse(spoilt.encode(), kind)


def _read_or_refuse(data: bytes, kind: Format) -> None:
    try:
        document, _ = parse_document(data, f"x{kind.value}", kind)
    except BadFile:
        return
    for item in document.items:
        assert all(math.isfinite(value) for value in (item.x, item.y, item.z))
