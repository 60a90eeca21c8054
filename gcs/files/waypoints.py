"""`.waypoints`, the text format QGC WPL 110: a mission alone, one item a line, its first line the home position.

MAVProxy, Mission Planner and QGroundControl write home as item 0. A first line that is no plain waypoint above mean
sea level is taken for the first item of the mission, as tools for PX4 write it.
https://mavlink.io/en/file_formats/#mission_plain_text_file
"""

import math

import msgspec

from gcs.errors import BadFile
from gcs.files.document import (
    FILE_FRAME,
    MOST_ITEMS,
    ItemCommand,
    PlanDocument,
    item_from_file,
    params_for_file,
)
from missions.frames import GeodeticPoint
from missions.mission_items import MissionItem

HEADER = "QGC WPL 110"
COLUMNS = 12
_INDEX, _CURRENT, _FRAME, _COMMAND, _PARAMS, _AUTOCONTINUE = 0, 1, 2, 3, slice(4, 11), 11


def parse_waypoints(data: bytes, name: str) -> PlanDocument:
    """Read a `.waypoints` file.

    Raises:
        BadFile: naming the line, what was expected and what was found.
    """
    lines = data.decode("utf-8", errors="replace").splitlines()
    if not lines or lines[0].split() != HEADER.split():
        raise BadFile(name, "line 1", f"expected {HEADER!r}, found {lines[0][:40] if lines else 'nothing'!r}")
    rows = [(number, line.split()) for number, line in enumerate(lines[1:], start=2) if line.strip()]
    if len(rows) > MOST_ITEMS:
        raise BadFile(name, f"line {rows[MOST_ITEMS][0]}", f"expected at most {MOST_ITEMS} items")
    items = [_item(name, number, index, row) for index, (number, row) in enumerate(rows)]
    if not items or not _is_home(rows[0][1], items[0]):
        return PlanDocument(items=tuple(items))
    jumps = [i for i, item in enumerate(items) if item.command == ItemCommand.DO_JUMP]
    for index in jumps:  # they count home as item 0
        items[index] = msgspec.structs.replace(items[index], param1=items[index].param1 - 1.0)
    return PlanDocument(items=tuple(items[1:]), home=_home(name, rows[0]))


def format_waypoints(document: PlanDocument) -> str:
    """The text of a `.waypoints` file; NaN is written as such.

    Raises:
        ValueError: the document holds what the format cannot: says what.
    """
    others = msgspec.structs.replace(document, items=()).contents
    if others:
        raise ValueError(f"the format holds a mission alone, and there is more: {', '.join(others)}")
    home = document.home
    place = (home.latitude_deg, home.longitude_deg, home.altitude_amsl_m) if home is not None else (0.0, 0.0, 0.0)
    rows = [_row(0, 1, 0, ItemCommand.NAV_WAYPOINT, (0.0, 0.0, 0.0, 0.0, *place))]
    for index, item in enumerate(document.items, start=1):
        params = params_for_file(item)
        if item.command == ItemCommand.DO_JUMP:
            params = (item.param1 + 1.0, *params[1:])
        rows.append(_row(index, 0, FILE_FRAME[item.frame], item.command, params))
    return "\n".join([HEADER, *rows]) + "\n"


def _row(index: int, current: int, frame: int, command: int, params: tuple[float, ...]) -> str:
    return "\t".join([str(index), str(current), str(frame), str(int(command)), *map(repr, params), "1"])


def _item(name: str, number: int, index: int, row: list[str]) -> MissionItem:
    where = f"line {number}"
    if len(row) != COLUMNS:
        raise BadFile(name, where, f"expected {COLUMNS} columns, found {len(row)}")
    try:
        seq, current, frame, command, autocontinue = (
            int(row[column]) for column in (_INDEX, _CURRENT, _FRAME, _COMMAND, _AUTOCONTINUE)
        )
        params = tuple(float(text) for text in row[_PARAMS])
    except ValueError as wrong:
        raise BadFile(name, where, f"expected numbers, found {wrong}") from None
    if seq != index:
        raise BadFile(name, where, f"expected item number {index}, found {seq}")
    if autocontinue != 1:
        raise BadFile(name, where, f"expected autocontinue 1, found {autocontinue}: no autopilot here waits so")
    if current not in {0, 1}:
        raise BadFile(name, where, f"expected 0 or 1 for the current item, found {current}")
    try:
        return item_from_file(command, frame, params)
    except ValueError as wrong:
        raise BadFile(name, where, str(wrong)) from None


def _is_home(row: list[str], item: MissionItem) -> bool:
    """Whether the first item is a plain waypoint above mean sea level."""
    plain = item.command == ItemCommand.NAV_WAYPOINT and int(row[_FRAME]) == 0
    return plain and all(value == 0.0 or math.isnan(value) for value in (item.param1, item.param2, item.param3))


def _home(name: str, row: tuple[int, list[str]]) -> GeodeticPoint | None:
    """Home; 0/0/0 is what is written where it is not known."""
    latitude, longitude, altitude = (float(text) for text in row[1][8:11])
    if latitude == longitude == altitude == 0.0:
        return None
    try:
        values = {"latitude_deg": latitude, "longitude_deg": longitude, "altitude_amsl_m": altitude}
        return msgspec.convert(values, GeodeticPoint)
    except msgspec.ValidationError as wrong:
        raise BadFile(name, f"line {row[0]}", f"home: {wrong}".replace("`", "")) from None
