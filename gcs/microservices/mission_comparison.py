"""Whether what a vehicle has stored is what was sent; only what an autopilot rightly changes may differ."""

import math
import struct
from collections.abc import Iterator, Sequence

from gcs.microservices.mission_messages import FENCE
from missions.mission_items import MissionItem

_FLOAT = struct.Struct("<f")
FLOAT_TOLERANCE = 1e-5
"""Relative, above float32's own rounding: autopilots keep radii and times in other units."""
PLACE_TOLERANCE_E7 = 1
"""Latitudes go through a double and may be cut off: 1 cm."""
_SAME_FRAME = {0: 5, 3: 6, 10: 11}
"""A float frame -> the frame that integer items of the same meaning have."""
_FIRST_DO_COMMAND = 95
"""Below are the NAV commands, whose param4 is a yaw; DO and CONDITION commands use it as they like."""


def first_difference(sent: Sequence[MissionItem], stored: Sequence[MissionItem], mission_type: int = 0) -> str:
    """What differs between two lists of items, as a phrase; empty where they fly the same.

    A NaN of ours may come back as 0 (PX4 keeps no NaN yaw on some items), a yaw may come back turned by 360 degrees,
    and a fence has neither altitudes nor a frame of its own.
    """
    if len(sent) != len(stored):
        return f"{len(stored)} items instead of {len(sent)}"
    for seq, (ours, theirs) in enumerate(zip(sent, stored, strict=True)):
        for name, one, other, same in _comparisons(ours, theirs, mission_type):
            if not same:
                return f"item {seq}: {name} {other} instead of {one}"
    return ""


def _comparisons(ours: MissionItem, theirs: MissionItem, mission_type: int) -> Iterator[tuple[str, float, float, bool]]:
    yield "command", ours.command, theirs.command, ours.command == theirs.command
    yield "x", ours.x, theirs.x, abs(ours.x - theirs.x) <= PLACE_TOLERANCE_E7
    yield "y", ours.y, theirs.y, abs(ours.y - theirs.y) <= PLACE_TOLERANCE_E7
    for name in ("param1", "param2", "param3"):
        one, other = getattr(ours, name), getattr(theirs, name)
        yield name, one, other, _same_number(one, other)
    is_yaw = ours.command < _FIRST_DO_COMMAND
    yield "param4", ours.param4, theirs.param4, _same_number(ours.param4, theirs.param4, 360.0 if is_yaw else None)
    if mission_type != FENCE:
        frames = (_SAME_FRAME.get(ours.frame, ours.frame), _SAME_FRAME.get(theirs.frame, theirs.frame))
        yield "frame", ours.frame, theirs.frame, frames[0] == frames[1]
        yield "z", ours.z, theirs.z, _same_number(ours.z, theirs.z)


def _same_number(ours: float, theirs: float, period: float | None = None) -> bool:
    if math.isnan(ours):
        return math.isnan(theirs) or theirs == 0.0
    if not math.isfinite(theirs):
        return ours == theirs
    difference = _FLOAT.unpack(_FLOAT.pack(ours))[0] - theirs
    if period is not None:
        difference = math.remainder(difference, period)
    return abs(difference) <= FLOAT_TOLERANCE * max(1.0, abs(ours))
