"""Missions, fences and rally points onto a vehicle, and certainty about what is stored."""

from collections.abc import Sequence

from gcs.dialect import AUTOPILOT
from gcs.microservices.current_item import CurrentItem
from gcs.microservices.mission_download import MissionDownload
from gcs.microservices.mission_messages import MISSION
from gcs.microservices.verified_upload import VerifiedUpload
from gcs.station import Station
from missions.mission_items import MissionItem


async def store(
    station: Station, sysid: int, items: Sequence[MissionItem], mission_type: int = MISSION
) -> VerifiedUpload:
    """Put items onto a vehicle and read them back; returns only when exactly these are stored.

    Raises:
        MissionTransferError: refused, or something else is stored; says which.
    """
    link = station.link_estimate(sysid)
    return await station.run(VerifiedUpload(items, (sysid, AUTOPILOT), mission_type, link))


async def swap(station: Station, sysid: int, items: Sequence[MissionItem], current: int = 0) -> None:
    """Replace the mission of a vehicle in flight, and say which of its items is to be flown.

    Raises:
        MissionTransferError: the vehicle has not got the new mission; it flies on with the one it has.
        LinkLost: it has, but does not confirm the current item.
    """
    stored = await store(station, sysid, items)
    await station.run(CurrentItem((sysid, AUTOPILOT), current, stored.stored_id))


async def read(station: Station, sysid: int, mission_type: int = MISSION) -> list[MissionItem]:
    """What a vehicle has stored.

    Raises:
        MissionTransferError: refused, or no answer.
    """
    link = station.link_estimate(sysid)
    return (await station.run(MissionDownload((sysid, AUTOPILOT), mission_type, link))).items
