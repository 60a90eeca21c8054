"""A stored plan: mission, fence or rally points, and what of it can be flown."""

import math
import struct
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property

from missions.mission_items import MissionItem

INT_UNSET = 2**31 - 1
"""In x or y: no coordinate given."""
DEG_E7 = 1e7


class Cmd(IntEnum):
    """The MAV_CMD numbers of mission items that this autopilot flies or passes over, and of fences and rally points."""

    NAV_WAYPOINT = 16
    NAV_LOITER_UNLIM = 17
    NAV_LOITER_TIME = 19
    NAV_RETURN_TO_LAUNCH = 20
    NAV_LAND = 21
    NAV_TAKEOFF = 22
    NAV_LOITER_TO_ALT = 31
    NAV_DELAY = 93
    CONDITION_DELAY = 112
    DO_JUMP = 177
    DO_CHANGE_SPEED = 178
    DO_SET_HOME = 179
    DO_SET_ACTUATOR = 187
    DO_LAND_START = 189
    DO_SET_ROI_LOCATION = 195
    DO_SET_ROI_NONE = 197
    DO_SET_ROI = 201
    DO_DIGICAM_CONTROL = 203
    DO_MOUNT_CONFIGURE = 204
    DO_MOUNT_CONTROL = 205
    DO_SET_CAM_TRIGG_DIST = 206
    DO_GRIPPER = 211
    DO_SET_CAM_TRIGG_INTERVAL = 214
    OBLIQUE_SURVEY = 260
    SET_CAMERA_MODE = 530
    SET_CAMERA_FOCUS = 532
    DO_GIMBAL_MANAGER_PITCHYAW = 1000
    DO_GIMBAL_MANAGER_CONFIGURE = 1001
    IMAGE_START_CAPTURE = 2000
    IMAGE_STOP_CAPTURE = 2001
    DO_TRIGGER_CONTROL = 2003
    VIDEO_START_CAPTURE = 2500
    VIDEO_STOP_CAPTURE = 2501
    DO_VTOL_TRANSITION = 3000
    FENCE_RETURN_POINT = 5000
    FENCE_POLYGON_INCLUSION = 5001
    FENCE_POLYGON_EXCLUSION = 5002
    FENCE_CIRCLE_INCLUSION = 5003
    FENCE_CIRCLE_EXCLUSION = 5004
    RALLY_POINT = 5100


PLACES = frozenset({Cmd.NAV_WAYPOINT, Cmd.NAV_LOITER_UNLIM, Cmd.NAV_LOITER_TIME, Cmd.NAV_LOITER_TO_ALT})
"""Items to fly to, which need a latitude and a longitude."""
TAKEOFF_AND_LANDING = frozenset({Cmd.NAV_TAKEOFF, Cmd.NAV_LAND})
"""Items that may do without a place: where the vehicle is."""
POLYGONS = frozenset({Cmd.FENCE_POLYGON_INCLUSION, Cmd.FENCE_POLYGON_EXCLUSION})
FENCES = frozenset(cmd for cmd in Cmd if 5000 <= cmd < 5100)
MISSION_COMMANDS = frozenset(cmd for cmd in Cmd if cmd < 5000)

RELATIVE_FRAMES = frozenset({3, 6, 10, 11})
"""MAV_FRAMEs whose altitude counts from home."""


@dataclass(frozen=True)
class Plan:
    """The items of one mission type, with the id under which MAVLink knows them."""

    items: tuple[MissionItem, ...] = ()

    @cached_property
    def plan_id(self) -> int:
        """CRC-32 over all content; equal plans have equal ids, and nothing has 0."""
        return zlib.crc32(b"".join(_content(self.items))) if self.items else 0

    @cached_property
    def landing(self) -> MissionItem | None:
        """Where the landing that begins with a DO_LAND_START ends."""
        commands = [item.command for item in self.items]
        if Cmd.DO_LAND_START not in commands:
            return None
        begin = commands.index(Cmd.DO_LAND_START)
        return next((item for item in self.items[begin:] if item.command == Cmd.NAV_LAND and has_place(item)), None)


def _content(items: Sequence[MissionItem]) -> Iterator[bytes]:
    for i in items:
        yield struct.pack("<HB4fiif", i.command, i.frame, i.param1, i.param2, i.param3, i.param4, i.x, i.y, i.z)


def has_place(item: MissionItem) -> bool:
    return item.x != INT_UNSET and item.y != INT_UNSET


def latitude_deg(item: MissionItem) -> float:
    return item.x / DEG_E7


def longitude_deg(item: MissionItem) -> float:
    return item.y / DEG_E7


def altitude_amsl_m(item: MissionItem, home_altitude_m: float) -> float:
    """An item's altitude, wherever it counts from."""
    return item.z + home_altitude_m if item.frame in RELATIVE_FRAMES else item.z


def acceptance_m(item: MissionItem, default_m: float) -> float:
    """How near to a waypoint counts as there."""
    return item.param2 if item.command == Cmd.NAV_WAYPOINT and item.param2 > 0.0 else default_m


def hold_s(item: MissionItem) -> float:
    """How long an item waits at its place."""
    if item.command in (Cmd.NAV_WAYPOINT, Cmd.NAV_LOITER_TIME, Cmd.NAV_DELAY, Cmd.CONDITION_DELAY):
        return item.param1 if item.param1 > 0.0 else 0.0  # NaN is none
    return math.inf if item.command == Cmd.NAV_LOITER_UNLIM else 0.0
