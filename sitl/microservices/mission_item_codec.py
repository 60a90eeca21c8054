"""MISSION_ITEM and MISSION_ITEM_INT to stored items and back; what cannot be flown is refused with its reason."""

import math

from missions.mission_items import MissionItem
from sitl.autopilot.places import is_place
from sitl.autopilot.plan import (
    DEG_E7,
    FENCES,
    INT_UNSET,
    MISSION_COMMANDS,
    PLACES,
    POLYGONS,
    RELATIVE_FRAMES,
    TAKEOFF_AND_LANDING,
    Cmd,
)
from sitl.dialect import Message, mavlink
from sitl.microservices.outbox import Sender

FRAME_GLOBAL_INT, FRAME_RELATIVE_INT, FRAME_MISSION = 5, 6, 2
GLOBAL_FRAMES = frozenset({0, 3, 5, 6})
HIGHEST_M = 100_000.0
LEAST_VERTICES = 3
"""Of a fence's polygon."""

_AT_A_PLACE = PLACES | TAKEOFF_AND_LANDING | {Cmd.DO_SET_ROI, Cmd.DO_SET_ROI_LOCATION}
_PLACED_COMMANDS = {0: _AT_A_PLACE, 1: FENCES | PLACES, 2: frozenset({Cmd.RALLY_POINT})}
"""MAV_MISSION_TYPE -> commands that its plans may hold in a global frame."""
_OTHER_COMMANDS: dict[int, frozenset[Cmd]] = {
    0: (MISSION_COMMANDS - _AT_A_PLACE) | {Cmd.DO_SET_ROI},
    1: frozenset(),
    2: frozenset(),
}
"""The same in MAV_FRAME_MISSION."""


class ItemRefused(Exception):
    """An item that cannot be stored.

    Args:
        result: the MAV_MISSION_RESULT to answer with.
    """

    def __init__(self, result: int) -> None:
        super().__init__(f"MAV_MISSION_RESULT {result}")
        self.result = result


def read_int_item(message: Message, kind: int) -> MissionItem:
    """The item in a MISSION_ITEM_INT.

    Raises:
        ItemRefused: with the MAV_MISSION_RESULT to answer with.
    """
    return _checked(message, message.x, message.y, kind)


def read_float_item(message: Message, kind: int) -> MissionItem:
    """The item in a MISSION_ITEM, its degrees as float32.

    Raises:
        ItemRefused: with the MAV_MISSION_RESULT to answer with.
    """
    return _checked(message, _degrees_e7(message.x), _degrees_e7(message.y), kind)


def int_item(item: MissionItem, seq: int, receiver: Sender, kind: int) -> Message:
    """An item as MISSION_ITEM_INT."""
    return mavlink.MAVLink_mission_item_int_message(
        receiver.sysid,
        receiver.compid,
        seq,
        item.frame,
        item.command,
        1 if seq == 0 else 0,
        _autocontinue(kind),
        item.param1,
        item.param2,
        item.param3,
        item.param4,
        item.x,
        item.y,
        item.z,
        kind,
    )


def float_item(item: MissionItem, seq: int, receiver: Sender, kind: int) -> Message:
    """An item as MISSION_ITEM, in the frame without _INT."""
    frame = {FRAME_GLOBAL_INT: 0, FRAME_RELATIVE_INT: 3}.get(item.frame, item.frame)
    return mavlink.MAVLink_mission_item_message(
        receiver.sysid,
        receiver.compid,
        seq,
        frame,
        item.command,
        1 if seq == 0 else 0,
        _autocontinue(kind),
        item.param1,
        item.param2,
        item.param3,
        item.param4,
        item.x / DEG_E7,
        item.y / DEG_E7,
        item.z,
        kind,
    )


def _checked(message: Message, x: int, y: int, kind: int) -> MissionItem:
    command = message.command
    if message.frame not in GLOBAL_FRAMES and message.frame != FRAME_MISSION:
        raise ItemRefused(mavlink.MAV_MISSION_UNSUPPORTED_FRAME)
    known = _OTHER_COMMANDS if message.frame == FRAME_MISSION else _PLACED_COMMANDS
    if command not in known[kind]:
        raise ItemRefused(mavlink.MAV_MISSION_UNSUPPORTED)
    _refuse_bad_parameters(message)
    if command in POLYGONS and not message.param1 >= LEAST_VERTICES:
        raise ItemRefused(mavlink.MAV_MISSION_ERROR)
    if command in PLACES or command in TAKEOFF_AND_LANDING or kind != 0:
        _refuse_bad_place(message, x, y, optional=command in TAKEOFF_AND_LANDING)
    return MissionItem(
        command=command,
        frame=_stored_frame(message.frame, kind),
        param1=message.param1,
        param2=message.param2,
        param3=message.param3,
        param4=message.param4,
        x=x,
        y=y,
        z=message.z if math.isfinite(message.z) else 0.0,
    )


def _refuse_bad_parameters(message: Message) -> None:
    """NaN stands for a default; nothing stands for infinity, and a jump needs its numbers."""
    first = mavlink.MAV_MISSION_INVALID_PARAM1
    for index, value in enumerate((message.param1, message.param2, message.param3, message.param4)):
        needed = message.command == Cmd.DO_JUMP and index < 2
        if math.isinf(value) or (needed and not math.isfinite(value)):
            raise ItemRefused(first + index)


def _refuse_bad_place(message: Message, x: int, y: int, *, optional: bool) -> None:
    absent = optional and (x == INT_UNSET or y == INT_UNSET)
    if not absent and not is_place(x / DEG_E7, 0.0):
        raise ItemRefused(mavlink.MAV_MISSION_INVALID_PARAM5_X)
    if not absent and not is_place(0.0, y / DEG_E7):
        raise ItemRefused(mavlink.MAV_MISSION_INVALID_PARAM6_Y)
    if not abs(message.z) <= HIGHEST_M:
        raise ItemRefused(mavlink.MAV_MISSION_INVALID_PARAM7)


def _stored_frame(frame: int, kind: int) -> int:
    """PX4 gives positions back in the _INT frames; a fence, which has no altitude, in the one above sea level."""
    if frame == FRAME_MISSION:
        return frame
    if kind == mavlink.MAV_MISSION_TYPE_FENCE:
        return FRAME_GLOBAL_INT
    return FRAME_RELATIVE_INT if frame in RELATIVE_FRAMES else FRAME_GLOBAL_INT


def _autocontinue(kind: int) -> int:
    """What PX4 says of its stored items."""
    return 0 if kind == mavlink.MAV_MISSION_TYPE_FENCE else 1


def _degrees_e7(degrees: float) -> int:
    """Beyond all latitudes and longitudes where it is no number."""
    return round(degrees * DEG_E7) if abs(degrees) < 214.0 else INT_UNSET
