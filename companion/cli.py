"""The command line: `companion --vehicle I --mission MISSION`, one process per vehicle."""

import asyncio
import os
import signal
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, TypeVar

import numpy as np
import typer

from companion.app import App
from companion.deadman import KernelTimer
from companion.errors import CompanionError, UsageError
from companion.fault_injection import FaultInjection
from companion.fleet.desk import FleetDesk
from companion.fleet.exchange import Exchange
from companion.journal import Journal
from companion.link.fleet_frames import FleetFrames
from companion.link.fleet_port import FleetPort, parse_fleet_link
from companion.link.px4 import Px4
from companion.link.sensor_port import SensorPort, parse_address
from companion.pilot import Pilot
from companion.planner.planner import Planner
from companion.sensing.sensing import Driver, Sensing, driver_of, ring_hz_of
from companion.settings import CompanionSettings, PlanningMode
from companion.warm_up import warm_up
from missions.errors import MissionError
from missions.faults import EXAMPLES, Fault, parse_fault
from missions.frames import parse_origin
from missions.kernels import one_at_a_time
from missions.lean_numba import give_back_the_compiler, leave_out_what_no_kernel_needs
from missions.lidar_packets import FIRST_PORT
from missions.mission import Mission, SensorKind, load_mission
from missions.ports import RADIO_PORT, companion_port, fleet_port

T = TypeVar("T")

LARGEST_INSTANCE_BASE = 46715

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


@app.command()
def companion(
    vehicle: Annotated[int, typer.Option(min=1, max=250, help="System id of the vehicle; this companion is I/191.")],
    mission: Annotated[str, typer.Option(help="Mission file, or the name of a shipped mission.")],
    system: Annotated[str | None, typer.Option(help="Where the autopilot is heard, as MAVSDK writes it.")] = None,
    speed: Annotated[float, typer.Option(min=0.01, max=1000.0, help="Simulated seconds per second.")] = 1.0,
    origin: Annotated[str | None, typer.Option(help="LAT,LON,ALT: move the mission there.")] = None,
    mode: Annotated[PlanningMode, typer.Option(help="Who plans.")] = PlanningMode.END_CLOUD,
    instance_base: Annotated[
        int, typer.Option(min=0, max=LARGEST_INSTANCE_BASE, help="Shift the default port by this.")
    ] = 0,
    sensor: Annotated[SensorKind, typer.Option(help="What the vehicle sees with.")] = SensorKind.LIDAR,
    lidar: Annotated[
        str | None, typer.Option(metavar="HOST:PORT", help="Where the lidar's packets come in.", show_default=False)
    ] = None,
    fleet_link: Annotated[
        str | None,
        typer.Option(metavar="URL", help="Where the other companions are; the simulator's radio without it."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of everything random.")] = 0,
    fault: Annotated[list[str] | None, typer.Option(help=f"Something that goes wrong, such as {EXAMPLES[0]}.")] = None,
    log: Annotated[Path | None, typer.Option(help="Write decisions to this file, one JSON object per line.")] = None,
    supervised: Annotated[bool, typer.Option("--supervised", help="End when standard input does.")] = False,
    deadman_s: Annotated[
        float, typer.Option(min=0.05, max=10.0, help="A companion that hangs in flight for so long is ended.")
    ] = 0.5,
) -> None:
    """Fly one vehicle: plan locally along the mission that its autopilot has stored, and stream offboard setpoints.

    It waits for its autopilot, downloads the mission, and flies when the ground station says MISSION_START.
    Ctrl-C (or SIGTERM) leaves the vehicle holding.

    Examples:  companion --vehicle 1 --mission indoor  |  companion --vehicle 2 --mission indoor --speed 5
    |  companion --vehicle 1 --mission field --system udpin://0.0.0.0:14540 --origin 47.397,8.545,489
    """
    url = system or f"udpin://127.0.0.1:{companion_port(vehicle) + instance_base}"
    heard_at = lidar or f"127.0.0.1:{FIRST_PORT + vehicle - 1 + instance_base}"
    try:
        settings = CompanionSettings(
            vehicle=vehicle,
            system_url=url,
            speed=speed,
            mode=mode,
            seed=seed,
            sensor=sensor,
            lidar_address=heard_at,
            fleet_link=fleet_link or f"udpout://127.0.0.1:{RADIO_PORT + instance_base}",
            fleet_port=fleet_port(vehicle) + instance_base,
            deadman_s=deadman_s,
        )
        loaded = _mission(mission, origin, vehicle)
        faults = [parse_fault(text) for text in fault or []]
        with Journal(vehicle, log) as journal:
            left_well = asyncio.run(_fly(settings, loaded, faults, journal, supervised=supervised))
    except (CompanionError, MissionError) as problem:
        print(f"companion: {problem}", file=sys.stderr)
        raise typer.Exit(2) from None
    if not left_well:
        raise typer.Exit(1)


def main() -> None:
    """Entry point of the console script."""
    leave_out_what_no_kernel_needs()
    app()


def _mission(path_or_name: str, origin: str | None, vehicle: int) -> Mission:
    mission = load_mission(path_or_name)
    mission.vehicle(vehicle)
    return mission if origin is None else mission.moved_to(parse_origin(origin))


async def _fly(
    settings: CompanionSettings, mission: Mission, faults: list[Fault], journal: Journal, *, supervised: bool
) -> bool:
    """Prepare, then work until the end; whether the vehicle was left as it should be."""
    vehicle = mission.vehicle(settings.vehicle)
    zones_m = np.array([mission.start_m(vehicle), *(target.position_m for target in mission.targets)])
    planner = Planner(mission, settings.reserve, settings.search, np.random.default_rng(settings.seed), zones_m)
    driver = driver_of(settings.sensor, mission)
    journal.tell("preparing the planner (a fresh machine compiles it once, which takes a minute or more)")
    with one_at_a_time("companion"):
        warm_up(planner, mission, vehicle)
    give_back_the_compiler()
    with ExitStack() as open_ports, ThreadPoolExecutor(1, thread_name_prefix="planner") as threads:
        sensing = None if driver is None else _sensing(driver, settings, mission, open_ports)
        fleet = _fleet(settings, mission, open_ports)
        loop = asyncio.get_running_loop()

        async def work(call: Callable[[], T]) -> T:
            return await loop.run_in_executor(threads, call)

        companion = App(
            settings,
            Pilot(mission, settings, planner, fleet.exchange),
            planner,
            Px4(settings.vehicle, settings.system_url, journal.tell, ring_hz=ring_hz_of(settings.sensor, mission)),
            work,
            KernelTimer(settings.deadman_s),
            FaultInjection(faults, settings.vehicle),
            journal,
            sensing,
            fleet,
        )
        for number in (signal.SIGTERM, signal.SIGINT):
            loop.add_signal_handler(number, companion.request_stop)
        if supervised:
            _end_with_parent(companion.request_stop)
        journal.tell(f"waiting for the autopilot on {settings.system_url}")
        return await companion.run()


def _sensing(driver: Driver, settings: CompanionSettings, mission: Mission, open_ports: ExitStack) -> Sensing:
    """The sensor as it is connected: a lidar by a port of its own, a ring by way of the autopilot.

    Raises:
        UsageError: the port cannot be bound.
    """
    rate_hz = mission.sensor.rate_hz
    if settings.sensor is not SensorKind.LIDAR:
        return Sensing(driver, rate_hz)
    port = open_ports.enter_context(SensorPort(*parse_address(settings.lidar_address)))
    return Sensing(driver, rate_hz, port.poll)


def _fleet(settings: CompanionSettings, mission: Mission, open_ports: ExitStack) -> FleetDesk:
    """The link to the other companions.

    Raises:
        UsageError: its URL is none, or its port cannot be bound.
    """
    port = open_ports.enter_context(FleetPort(parse_fleet_link(settings.fleet_link), settings.fleet_port))
    frames = FleetFrames(settings.vehicle, mission.frame)
    return FleetDesk(Exchange(settings.vehicle, mission), mission, frames, port.poll, port.send)


def _end_with_parent(request_stop: Callable[[], None]) -> None:
    """Stop at the end of standard input: the program that started this one is gone."""
    loop = asyncio.get_running_loop()

    def read() -> None:
        if not os.read(sys.stdin.fileno(), 4096):
            loop.remove_reader(sys.stdin.fileno())
            request_stop()

    try:
        loop.add_reader(sys.stdin.fileno(), read)
    except (OSError, ValueError):
        raise UsageError("--supervised: expected standard input to be a pipe") from None
