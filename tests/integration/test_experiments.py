"""`gcs experiment`: real runs on a pool of processes, interrupted and continued; bad input ends with a sentence."""

import os
import signal
import subprocess
import time
from pathlib import Path

import pytest

from tests.integration import programs

PATIENCE_S = 120.0


def children_of(pid: int) -> list[int]:
    tasks = Path(f"/proc/{pid}/task").glob("*/children")
    return [int(child) for task in tasks for child in task.read_text().split()]


def test_an_experiment_writes_rows_a_summary_and_a_picture(tmp_path: Path):
    finished = programs.run("gcs", "experiment", "ackley", "--runs", "2", "--seed0", "5", "--output", str(tmp_path))
    assert finished.code == 0, finished.output
    rows = (tmp_path / "ackley.csv").read_text().splitlines()
    assert rows[0] == "seed,size,algorithm,x,y,value"
    assert sorted(row.split(",")[0] for row in rows[1:]) == 10 * ["5"] + 10 * ["6"]
    assert "| 300 x 200 | E-CPSO | 2 |" in (tmp_path / "ackley.md").read_text()
    assert (tmp_path / "ackley.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.processes
def test_ctrl_c_leaves_whole_rows_and_no_processes_and_the_next_start_goes_on(tmp_path: Path):
    arguments = ("gcs", "experiment", "ackley", "--runs", "300", "--output", str(tmp_path))
    experiment = subprocess.Popen(programs.command(*arguments), stderr=subprocess.PIPE, text=True)
    rows, deadline_s = tmp_path / "ackley.csv", time.monotonic() + PATIENCE_S
    while not rows.exists() or len(rows.read_text().splitlines()) < 5:
        assert time.monotonic() < deadline_s
        time.sleep(0.02)
    workers = children_of(experiment.pid)
    experiment.send_signal(signal.SIGINT)
    _, errors = experiment.communicate(timeout=PATIENCE_S)
    assert experiment.returncode == 130
    assert "Traceback" not in errors
    while any(os.path.exists(f"/proc/{worker}") for worker in workers):  # the last of them notices a moment later
        assert time.monotonic() < deadline_s
        time.sleep(0.02)
    done = rows.read_text()
    assert done.endswith("\n")
    assert len(done.splitlines()) < 3001
    finished = programs.run("gcs", "experiment", "ackley", "--runs", "3", "--output", str(tmp_path))
    assert finished.code == 0, finished.output
    assert "of 30 runs are done already" in finished.output
    assert rows.read_text().startswith(done)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("figure5",), "experiment figure5: expected one of ackley, allocation, paths, convergence, table2"),
        (("ackley", "--runs", "0"), "--runs"),
        (("ackley", "--executor", "nowhere"), "--executor nowhere: expected the address of a Dask scheduler"),
        (("ackley", "--executor", "tcp://127.0.0.1:9"), "no scheduler answers there"),
        (("ackley", "--output", "/dev/null/out"), "--output /dev/null/out: cannot be made"),
    ],
)
def test_bad_input_ends_with_a_sentence(arguments: tuple[str, ...], sentence: str, tmp_path: Path):
    elsewhere = () if "--output" in arguments else ("--output", str(tmp_path))
    finished = programs.run("gcs", "experiment", *arguments, *elsewhere)
    assert finished.code == 2
    assert sentence in finished.output
    assert "Traceback" not in finished.output


def test_help_gives_examples():
    finished = programs.run("gcs", "experiment", "--help")
    assert finished.code == 0
    assert "gcs experiment table2 --runs 5" in finished.output


@pytest.mark.slow
@pytest.mark.parametrize("algorithm", ["pso", "ipso", "gapso", "ca", "aca"])
def test_a_baseline_plans_like_the_planner_itself(algorithm: str):
    finished = programs.run("gcs", "plan", "indoor", "--algorithm", algorithm)
    assert finished.code == 0, finished.output
    assert "feasible, objective" in finished.output
    assert f"{algorithm} seed 0" in finished.output
