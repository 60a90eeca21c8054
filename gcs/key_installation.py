"""Giving a vehicle its signing key: SETUP_SIGNING over a link that somebody has declared trusted.

MAVLink has no answer to SETUP_SIGNING: the vehicle has its key when it signs with it. Until then the key is pending, on
disk before it is first sent, so that whatever is lost on the way the vehicle is never alone in knowing it.
"""

from gcs.attachment import attached, heard_vehicle
from gcs.dialect import AUTOPILOT, mavlink
from gcs.errors import LinkLost, UsageError
from gcs.link.url import LinkUrl
from gcs.security.key_ring import KeyRing, new_key
from gcs.security.signing import Signing, Trust, VehicleKey
from gcs.station import Station

REPEAT_S = 0.5
ATTEMPTS = 12


def offer_key(ring: KeyRing, sysid: int, *, rotate: bool) -> None:
    """Make sure that a key waits for a vehicle; one that is pending already is kept.

    Raises:
        UsageError: the vehicle has a key, and it is not to be rotated; or the other way round.
    """
    vehicles = ring.load()
    vehicle = vehicles.setdefault(sysid, VehicleKey())
    if rotate and vehicle.key is None:
        raise UsageError(f"vehicle {sysid} has no key yet: `gcs key install` gives it one")
    if not rotate and vehicle.key is not None:
        raise UsageError(f"vehicle {sysid} has a key: `gcs key rotate` gives it another one")
    if vehicle.next_key is None:
        vehicle.next_key = new_key()
        ring.save(vehicles)


async def install_key(ring: KeyRing, sysid: int, link: LinkUrl) -> None:
    """Send a vehicle the key that waits for it, until it signs with it.

    Raises:
        LinkLost: it was not heard, or it does not sign; the key stays pending.
        UsageError: the link cannot be opened.
    """
    async with attached([link], ring, print) as station:
        await heard_vehicle(station, sysid)
        await _send_until_signed(station, station.codec.signing, sysid)


async def _send_until_signed(station: Station, signing: Signing, sysid: int) -> None:
    vehicle = signing.vehicles[sysid]
    for _ in range(ATTEMPTS):
        if vehicle.next_key is None:
            return
        setup = mavlink.MAVLink_setup_signing_message(sysid, AUTOPILOT, list(vehicle.next_key), vehicle.timestamp)
        station.send(setup, sysid)
        if await station.holds_within(lambda: vehicle.next_key is None, REPEAT_S):
            return
    state = "goes on signing with its old key" if signing.trust(sysid) is Trust.SIGNED else "does not sign"
    hint = "its autopilot may not know signing; the key stays pending, and takes over when the vehicle signs with it"
    raise LinkLost(f"vehicle {sysid} {state} after {ATTEMPTS} x SETUP_SIGNING: {hint}")
