"""`sitl`: simulated vehicles with PX4's manners, for a ground station and companions to fly."""

import asyncio
import sys
import time
from pathlib import Path
from typing import Annotated

import msgspec
import typer

from missions.errors import MissionError
from missions.faults import SIMULATOR_EXAMPLES, parse_simulator_fault
from missions.frames import parse_origin
from missions.kernels import one_at_a_time
from missions.lean_numba import leave_out_what_no_kernel_needs
from missions.mission import Mission, load_mission
from missions.ports import FIRST_COMPANION_PORT
from sitl.announcement import announced_compilation
from sitl.autopilot.memory import Memory, SigningMemory
from sitl.autopilot.parameter_table import parameter_table
from sitl.dynamics.airframe import AirframeName
from sitl.errors import SitlError
from sitl.link.memory_files import MemoryFiles
from sitl.open_field import open_field
from sitl.service import serve
from sitl.settings import (
    HIGHEST_INSTANCE_BASE,
    HIGHEST_INSTANCE_BASE_WITH_LIDAR,
    HIGHEST_ONBOARD_PORT,
    ONBOARD_PORT,
    Settings,
)
from sitl.signing_keys import load_signing_keys
from sitl.simulator import Simulator

BAD_USAGE = 2

EPILOG = "Examples:  sitl indoor  |  sitl --vehicles 3 --speed 5  |  sitl field --truth truth.csv --airframe sih"

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


@app.command(epilog=EPILOG)
def fly(
    mission: Annotated[str | None, typer.Argument(help="Mission file, or the name of a shipped mission.")] = None,
    vehicles: Annotated[
        int | None, typer.Option(min=1, max=250, help="Instead of a mission: this many, on open ground.")
    ] = None,
    speed: Annotated[float, typer.Option(min=0.01, max=1000.0, help="Simulated seconds per second.")] = 1.0,
    seed: Annotated[int, typer.Option(min=0, help="Of everything random: one seed, one flight.")] = 1,
    truth: Annotated[Path | None, typer.Option(help="Write where the vehicles really are to this CSV file.")] = None,
    instance_base: Annotated[int, typer.Option(min=0, max=HIGHEST_INSTANCE_BASE, help="Shift all ports by this.")] = 0,
    origin: Annotated[str | None, typer.Option(help="LAT,LON,ALT: move the mission there.")] = None,
    airframe: Annotated[AirframeName, typer.Option(help="The body of all vehicles.")] = AirframeName.X500_LIKE,
    onboard_ports: Annotated[
        str | None, typer.Option(metavar="OWN:PEER", help="First ports of the onboard links and of the companions.")
    ] = None,
    fault: Annotated[
        list[str] | None,
        typer.Option(metavar="SPEC", help=f"What goes wrong, e.g. {SIMULATOR_EXAMPLES[1]}; repeatable."),
    ] = None,
    signing_key: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Keys of the ground links: 64 hex digits, for all or per system id."),
    ] = None,
    parameters: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER", help="Keep parameters, keys and their timestamps here from one simulation to the next."
        ),
    ] = None,
    lidar: Annotated[
        bool | None,
        typer.Option(
            "--lidar/--no-lidar",
            help="Send the companions what the mission's range sensor sees; on open ground not unless asked for.",
        ),
    ] = None,
    supervised: Annotated[bool, typer.Option("--supervised", help="End when standard input does.")] = False,
) -> None:
    """Simulate the vehicles of a mission, each an autopilot with PX4's manners on two UDP ports.

    Vehicle i talks to the ground station on UDP 14550 from port 18570+(i-1), and from 14580+(i-1) to its
    companion on 14540+(i-1), from the eleventh on 15050+(i-11); --onboard-ports moves these. Faults can also be
    ordered while it runs, on UDP 14990 as lines of JSON (docs/simulator.md). Ctrl-C ends it.
    """
    if (mission is None) == (vehicles is None):
        raise typer.BadParameter("expected a MISSION or --vehicles, one of the two")
    onboard_port, first_companion_port = _ports(onboard_ports) if onboard_ports else (ONBOARD_PORT, None)
    try:
        settings = Settings(
            speed=speed,
            seed=seed,
            truth=truth,
            instance_base=instance_base,
            airframe=airframe,
            onboard_port=onboard_port,
            first_companion_port=first_companion_port,
            faults=tuple(parse_simulator_fault(text) for text in fault or ()),
            signing_key=signing_key,
            parameters=parameters,
            lidar=_lidar(lidar, vehicles, instance_base),
            supervised=supervised,
        )
        _simulate(_mission(mission, vehicles, origin), settings)
    except* (MissionError, SitlError, OSError) as problems:
        for problem in problems.exceptions:
            print(f"sitl: {problem}", file=sys.stderr)
        raise typer.Exit(BAD_USAGE) from None


def _lidar(asked: bool | None, vehicles: int | None, instance_base: int) -> bool:
    """Whether lidars are simulated, and their ports fit."""
    lidar, highest = vehicles is None if asked is None else asked, HIGHEST_INSTANCE_BASE_WITH_LIDAR
    if lidar and instance_base > highest:
        raise typer.BadParameter(
            f"--instance-base: expected at most {highest} without --no-lidar, found {instance_base}"
        )
    return lidar


def _simulate(mission: Mission, settings: Settings) -> None:
    """Until it is ended."""
    table = parameter_table(settings.airframe.airframe)
    files = MemoryFiles(settings.parameters, table) if settings.parameters else None
    simulator = warm_simulator(mission, settings, _memories(mission, settings, files))
    asyncio.run(serve(simulator, settings, files))


def main() -> None:
    """Entry point of the `sitl` command."""
    leave_out_what_no_kernel_needs()
    app()


def warm_simulator(mission: Mission, settings: Settings, memories: dict[int, Memory]) -> Simulator:
    """A simulator whose compiled code is there, so that its first step takes no longer than the others."""
    with announced_compilation("sitl: compiling the physics, on a machine's first run only"), one_at_a_time("sitl"):
        Simulator(
            _rehearsed(mission), seed=settings.seed, airframe=settings.airframe.airframe, lidar=settings.lidar
        ).step()
    now_us = time.time_ns() // 1000
    simulator = Simulator(
        mission,
        seed=settings.seed,
        speed=settings.speed,
        airframe=settings.airframe.airframe,
        lidar=settings.lidar,
        utc_start_us=now_us,
        memories=memories,
    )
    for fault in settings.faults:
        simulator.order(fault)
    return simulator


def _rehearsed(mission: Mission) -> Mission:
    """Enough of a mission to need all its compiled code: an array of two vehicles is laid out like one of a hundred."""
    unharmed = msgspec.structs.replace(mission.simulation, faults=())
    return msgspec.structs.replace(mission, vehicles=mission.vehicles[:2], simulation=unharmed)


def _memories(mission: Mission, settings: Settings, files: MemoryFiles | None) -> dict[int, Memory]:
    """What the vehicles know before their first boot.

    Raises:
        SitlError: a file with keys or parameters is none.
        OSError: it cannot be read.
    """
    sysids = [vehicle.sysid for vehicle in mission.vehicles]
    keys = load_signing_keys(settings.signing_key, sysids) if settings.signing_key else {}
    if files is not None:
        return {sysid: files.load(sysid, keys) for sysid in sysids}
    return {sysid: Memory(signing=SigningMemory(keys.get(sysid))) for sysid in sysids}


def _mission(name: str | None, n_vehicles: int | None, origin: str | None) -> Mission:
    """The mission to simulate, moved if need be.

    Raises:
        MissionError: the file cannot be used, or the origin is no place.
    """
    mission = load_mission(name) if name is not None else open_field(n_vehicles or 1)
    return mission if origin is None else mission.moved_to(parse_origin(origin))


def _ports(text: str) -> tuple[int, int]:
    """The two ports of `--onboard-ports`.

    Raises:
        typer.BadParameter: they are none.
    """
    own, _, peer = text.partition(":")
    if not all(port.isdecimal() and 1024 <= int(port) <= HIGHEST_ONBOARD_PORT for port in (own, peer)):
        expected = f"two ports from 1024 to {HIGHEST_ONBOARD_PORT}, as in {ONBOARD_PORT}:{FIRST_COMPANION_PORT}"
        raise typer.BadParameter(f"--onboard-ports: expected {expected}, found {text!r}")
    return int(own), int(peer)
