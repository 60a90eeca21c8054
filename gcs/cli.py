"""The command line of the ground station: every command is registered here, and errors become exit codes."""

import asyncio
import signal
import sys
import time

import typer

from gcs.commands.convert import convert
from gcs.commands.experiment import experiment
from gcs.commands.fly import fly
from gcs.commands.key import app as key_app
from gcs.commands.links import links
from gcs.commands.options import MissionArgument
from gcs.commands.params import app as params_app
from gcs.commands.plan import plan
from gcs.commands.replay import replay
from gcs.commands.watch import watch
from gcs.errors import GcsError, UsageError
from missions.errors import MissionError
from missions.mission import load_mission, shipped_missions

BAD_INPUT = 2

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="A MAVLink ground control station for small UAV fleets.",
    epilog="Begin with `gcs doctor`, then `gcs fly indoor --sim`. `gcs COMMAND --help` has examples.",
)
app.command(short_help="Fly a mission, simulated or on real vehicles.")(fly)
app.command(short_help="Plan a mission; nothing is sent to any vehicle.")(plan)


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


app.command(short_help="Show and command whatever is on the links.")(watch)
app.command(short_help="Reproduce a table or a figure of the paper.")(experiment)


@app.command(short_help="Say whether this machine is ready to fly.")
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
    print("ready: gcs fly indoor --sim" if fine else "what is BAD above comes first")
    raise typer.Exit(0 if fine else 1)


@app.command()
def missions() -> None:
    """List the shipped missions."""
    for name in shipped_missions():
        print(f"{name:20} {load_mission(name).description}")


app.command(short_help="Convert plans, areas and tracks of other tools.")(convert)
app.command(short_help="Show a recorded flight in the web page.")(replay)
app.command(short_help="Listen for a while, and say who is heard.")(links)
app.add_typer(params_app, name="params", short_help="List, set, save and compare parameters.")
app.add_typer(key_app, name="key", short_help="Signing keys, one per vehicle.")


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
    except (KeyboardInterrupt, asyncio.CancelledError):  # after a task group has failed, Python 3.11 says the latter
        sys.exit(130)


def _as_interrupt(*_: object) -> None:
    raise KeyboardInterrupt
