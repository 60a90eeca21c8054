"""Where the ground station keeps what outlasts a flight: keys, and recordings (the XDG base directories)."""

import os
from datetime import datetime
from pathlib import Path

NAME = "end-cloud-gcs"


def key_folder(ring: str) -> Path:
    """Of one ring of signing keys: `vehicles` for real ones, `sim` for those of the bundled simulator."""
    return _base("XDG_CONFIG_HOME", ".config") / NAME / "keys" / ring


def flights_folder() -> Path:
    """Of the flights that were given no `--report`."""
    return _base("XDG_STATE_HOME", ".local/state") / NAME / "flights"


def orders_file() -> Path:
    """The audit log of orders that were given outside of any flight."""
    return _base("XDG_STATE_HOME", ".local/state") / NAME / "orders.jsonl"


def kept_parameters_file(sysid: int) -> Path:
    """What a vehicle's parameters were the last time they were fetched."""
    return _base("XDG_CACHE_HOME", ".cache") / NAME / f"parameters-{sysid}.json"


def new_flight_folder(name: str, began: datetime) -> Path:
    """Make a folder for one flight, named after when it began.

    Raises:
        OSError: it cannot be made.
    """
    stem = f"{began:%Y-%m-%dT%H-%M-%S}-{name}"
    for number in range(1, 1000):
        folder = flights_folder() / (stem if number == 1 else f"{stem}-{number}")
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            continue
        return folder
    raise FileExistsError(f"{flights_folder() / stem} and 998 others")


def _base(variable: str, otherwise: str) -> Path:
    named = os.environ.get(variable, "")
    return Path(named) if os.path.isabs(named) else Path.home() / otherwise
