"""`gcs params`: a vehicle's parameters, read, compared with a file, and set."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated

import typer

from gcs.commands.convert import write_text
from gcs.commands.options import InstanceOption, KeysOption, LinkOption
from gcs.errors import ParameterError, UsageError
from gcs.link.url import parse_link_url
from gcs.microservices.parameter_client import Value
from gcs.microservices.parameter_fetch import Parameter
from gcs.microservices.parameter_files import (
    parameter_differences,
    read_parameters,
    read_value,
    shown_value,
    write_parameters,
)
from gcs.settings import FlightSettings
from gcs.station import Station

MOST_BYTES = 4 << 20

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Parameters of a vehicle. Files are QGroundControl's .params, or name and value as MAVProxy writes them.",
)

VehicleOption = Annotated[
    int | None, typer.Option("--vehicle", min=1, max=250, metavar="I", help="system id; the only one if not given")
]
FileArgument = Annotated[Path, typer.Argument(metavar="FILE", help=".params or .parm")]
InFlightOption = Annotated[bool, typer.Option("--in-flight", help="also while the vehicle is armed")]


@app.command("list")
def list_parameters(
    pattern: Annotated[str, typer.Argument(metavar="[PATTERN]", help="names, such as 'COM_*'")] = "*",
    vehicle: VehicleOption = None,
    link: LinkOption = None,
    keys: KeysOption = None,
    instance_base: InstanceOption = 0,
) -> None:
    """List parameters and their values.

    Example:

        gcs params list 'COM_*' --link udpin://0.0.0.0:14550
    """

    async def show(station: Station, sysid: int) -> None:
        for name, parameter in (await _fetched(station, sysid)).items():
            if fnmatchcase(name, pattern.upper()):
                print(f"{name:16} {shown_value(parameter.value)}")

    _on_vehicle(show, vehicle, link, keys, instance_base)


@app.command()
def get(
    names: Annotated[list[str], typer.Argument(metavar="NAME...")],
    vehicle: VehicleOption = None,
    link: LinkOption = None,
    keys: KeysOption = None,
    instance_base: InstanceOption = 0,
) -> None:
    """Show some parameters, asked for one by one."""
    from gcs.vehicle_parameters import get as get_one

    async def show(station: Station, sysid: int) -> None:
        for name in names:
            print(f"{name:16} {shown_value(await get_one(station, sysid, name))}")

    _on_vehicle(show, vehicle, link, keys, instance_base)


@app.command("set")
def set_parameter(
    name: Annotated[str, typer.Argument()],
    value: Annotated[str, typer.Argument()],
    vehicle: VehicleOption = None,
    link: LinkOption = None,
    keys: KeysOption = None,
    in_flight: InFlightOption = False,
    instance_base: InstanceOption = 0,
) -> None:
    """Set one parameter, and see it set.

    Example:

        gcs params set COM_OBL_RC_ACT 5 --vehicle 1
    """
    try:
        wanted = {name: read_value(value)}
    except ParameterError as wrong:
        raise UsageError(str(wrong)) from None
    _on_vehicle(_setting(wanted, in_flight=in_flight), vehicle, link, keys, instance_base)


@app.command()
def save(
    file: FileArgument,
    vehicle: VehicleOption = None,
    link: LinkOption = None,
    keys: KeysOption = None,
    instance_base: InstanceOption = 0,
) -> None:
    """Write all parameters into a file, as QGroundControl does."""

    async def write(station: Station, sysid: int) -> None:
        found = await _fetched(station, sysid)
        write_text(file, write_parameters(found, sysid))
        print(f"{file}: {len(found)} parameters of vehicle {sysid}")

    _on_vehicle(write, vehicle, link, keys, instance_base)


@app.command()
def diff(
    file: FileArgument,
    vehicle: VehicleOption = None,
    link: LinkOption = None,
    keys: KeysOption = None,
    instance_base: InstanceOption = 0,
) -> None:
    """Show what of a file is otherwise on the vehicle; parameters that the file does not name are left alone.

    Exit codes: 0 all is as in the file, 1 something differs, 2 bad input.
    """
    wanted = _read(file)

    async def compare(station: Station, sysid: int) -> None:
        differences = list(parameter_differences(wanted, await _fetched(station, sysid)))
        for difference in differences:
            print(difference)
        print(f"{len(differences)} of {len(wanted)} parameters differ")
        if differences:
            raise typer.Exit(1)

    _on_vehicle(compare, vehicle, link, keys, instance_base)


@app.command()
def load(
    file: FileArgument,
    vehicle: VehicleOption = None,
    link: LinkOption = None,
    keys: KeysOption = None,
    in_flight: InFlightOption = False,
    instance_base: InstanceOption = 0,
) -> None:
    """Set what differs from a file, one parameter after the other, each until the vehicle shows it set."""
    wanted = _read(file)

    async def set_what_differs(station: Station, sysid: int) -> None:
        found = await _fetched(station, sysid)
        differing = {difference.name: difference for difference in parameter_differences(wanted, found)}
        unknown = [name for name, difference in differing.items() if difference.on_vehicle is None]
        for name in unknown:
            print(f"vehicle {sysid} has no parameter {name}")
        values = {name: wanted[name].value for name in differing if name not in unknown}
        await _setting(values, in_flight=in_flight)(station, sysid)
        if unknown:
            raise typer.Exit(1)

    _on_vehicle(set_what_differs, vehicle, link, keys, instance_base)


Job = Callable[[Station, int], Awaitable[None]]


def _setting(values: Mapping[str, Value], *, in_flight: bool) -> Job:
    async def work(station: Station, sysid: int) -> None:
        from gcs.vehicle_parameters import set_all

        if station.vehicle(sysid).armed and values and not in_flight:
            raise UsageError(f"vehicle {sysid} is armed: nothing was set (--in-flight sets parameters all the same)")
        failed = await set_all(station, sysid, values, print)
        print(f"{len(values) - len(failed)} of {len(values)} parameters set")
        if failed:
            raise typer.Exit(1)

    return work


async def _fetched(station: Station, sysid: int) -> Mapping[str, Parameter]:
    from gcs.vehicle_parameters import fetch

    return await fetch(station, sysid)


def _on_vehicle(job: Job, sysid: int | None, links: list[str] | None, keys: Path | None, instance_base: int) -> None:
    """Hear the vehicle, and do the job."""
    from gcs.attachment import attached, heard_vehicle
    from gcs.security.key_ring import KeyRing

    urls = tuple(parse_link_url(text) for text in links or ())
    settings = FlightSettings(mission="", links=urls, keys=keys, instance_base=instance_base)

    async def work() -> None:
        async with attached(settings.ground_links(), KeyRing(settings.key_folder()), print) as station:
            await job(station, await heard_vehicle(station, sysid))

    asyncio.run(work())


def _read(file: Path) -> dict[str, Parameter]:
    try:
        with file.open("rb") as opened:
            text = opened.read(MOST_BYTES).decode(errors="replace")
    except OSError as problem:
        raise UsageError(f"{file}: cannot be read: {problem.strerror}") from None
    try:
        return read_parameters(text, str(file))
    except ParameterError as wrong:
        raise UsageError(str(wrong)) from None
