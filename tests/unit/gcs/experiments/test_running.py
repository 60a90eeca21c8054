"""Experiments run what is missing, on whatever executor there is, and say clearly what cannot be."""

import io
from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest
from distributed import LocalCluster
from rich.console import Console

from gcs.errors import UsageError
from gcs.experiments import catalogue, command
from gcs.experiments.command import Order, run_experiment
from gcs.experiments.executors import check_scheduler
from gcs.experiments.experiment import Run
from gcs.experiments.ledger import Ledger
from gcs.experiments.runner import outstanding, perform, wanted
from tests.unit.gcs.experiments import toy
from tests.unit.gcs.experiments.toy import TOY


@pytest.fixture
def ledger(tmp_path: Path) -> Iterator[Ledger]:
    with Ledger(tmp_path / "toy.csv", TOY.key, TOY.values) as opened:
        yield opened


@pytest.fixture
def executor() -> Iterator[Executor]:
    with ThreadPoolExecutor(2) as pool:
        yield pool


def test_all_runs_are_done_and_written(ledger: Ledger, executor: Executor):
    done: list[Run] = []
    perform(TOY, outstanding(TOY, range(3), ledger), ledger, executor, done.append)
    assert sorted(row["value"] for row in wanted(TOY, range(3), ledger)) == [0, 0, 1, 1, 4, 8]
    assert len(done) == 6
    assert len(ledger.path.read_text().splitlines()) == 7


def test_rows_are_in_the_order_of_the_runs_whatever_ended_first(ledger: Ledger, executor: Executor):
    perform(TOY, TOY.runs(range(4))[::-1], ledger, executor, lambda _: None)
    assert [row["seed"] for row in wanted(TOY, range(4), ledger)] == [0, 0, 1, 1, 2, 2, 3, 3]


def test_what_is_done_is_not_done_again(ledger: Ledger, executor: Executor):
    perform(TOY, TOY.runs(range(2)), ledger, executor, lambda _: None)
    assert [run["seed"] for run in outstanding(TOY, range(4), ledger)] == [2, 2, 3, 3]


def test_rows_written_before_a_run_failed_stay(ledger: Ledger, executor: Executor):
    failing = replace(TOY, work=toy.broken)
    perform(failing, TOY.runs([1]), ledger, executor, lambda _: None)
    with pytest.raises(ArithmeticError, match="two is too many"):
        perform(failing, TOY.runs([2, 3]), ledger, executor, lambda _: None)
    seeds = {row["seed"] for row in ledger.rows}
    assert 1 in seeds
    assert 2 not in seeds


def test_an_interrupted_experiment_goes_on_where_it_was(ledger: Ledger, executor: Executor):
    def interrupt(_: Run) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        perform(TOY, TOY.runs(range(5)), ledger, executor, interrupt)
    assert len(ledger.rows) == 1
    perform(TOY, outstanding(TOY, range(5), ledger), ledger, executor, lambda _: None)
    assert len(wanted(TOY, range(5), ledger)) == 10
    assert len(ledger.path.read_text().splitlines()) == 11


@pytest.mark.filterwarnings("ignore::Warning")  # what Dask warns of is its own business
def test_a_dask_cluster_does_the_same_runs(ledger: Ledger):
    with (
        LocalCluster(
            n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None, protocol="tcp"
        ) as cluster,
        command.open_executor(cluster.scheduler_address) as executor,
    ):
        perform(TOY, TOY.runs(range(3)), ledger, executor, lambda _: None)
    assert sorted(row["value"] for row in wanted(TOY, range(3), ledger)) == [0, 0, 1, 1, 4, 8]


@pytest.mark.parametrize("url", ["nonsense", "http://localhost:80", "tcp://", "tcp://host", "tcp://host:8786/x"])
def test_only_addresses_of_schedulers_are_taken_for_executors(url: str):
    with pytest.raises(UsageError, match="expected the address of a Dask scheduler"):
        check_scheduler(url)


def ordered(tmp_path: Path, name: str = "toy", **changes: object) -> str:
    shown = io.StringIO()
    run_experiment(replace(Order(name, 2, 5, None, tmp_path / "out"), **changes), Console(file=shown, width=200))
    return shown.getvalue()


@pytest.fixture
def toy_on_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(catalogue.EXPERIMENTS, "toy", TOY)
    monkeypatch.setattr(command, "open_executor", lambda _: ThreadPoolExecutor(1))


@pytest.mark.usefixtures("toy_on_threads")
def test_an_experiment_leaves_rows_a_summary_and_pictures(tmp_path: Path):
    shown = ordered(tmp_path)
    summary = (tmp_path / "out" / "toy.md").read_text()
    assert summary == "# A toy\n\n`gcs experiment toy --runs 2 --seed0 5`: 4 runs, in toy.csv.\n\n4 rows\n"
    assert (tmp_path / "out" / "toy.png").read_text() == "4"
    assert "4 of 4 runs done" in shown
    assert "toy.csv" in shown


@pytest.mark.usefixtures("toy_on_threads")
def test_started_again_it_says_what_is_done_already(tmp_path: Path):
    ordered(tmp_path)
    assert "4 of 6 runs are done already" in ordered(tmp_path, runs=3)


@pytest.mark.usefixtures("toy_on_threads")
def test_fewer_runs_than_there_are_rows_make_a_summary_of_those(tmp_path: Path):
    ordered(tmp_path, runs=4)
    ordered(tmp_path, runs=1)
    assert "2 rows" in (tmp_path / "out" / "toy.md").read_text()


def test_an_unknown_experiment_is_refused_with_the_names_there_are(tmp_path: Path):
    with pytest.raises(UsageError, match="experiment figure5: expected one of .*table2"):
        ordered(tmp_path, name="figure5")
    assert not (tmp_path / "out").exists()


def test_an_output_that_cannot_be_made_is_refused(tmp_path: Path):
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match="cannot be made: Not a directory"):
        ordered(tmp_path, name="table2", output=tmp_path / "file" / "out")
