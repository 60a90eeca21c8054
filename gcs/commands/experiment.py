"""`gcs experiment`: the paper's tables and figures."""

from pathlib import Path
from typing import Annotated

import typer


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
