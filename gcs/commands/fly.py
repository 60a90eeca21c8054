"""`gcs fly`: a whole flight, with its page, its recordings and its report."""

import asyncio
import time
from collections.abc import Coroutine
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gcs import settings as chosen
from gcs.commands.options import (
    HostOption,
    InstanceOption,
    KeysOption,
    LinkOption,
    MissionArgument,
    PortOption,
    SeedOption,
    TokenOption,
    check_access,
    work_dir,
)
from gcs.commands.plan_flight import GivenPlanner, is_plan_file, kept_mission, settings_and_plan
from gcs.errors import UsageError
from gcs.folders import flights_folder
from gcs.link.url import parse_link_url
from missions.faults import EXAMPLES as FAULT_EXAMPLES
from missions.faults import SIMULATOR_EXAMPLES, Fault, SimulatorFault, parse_any_fault
from missions.frames import GeodeticPoint, parse_origin
from missions.mission import Mission, SensorKind, load_mission

if TYPE_CHECKING:
    from gcs.desk import Desk
    from gcs.flight.events import EventLog
    from gcs.flight.journal import Story
    from gcs.flight.report import FlightReport
    from gcs.planner.plan import FleetPlan
    from gcs.planner_process import PlannerProcess


def fly(
    mission: MissionArgument,
    sim: Annotated[bool, typer.Option("--sim", help="start the simulator and one companion per vehicle")] = False,
    companions: Annotated[bool, typer.Option("--companions", help="start the companions alone")] = False,
    mode: Annotated[chosen.PlanningMode, typer.Option(help="who plans")] = chosen.PlanningMode.END_CLOUD,
    headless: Annotated[bool, typer.Option("--headless", help="no web page; end when the flight has ended")] = False,
    speed: Annotated[float, typer.Option(min=0.1, max=100.0, help="simulated seconds per second")] = 1.0,
    seed: SeedOption = 0,
    link: LinkOption = None,
    origin: Annotated[
        str | None, typer.Option(metavar="LAT,LON,ALT|here", help="where on earth the mission is flown")
    ] = None,
    report: Annotated[Path | None, typer.Option(metavar="DIR", help="where report, logs and picture go")] = None,
    host: HostOption = "127.0.0.1",
    port: PortOption = 8080,
    token: TokenOption = None,
    wait: Annotated[bool, typer.Option("--wait", help="nothing begins by itself: the page's operator does it")] = False,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            metavar="SPEC", help=f"what goes wrong, such as {FAULT_EXAMPLES[0]} or {SIMULATOR_EXAMPLES[2]}; repeatable"
        ),
    ] = None,
    sensor: Annotated[
        SensorKind, typer.Option(help="what the companions that are started see with")
    ] = SensorKind.LIDAR,
    lidar_host: Annotated[
        str, typer.Option(metavar="HOST", help="where they hear their lidars, at port 56300 and the following ones")
    ] = "127.0.0.1",
    instance_base: InstanceOption = 0,
    keys: KeysOption = None,
    vehicle: Annotated[int, typer.Option(min=1, max=250, help="who flies a .plan: a system id")] = 1,
) -> None:
    """Fly a mission, or a plan of another tool (.plan, .waypoints; by the autopilot alone).

    Examples:

        gcs fly survey.plan --vehicle 3 --link udpin://0.0.0.0:14550

        gcs fly indoor --sim                                  on the bundled simulator, with the web page

        gcs fly indoor --sim --headless --speed 5 --report out

        gcs fly field --companions --origin here --link udpin://0.0.0.0:14550     on a real PX4 with a lidar

        gcs fly field --companions --sensor none ...                              on one that sees nothing

    Exit codes: 0 every vehicle reached its target safely, 1 it did not (the report says why), 2 bad input.
    """
    check_access(host, token)
    faults = [_fault(text, simulated=sim) for text in fault or ()]
    settings = chosen.FlightSettings(
        mission=mission,
        mode=mode,
        autopilots=_autopilots(sim, companions),
        headless=headless,
        speed=speed,
        seed=seed,
        links=tuple(parse_link_url(text) for text in link or ()),
        origin=_origin(origin),
        report_dir=report,
        host=host,
        port=port,
        token=token,
        waits=wait,
        faults=tuple(one for one in faults if isinstance(one, Fault)),
        simulator_faults=tuple(one for one in faults if isinstance(one, SimulatorFault)),
        instance_base=instance_base,
        keys=keys,
        sensor=sensor,
        lidar_host=lidar_host,
    )
    if is_plan_file(mission):
        raise typer.Exit(_run_flight(*settings_and_plan(settings, vehicle)))
    raise typer.Exit(_run_flight(settings, load_mission(mission)))


def _autopilots(sim: bool, companions: bool) -> chosen.Autopilots:
    if sim and companions:
        raise UsageError("--sim starts the companions already: give one of --sim and --companions")
    if sim:
        return chosen.Autopilots.SIMULATED
    return chosen.Autopilots.COMPANIONS if companions else chosen.Autopilots.ATTACHED


def _fault(text: str, *, simulated: bool) -> Fault | SimulatorFault:
    fault = parse_any_fault(text)
    if isinstance(fault, SimulatorFault) and not simulated:
        raise UsageError(f"--fault {text}: the simulator makes it go wrong, which needs --sim")
    return fault


def _origin(text: str | None) -> GeodeticPoint | chosen.OriginHere | None:
    if text is None:
        return None
    if text == "here":
        return chosen.OriginHere.HERE
    return parse_origin(text)


def _run_flight(settings: chosen.FlightSettings, mission: Mission, given: "FleetPlan | None" = None) -> int:
    from gcs.console import FlightConsole, PlanConsole
    from gcs.flight.events import BEGAN, EventLog
    from gcs.flight.records import REPORT_FILE
    from gcs.flight.rejoining import left_in_flight, unfinished
    from gcs.planner_process import PlannerProcess

    if isinstance(settings.origin, GeodeticPoint):
        mission = mission.moved_to(settings.origin)
    console = FlightConsole()
    left = left_in_flight(flights_folder(), mission) if settings.report_dir is None and not settings.simulated else None
    folder = left or work_dir(settings.report_dir, mission.name)
    story = None if settings.simulated else unfinished(folder, mission)
    with PlanConsole(console.console) as progress:
        events = EventLog(time.monotonic, folder / "events.jsonl", [], [console.show], keep=story is not None)
        events.add(BEGAN, f"gcs fly {settings.mission}", unix_us=time.time_ns() // 1000)
        if given is not None:
            settings = kept_mission(settings, mission, folder)
        with PlannerProcess("ecpso", settings.seed, [progress.show]) as process:
            if given is None:
                process.prepare()
            planner = process if given is None else GivenPlanner(given)
            report = asyncio.run(_fly(settings, mission, planner, events, folder, story))
        events.close()
    verdict = "success" if report.success else "FAILED"
    console.say(f"{verdict}: {report.reason}", style="green" if report.success else "bold red")
    console.say(f"report: {folder / REPORT_FILE}")
    return 0 if report.success else 1


async def _fly(
    settings: chosen.FlightSettings,
    mission: Mission,
    planner: "PlannerProcess | GivenPlanner",
    events: "EventLog",
    folder: Path,
    story: "Story | None",
) -> "FlightReport":
    from gcs.app import FlightApp
    from gcs.view.server import serve_page

    def page(desk: "Desk", first_browser: asyncio.Event) -> Coroutine[None, None, None]:
        return serve_page(desk, settings.host, settings.port, first_browser, settings.token)

    shown = None if settings.headless else page
    choice = None if isinstance(planner, GivenPlanner) else planner
    app = FlightApp(settings, mission, planner.plan, events, folder, shown, choice, story)
    planner.on_progress.append(app.desk.on_plan_progress)
    return await app.run()
