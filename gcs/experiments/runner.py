"""Doing the runs of an experiment that are not done yet, on any `concurrent.futures.Executor`."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future, as_completed
from concurrent.futures.process import BrokenProcessPool

from gcs.errors import ProcessFailed
from gcs.experiments.experiment import Experiment, Row, Run
from gcs.experiments.ledger import Ledger


def outstanding(experiment: Experiment, seeds: Sequence[int], ledger: Ledger) -> list[Run]:
    """Runs for these seeds whose rows are not in the ledger."""
    return [run for run in experiment.runs(seeds) if not ledger.has(run)]


def wanted(experiment: Experiment, seeds: Sequence[int], ledger: Ledger) -> list[Row]:
    """Rows of the runs for these seeds, in the order of the runs."""
    by_key = {tuple(row[column] for column in experiment.key): row for row in ledger.rows}
    names = [tuple(value for _, value in run.key) for run in experiment.runs(seeds)]
    return [by_key[name] for name in names if name in by_key]


def perform(
    experiment: Experiment, runs: Sequence[Run], ledger: Ledger, executor: Executor, on_done: Callable[[Run], None]
) -> None:
    """Do runs, in whatever order they end, and write each one's row as it ends.

    Args:
        experiment: what they belong to.
        runs: to be done.
        ledger: where rows go.
        executor: where runs are done.
        on_done: called after each row is written.

    Raises:
        ProcessFailed: a worker has ended by itself.
    """
    waiting: dict[Future[Row], Run] = {}
    try:
        for run in runs:
            waiting[executor.submit(experiment.work, run)] = run
        for future in as_completed(waiting):
            run = waiting[future]
            ledger.append(run, future.result())
            on_done(run)
    except BrokenProcessPool:
        raise ProcessFailed(f"experiment {experiment.name}: a worker process has ended by itself") from None
    finally:
        for future in waiting:
            future.cancel()
