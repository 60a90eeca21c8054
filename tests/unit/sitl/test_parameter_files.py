"""Parameters that outlast a simulation."""

from pathlib import Path

import pytest

from sitl.autopilot.memory import Memory
from sitl.autopilot.parameter_table import parameter_table
from sitl.dynamics.airframe import X500_LIKE
from sitl.errors import BadParameterFile
from sitl.link.parameter_files import ParameterFiles
from sitl.simulator import Simulator
from tests.unit.sitl.flown import field

TABLE = parameter_table(X500_LIKE)


def test_what_is_set_is_there_again_in_the_next_simulation(tmp_path: Path):
    files = ParameterFiles(tmp_path / "new", TABLE)
    simulator = Simulator(field(2), seed=1, memories={i: Memory(parameters=files.load(i)) for i in (1, 2)})
    parameters = simulator.vehicles[2].autopilot.parameters
    parameters.set("MPC_XY_CRUISE", 0.10000000149011612)
    parameters.set("COM_OBL_RC_ACT", 5)
    files.save(simulator.memories)
    assert not files.path(1).exists()
    again = ParameterFiles(tmp_path / "new", TABLE)
    following = Simulator(field(2), seed=1, memories={i: Memory(parameters=again.load(i)) for i in (1, 2)})
    kept = following.vehicles[2].autopilot.parameters
    assert kept.stored("MPC_XY_CRUISE") == 0.10000000149011612
    assert kept["COM_OBL_RC_ACT"] == 5
    assert kept.hash_check() == parameters.hash_check()
    assert following.vehicles[1].autopilot.parameters.stored("COM_OBL_RC_ACT") == 0


def test_files_are_in_the_format_of_qgroundcontrol(tmp_path: Path):
    files = ParameterFiles(tmp_path, TABLE)
    files.save({3: Memory(parameters={"MPC_XY_CRUISE": 2.5, "GF_ACTION": 3})})
    header, *lines = files.path(3).read_text().splitlines()
    assert header.startswith("#")
    assert lines == ["3\t1\tGF_ACTION\t3\t6", "3\t1\tMPC_XY_CRUISE\t2.5\t9"]


def test_nothing_is_written_while_nothing_changes(tmp_path: Path):
    files = ParameterFiles(tmp_path, TABLE)
    memory = Memory(parameters={"GF_ACTION": 3})
    files.save({1: memory})
    files.path(1).unlink()
    files.save({1: memory})
    assert list(tmp_path.iterdir()) == []


def test_parameters_of_other_autopilots_are_passed_over(tmp_path: Path):
    files = ParameterFiles(tmp_path, TABLE)
    files.path(1).write_text("# a comment\n\n1\t1\tSYS_AUTOSTART\t4001\t6\n1\t1\tGF_ACTION\t1\t6\n")
    assert files.load(1) == {"GF_ACTION": 1}


@pytest.mark.parametrize(
    "line",
    [
        "GF_ACTION 1",
        "1\t1\tGF_ACTION\tone\t6",
        "1\t1\tGF_ACTION\t1\t9",
        "1\t1\tGF_ACTION\t3000000000\t6",
        "1\t1\tMPC_XY_CRUISE\tnan\t9",
        "1\t1\tMPC_XY_CRUISE\t1e39\t9",
    ],
)
def test_a_line_that_is_no_parameter_is_refused_with_its_place(tmp_path: Path, line):
    files = ParameterFiles(tmp_path, TABLE)
    files.path(1).write_text(f"# first\n{line}\n")
    with pytest.raises(BadParameterFile, match=r"vehicle-1\.params:2: expected"):
        files.load(1)
