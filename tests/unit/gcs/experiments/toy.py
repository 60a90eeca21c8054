"""A small experiment whose runs take no time, for tests of what is around experiments."""

from collections.abc import Sequence
from pathlib import Path

from gcs.experiments.experiment import Experiment, Row, Run, product


def runs(seeds: Sequence[int]) -> list[Run]:
    return product(seed=list(seeds), kind=["square", "cube"])


def work(run: Run) -> Row:
    power = {"square": 2, "cube": 3}[run.text("kind")]
    return {"value": float(run.number("seed") ** power), "odd": run.number("seed") % 2 == 1}


def broken(run: Run) -> Row:
    if run.number("seed") == 2:
        raise ArithmeticError("two is too many")
    return work(run)


def figures(rows: Sequence[Row], directory: Path) -> list[str]:
    (directory / "toy.png").write_text(str(len(rows)))
    return ["toy.png"]


def summary(rows: Sequence[Row]) -> str:
    return f"{len(rows)} rows"


TOY = Experiment(
    name="toy",
    title="A toy",
    default_runs=3,
    key=("seed", "kind"),
    values=("value", "odd"),
    runs=runs,
    work=work,
    figures=figures,
    summary=summary,
)
