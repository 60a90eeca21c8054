"""`gcs key`: signing keys of vehicles."""

import asyncio
from pathlib import Path
from typing import Annotated

import typer

from gcs.errors import UsageError
from gcs.folders import key_folder
from gcs.link.url import parse_link_url
from gcs.security.key_ring import KeyRing, fingerprint, new_key
from gcs.security.signing import VehicleKey

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Signing keys: one per vehicle, in files that only you can read.",
)

VehicleOption = Annotated[int, typer.Option("--vehicle", min=1, max=250, metavar="I", help="system id")]
LinkOption = Annotated[
    str, typer.Option("--trusted-link", metavar="URL", help="the key goes over it in clear: a cable, or this machine")
]
KeysOption = Annotated[Path | None, typer.Option("--keys", metavar="DIR", help="where the keys are")]


@app.command()
def make(vehicle: VehicleOption, keys: KeysOption = None) -> None:
    """Make a key for a vehicle, and send it nowhere: it is in force once the vehicle signs with it."""
    ring = _ring(keys)
    vehicles = ring.load()
    entry = vehicles.setdefault(vehicle, VehicleKey())
    if entry.key is not None or entry.next_key is not None:
        raise UsageError(f"vehicle {vehicle} has a key: `gcs key rotate` gives it another one")
    entry.next_key = new_key()
    ring.save(vehicles)
    print(f"vehicle {vehicle}: key {fingerprint(entry.next_key)} made, pending, in {ring.folder}")


@app.command()
def install(vehicle: VehicleOption, trusted_link: LinkOption, keys: KeysOption = None) -> None:
    """Give a vehicle its first key, and wait until it signs with it.

    Example:

        gcs key install --vehicle 1 --trusted-link udpin://127.0.0.1:14550
    """
    _hand_over(vehicle, trusted_link, keys, rotate=False)


@app.command()
def rotate(vehicle: VehicleOption, trusted_link: LinkOption, keys: KeysOption = None) -> None:
    """Give a vehicle a new key in the place of the one that it has."""
    _hand_over(vehicle, trusted_link, keys, rotate=True)


@app.command("list")
def list_keys(keys: KeysOption = None) -> None:
    """List the vehicles that have keys; the keys themselves are never shown."""
    ring = _ring(keys)
    vehicles = ring.load()
    print(f"{ring.folder}: {len(vehicles) or 'no'} vehicle{'' if len(vehicles) == 1 else 's'} with a key")
    for sysid, vehicle in vehicles.items():
        active = f"key {fingerprint(vehicle.key)}" if vehicle.key is not None else "unsigned as yet"
        pending = f", pending {fingerprint(vehicle.next_key)}" if vehicle.next_key is not None else ""
        print(f"  vehicle {sysid:3}  {vehicle.trust.value:11}  {active}{pending}")


def _hand_over(sysid: int, trusted_link: str, keys: Path | None, *, rotate: bool) -> None:
    from gcs.key_installation import install_key, offer_key

    ring, link = _ring(keys), parse_link_url(trusted_link)
    offer_key(ring, sysid, rotate=rotate)
    asyncio.run(install_key(ring, sysid, link))
    key = ring.load()[sysid].key
    assert key is not None  # it has just taken over
    print(f"vehicle {sysid}: signs with key {fingerprint(key)}")


def _ring(keys: Path | None) -> KeyRing:
    return KeyRing(keys if keys is not None else key_folder("vehicles"))
