"""The command line of the ground station: `gcs fly`, `gcs plan`, `gcs check`, `gcs watch`, `gcs experiment`."""

import asyncio
import signal
import sys
import time
from collections.abc import Coroutine
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gcs import settings as chosen
from gcs.commands.convert import convert
from gcs.commands.key import app as key_app
from gcs.commands.plan_flight import GivenPlanner, is_plan_file, kept_mission, settings_and_plan
from gcs.commands.plan_output import check_output, write_plan
from gcs.commands.replay import replay
from gcs.errors import GcsError, UsageError
from gcs.folders import flights_folder, new_flight_folder
from gcs.link.url import parse_link_url
from missions.errors import MissionError
from missions.faults import EXAMPLES as FAULT_EXAMPLES
from missions.faults import SIMULATOR_EXAMPLES, Fault, SimulatorFault, parse_any_fault
from missions.frames import GeodeticPoint, parse_origin
from missions.mission import Mission, SensorKind, load_mission, shipped_missions

if TYPE_CHECKING:
    from gcs.desk import Desk
    from gcs.flight.events import EventLog
    from gcs.flight.journal import Story
    from gcs.flight.report import FlightReport
    from gcs.planner.plan import FleetPlan
    from gcs.planner_process import PlannerProcess

BAD_INPUT = 2

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="A MAVLink ground control station for small UAV fleets.",
)

MissionArgument = Annotated[str, typer.Argument(metavar="MISSION", help="a mission file, or a shipped mission's name")]
LinkOption = Annotated[
    list[str] | None,
    typer.Option(
        "--link", metavar="URL", help="udpin, udpout, tcp, tcpin://HOST:PORT, serial://DEVICE:BAUD; repeatable"
    ),
]
SeedOption = Annotated[int, typer.Option(min=0, help="of planner and simulator: one seed, one plan")]
InstanceOption = Annotated[int, typer.Option("--instance-base", min=0, max=10_000, help="shifts all ports")]
KeysOption = Annotated[
    Path | None, typer.Option("--keys", metavar="DIR", help="signing keys; see `gcs key`, which has the same option")
]


@app.command()
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
    host: Annotated[str, typer.Option(help="address of the web page; loopback only")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=1, max=65535, help="port of the web page")] = 8080,
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
    if sim and companions:
        raise UsageError("--sim starts the companions already: give one of --sim and --companions")
    if host not in {"127.0.0.1", "localhost", "::1"}:
        raise UsageError(f"--host {host}: the page is served on loopback only")
    faults = [parse_any_fault(text) for text in fault or ()]
    for one, text in zip(faults, fault or (), strict=True):
        if not sim and isinstance(one, SimulatorFault):
            raise UsageError(f"--fault {text}: the simulator makes it go wrong, which needs --sim")
    sources = {(True, False): chosen.Autopilots.SIMULATED, (False, True): chosen.Autopilots.COMPANIONS}
    settings = chosen.FlightSettings(
        mission=mission,
        mode=mode,
        autopilots=sources.get((sim, companions), chosen.Autopilots.ATTACHED),
        headless=headless,
        speed=speed,
        seed=seed,
        links=tuple(parse_link_url(text) for text in link or ()),
        origin=_origin(origin),
        report_dir=report,
        host=host,
        port=port,
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


@app.command()
def plan(
    mission: MissionArgument,
    algorithm: Annotated[str, typer.Option(help="ecpso; to compare: pso, ipso, gapso, ca, aca")] = "ecpso",
    seed: SeedOption = 0,
    evaluations: Annotated[int | None, typer.Option(min=1, help="stop after so many evaluations")] = None,
    budget_s: Annotated[float | None, typer.Option("--budget-s", min=0.001, help="stop after so much time")] = None,
    output: Annotated[
        Path | None, typer.Option(metavar="FILE", help="where the plan goes: .json, .plan or .waypoints")
    ] = None,
) -> None:
    """Plan a mission and say what came out; nothing is sent to any vehicle.

    Examples:

        gcs plan terrain-1-5uav --seed 3 --output plan.json

        gcs plan indoor --algorithm pso --evaluations 3000

        gcs plan indoor --output indoor.plan      for QGroundControl: indoor-alpha.plan, indoor-bravo.plan
    """
    if output is not None:
        check_output(output)
    from rich.console import Console

    from gcs.console import PlanConsole, print_plan
    from gcs.planner import plan_mission

    loaded, console = load_mission(mission), Console(highlight=False, soft_wrap=True)
    with PlanConsole(console) as progress:
        found = plan_mission(
            loaded,
            algorithm=algorithm,
            seed=seed,
            evaluations=evaluations,
            budget_s=budget_s,
            on_progress=progress.show,
        )
    print_plan(console, found)
    if output is not None:
        for line in write_plan(output, loaded, found):
            console.print(line, markup=False)
    raise typer.Exit(0 if found.feasible else 1)


@app.command()
def check(mission: MissionArgument) -> None:
    """Check a mission file and say what is in it."""
    loaded = load_mission(mission)
    world, bounds = loaded.world, loaded.world.bounds
    size_m = bounds.high_enu_m - bounds.low_enu_m
    print(f"{loaded.name}: {loaded.description}")
    print(f"  site      {loaded.site.value}, {size_m[0]:g} x {size_m[1]:g} x {size_m[2]:g} m")
    for kind in ("peaks", "threats", "boxes", "cylinders", "movers"):
        things = getattr(world, kind)
        if things:
            names = (thing.name + ("" if thing.known else " (unmapped)") for thing in things)
            print(f"  {kind:9} {', '.join(names)}")
    for vehicle in loaded.vehicles:
        given = "what the planner allocates" if loaded.routes is None else ", then ".join(loaded.routes[vehicle.name])
        print(f"  vehicle   {vehicle.name} (system {vehicle.sysid}) from {list(vehicle.pad_m)} to {given or 'nowhere'}")
    print(f"  arrival   {loaded.on_arrival.value}")


@app.command()
def watch(
    link: LinkOption = None,
    port: Annotated[int, typer.Option(min=1, max=65535, help="port of the web page")] = 8080,
    keys: KeysOption = None,
) -> None:
    """Show whatever is on the links in the web page, and command it from there.

    Example:

        gcs watch --link udpin://0.0.0.0:14550
    """
    from gcs.console import FlightConsole
    from gcs.flight.events import BEGAN, EventLog
    from gcs.view.server import serve_page
    from gcs.watch import watch as run_watch

    settings = chosen.FlightSettings(mission="", links=tuple(parse_link_url(text) for text in link or ()), keys=keys)
    console, work_dir = FlightConsole(), _work_dir(None, "watch")
    events = EventLog(time.monotonic, work_dir / "events.jsonl", listeners=[console.show])
    events.add(BEGAN, "gcs watch", unix_us=time.time_ns() // 1000)
    console.say(f"recorded in {work_dir}")
    console.say(f"page: http://127.0.0.1:{port}")
    asyncio.run(run_watch(settings, events, work_dir, lambda desk, first: serve_page(desk, "127.0.0.1", port, first)))


@app.command()
def experiment(
    name: Annotated[
        str,
        typer.Argument(metavar="NAME", help="ackley, allocation, paths, convergence, table2, ablation or scaling"),
    ],
    runs: Annotated[int | None, typer.Option(min=1, help="seeds; the default is the experiment's own")] = None,
    seed0: Annotated[int, typer.Option(min=0, help="the first seed")] = 0,
    executor: Annotated[
        str | None, typer.Option(metavar="URL", help="a Dask scheduler; without it, all cores of this machine")
    ] = None,
    output: Annotated[Path, typer.Option(metavar="DIR", help="where rows, pictures and summary go")] = Path(
        "out/experiments"
    ),
) -> None:
    """Reproduce a table or a figure of the paper: NAME.csv, NAME.md and pictures.

    Rows are written as runs are done. Interrupted with Ctrl-C and started again, it goes on with what is missing.

    Examples:

        gcs experiment ackley                                  figure 5

        gcs experiment table2 --runs 5 --output out/table2     table 2, five seeds

        gcs experiment table2 --executor tcp://127.0.0.1:8786  on a Dask cluster (pip install 'end-cloud-gcs[cluster]')
    """
    from rich.console import Console

    from gcs.experiments.command import Order, run_experiment

    run_experiment(Order(name, runs, seed0, executor, output), Console(highlight=False, soft_wrap=True))


@app.command()
def doctor() -> None:
    """Say whether everything is here that a flight needs, and compile the planner if that is still to be done."""
    from gcs.doctor import examine
    from gcs.planner import compile_kernels

    fine = True
    for finding in examine():
        fine = fine and finding.fine
        print(f"{'ok ' if finding.fine else 'BAD'}  {finding.what:12} {finding.found}", flush=True)
    began_s = time.perf_counter()
    compile_kernels()
    print(f"ok   planner      compiled and loaded in {time.perf_counter() - began_s:.1f} s")
    raise typer.Exit(0 if fine else 1)


@app.command()
def missions() -> None:
    """List the shipped missions."""
    for name in shipped_missions():
        print(f"{name:20} {load_mission(name).description}")


app.command()(convert)
app.command()(replay)
app.add_typer(key_app, name="key")


def main() -> None:
    """Entry point of the console script: errors become a sentence and an exit code."""
    signal.signal(signal.SIGTERM, _as_interrupt)
    try:
        app(standalone_mode=True)
    except (UsageError, MissionError) as problem:
        print(f"gcs: {problem}", file=sys.stderr)
        sys.exit(BAD_INPUT)
    except GcsError as problem:
        print(f"gcs: {problem}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)


def _run_flight(settings: chosen.FlightSettings, mission: Mission, given: "FleetPlan | None" = None) -> int:
    from gcs.console import FlightConsole, PlanConsole
    from gcs.flight.events import BEGAN, EventLog
    from gcs.flight.rejoining import left_in_flight, unfinished
    from gcs.planner_process import PlannerProcess

    if isinstance(settings.origin, GeodeticPoint):
        mission = mission.moved_to(settings.origin)
    console = FlightConsole()
    left = left_in_flight(flights_folder(), mission) if settings.report_dir is None and not settings.simulated else None
    work_dir = left or _work_dir(settings.report_dir, mission.name)
    story = None if settings.simulated else unfinished(work_dir, mission)
    with PlanConsole(console.console) as progress:
        events = EventLog(time.monotonic, work_dir / "events.jsonl", [], [console.show], keep=story is not None)
        events.add(BEGAN, f"gcs fly {settings.mission}", unix_us=time.time_ns() // 1000)
        if given is not None:
            settings = kept_mission(settings, mission, work_dir)
        with PlannerProcess("ecpso", settings.seed, [progress.show]) as process:
            planner = process if given is None else GivenPlanner(given)
            report = asyncio.run(_fly(settings, mission, planner, events, work_dir, story))
        events.close()
    verdict = "success" if report.success else "FAILED"
    console.say(f"{verdict}: {report.reason}", style="green" if report.success else "bold red")
    console.say(f"report: {work_dir / 'report.json'}")
    return 0 if report.success else 1


async def _fly(
    settings: chosen.FlightSettings,
    mission: Mission,
    planner: "PlannerProcess | GivenPlanner",
    events: "EventLog",
    work_dir: Path,
    story: "Story | None",
) -> "FlightReport":
    from gcs.app import FlightApp
    from gcs.view.server import serve_page

    def page(desk: "Desk", first_browser: asyncio.Event) -> Coroutine[None, None, None]:
        return serve_page(desk, settings.host, settings.port, first_browser)

    app = FlightApp(settings, mission, planner.plan, events, work_dir, None if settings.headless else page, story)
    planner.on_progress.append(app.desk.on_plan_progress)
    return await app.run()


def _work_dir(report_dir: Path | None, name: str) -> Path:
    """The report's directory, or one among all flights, which are kept."""
    try:
        if report_dir is None:
            return new_flight_folder(name, datetime.now(UTC))
        report_dir.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise UsageError(f"{report_dir or flights_folder()}: cannot be made: {problem.strerror} (--report)") from None
    return report_dir


def _origin(text: str | None) -> GeodeticPoint | chosen.OriginHere | None:
    if text is None:
        return None
    if text == "here":
        return chosen.OriginHere.HERE
    return parse_origin(text)


def _as_interrupt(*_: object) -> None:
    raise KeyboardInterrupt
