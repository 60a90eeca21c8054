"""Missions and fences onto a vehicle, and certainty about what is stored: upload, read back, compare."""

import math
from collections.abc import Sequence

from gcs.dialect import AUTOPILOT
from gcs.errors import MissionTransferError
from gcs.microservices.mission_transfer_client import FENCE, MISSION, MissionDownload, MissionUpload
from gcs.station import Station
from missions.mission_items import MissionItem

ATTEMPTS = 3


async def store(station: Station, sysid: int, items: Sequence[MissionItem], mission_type: int = MISSION) -> None:
    """Put items onto a vehicle and read them back; returns only when exactly these are stored.

    Raises:
        MissionTransferError: refused, or something else is stored.
    """
    peer = (sysid, AUTOPILOT)
    difference = "nothing was sent"
    for _ in range(ATTEMPTS):
        await station.run(MissionUpload(items, peer, mission_type))
        found = (await station.run(MissionDownload(peer, mission_type))).items
        difference = first_difference(items, found, compare_altitude=mission_type != FENCE)
        if not difference:
            return
    raise MissionTransferError(f"vehicle {sysid}: after {ATTEMPTS} uploads something else is stored: {difference}")


def first_difference(
    sent: Sequence[MissionItem], stored: Sequence[MissionItem], *, compare_altitude: bool = True
) -> str:
    """What differs between two lists of items, as a phrase; empty where they fly the same.

    Frames of a fence and NaN yaws may come back changed; everything that is flown may not.
    """
    if len(sent) != len(stored):
        return f"{len(stored)} items instead of {len(sent)}"
    for seq, (ours, theirs) in enumerate(zip(sent, stored, strict=True)):
        pairs = [("command", ours.command, theirs.command), ("x", ours.x, theirs.x), ("y", ours.y, theirs.y)]
        pairs += [("param1", ours.param1, theirs.param1), ("param2", ours.param2, theirs.param2)]
        if compare_altitude:
            pairs += [("frame", ours.frame, theirs.frame), ("z", ours.z, theirs.z)]
        for name, one, other in pairs:
            if not math.isclose(one, other, rel_tol=1e-5, abs_tol=1e-4):
                return f"item {seq}: {name} {other} instead of {one}"
    return ""
