"""Rows survive an interruption, and are not mistaken for those of something else."""

from pathlib import Path

import pytest

from gcs.errors import UsageError
from gcs.experiments.experiment import Run
from gcs.experiments.ledger import Ledger

KEY, VALUES = ("algorithm", "seed"), ("cost", "feasible", "note")


def run(seed: int, algorithm: str = "pso") -> Run:
    return Run((("algorithm", algorithm), ("seed", seed)))


def opened(path: Path) -> Ledger:
    return Ledger(path, KEY, VALUES)


def test_a_row_is_on_disk_as_soon_as_it_is_appended(tmp_path: Path):
    path = tmp_path / "rows.csv"
    with opened(path) as ledger:
        ledger.append(run(1), {"cost": 1.5, "feasible": True, "note": "a, b"})
        assert path.read_text() == 'algorithm,seed,cost,feasible,note\npso,1,1.5,yes,"a, b"\n'


def test_rows_that_are_there_are_known_again(tmp_path: Path):
    path = tmp_path / "rows.csv"
    with opened(path) as ledger:
        ledger.append(run(1), {"cost": 1.5, "feasible": True, "note": None})
        ledger.append(run(2), {"cost": 2.0, "feasible": False, "note": "late"})
        written = list(ledger.rows)
    with opened(path) as again:
        assert again.rows == written
        assert again.has(run(1))
        assert again.has(run(2))
        assert not again.has(run(3))
        assert not again.has(run(1, "aca"))
    assert written[0] == {"algorithm": "pso", "seed": 1, "cost": 1.5, "feasible": True, "note": None}


@pytest.mark.parametrize("torn", ["pso,2,3.", "p", "pso,2,3.5,yes,late"])
def test_a_line_that_was_torn_off_is_dropped_and_done_again(tmp_path: Path, torn: str):
    path = tmp_path / "rows.csv"
    with opened(path) as ledger:
        ledger.append(run(1), {"cost": 1.5, "feasible": True, "note": ""})
    whole = path.read_text()
    path.write_text(whole + torn)
    with opened(path) as again:
        assert not again.has(run(2))
        again.append(run(2), {"cost": 4.0, "feasible": False, "note": ""})
    assert path.read_text() == whole + "pso,2,4,no,\n"


def test_a_file_whose_heading_was_torn_off_begins_anew(tmp_path: Path):
    path = tmp_path / "rows.csv"
    path.write_text("algorithm,se")
    opened(path).__exit__(None, None, None)
    assert path.read_text() == "algorithm,seed,cost,feasible,note\n"


def test_the_file_of_another_experiment_is_refused(tmp_path: Path):
    path = tmp_path / "rows.csv"
    path.write_text("seed,x\n1,2\n")
    with pytest.raises(UsageError, match=r"rows.csv:1: expected the columns algorithm, .* found seed, x"):
        opened(path)
    assert path.read_text() == "seed,x\n1,2\n"


def test_a_line_with_too_many_cells_is_refused(tmp_path: Path):
    path = tmp_path / "rows.csv"
    path.write_text("algorithm,seed,cost,feasible,note\npso,1,1,yes,,\n")
    with pytest.raises(UsageError, match="rows.csv:2: expected 5 columns, found 6"):
        opened(path)


def test_a_place_that_cannot_be_written_is_refused(tmp_path: Path):
    with pytest.raises(UsageError, match="cannot be read and written: No such file or directory"):
        opened(tmp_path / "missing" / "rows.csv")


def test_a_row_has_all_columns(tmp_path: Path):
    with opened(tmp_path / "rows.csv") as ledger, pytest.raises(ValueError, match="needs the columns"):
        ledger.append(run(1), {"cost": 1.0})
