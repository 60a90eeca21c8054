"""`gcs experiment`: runs that are missing, rows, pictures and a summary."""

from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from gcs.errors import UsageError
from gcs.experiments.catalogue import find_experiment
from gcs.experiments.executors import check_scheduler, open_executor
from gcs.experiments.experiment import Experiment, Row, Run
from gcs.experiments.ledger import Ledger
from gcs.experiments.runner import outstanding, perform, wanted


@dataclass(frozen=True)
class Order:
    """What is to be done.

    Args:
        name: of the experiment.
        runs: seeds; None for as many as the experiment says.
        seed0: the first of them.
        executor: URL of a Dask scheduler; None for this machine's cores.
        output: directory of the results.
    """

    name: str
    runs: int | None
    seed0: int
    executor: str | None
    output: Path


def run_experiment(order: Order, console: Console) -> None:
    """Do the runs of a shipped experiment that are not done yet, and write NAME.csv, NAME.md and pictures.

    Raises:
        UsageError: before anything is run, if it cannot be.
        ProcessFailed: a worker has ended by itself.
    """
    experiment = find_experiment(order.name)
    again = f"gcs experiment {order.name} --runs {order.runs or experiment.default_runs} --seed0 {order.seed0}"
    conduct(experiment, order, console, again)


def conduct(experiment: Experiment, order: Order, console: Console, command: str) -> list[Row]:
    """As `run_experiment`, for any experiment; the rows of all runs that were asked for.

    Args:
        experiment: what is run.
        order: its `name` is not read.
        console: for the progress.
        command: that does the same again, for its summary.
    """
    if order.executor is not None:
        check_scheduler(order.executor)
    _make(order.output)
    seeds = range(order.seed0, order.seed0 + (order.runs or experiment.default_runs))
    with Ledger(order.output / f"{experiment.name}.csv", experiment.key, experiment.values) as ledger:
        todo, total = outstanding(experiment, seeds, ledger), len(experiment.runs(seeds))
        if total > len(todo):
            console.print(f"{total - len(todo)} of {total} runs are done already: {ledger.path}", markup=False)
        if todo:
            with open_executor(order.executor) as executor, RunConsole(console, experiment, len(todo)) as progress:
                perform(experiment, todo, ledger, executor, progress.show)
        rows = wanted(experiment, seeds, ledger)
        for path in _write_results(experiment, rows, order, command):
            console.print(str(path), markup=False)
        return rows


class RunConsole:
    """A progress bar of runs; on no terminal, a line at each tenth of the work."""

    def __init__(self, console: Console, experiment: Experiment, total: int) -> None:
        self._console, self._total, self._done = console, total, 0
        columns = (
            TextColumn(experiment.name),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            TextColumn("{task.fields[last]}"),
        )
        self._bar = Progress(*columns, console=console, transient=True) if console.is_terminal else None
        self._task = self._bar.add_task(experiment.name, total=total, last="") if self._bar else None

    def show(self, run: Run) -> None:
        """One more run is done."""
        self._done += 1
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, completed=self._done, last=" ".join(str(value) for _, value in run.key))
        elif self._done * 10 // self._total > (self._done - 1) * 10 // self._total:
            self._console.print(f"{self._done} of {self._total} runs done", markup=False)

    def __enter__(self) -> "RunConsole":
        if self._bar is not None:
            self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()


def _make(directory: Path) -> None:
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise UsageError(f"--output {directory}: cannot be made: {problem.strerror}") from None


def _write_results(experiment: Experiment, rows: list[Row], order: Order, command: str) -> list[Path]:
    pictures = experiment.figures(rows, order.output)
    summary = order.output / f"{experiment.name}.md"
    head = f"# {experiment.title}\n\n`{command}`: {len(rows)} runs, in {experiment.name}.csv."
    summary.write_text(f"{head}\n\n{experiment.summary(rows)}\n", encoding="utf-8")
    return [order.output / f"{experiment.name}.csv", summary, *(order.output / name for name in pictures)]
