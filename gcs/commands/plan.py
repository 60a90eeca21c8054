"""`gcs plan`: the cloud planner alone."""

from pathlib import Path
from typing import Annotated

import typer

from gcs.commands.options import MissionArgument, SeedOption
from gcs.commands.plan_output import check_output, write_plan
from missions.mission import load_mission


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
