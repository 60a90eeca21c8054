"""Commands, targets and files that the documentation names exist, and the tutorial's mission can be flown."""

import importlib
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
import typer

from gcs.planner import plan_mission
from missions.mission import load_mission

ROOT = Path(__file__).parents[3]
PAGES = [ROOT / "README.md", *sorted(path for path in (ROOT / "docs").rglob("*.md") if "decisions" not in path.parts)]
PROGRAMS = ("gcs", "companion", "sitl")


CALL = re.compile(rf"(?:\S*bin/)?(?:{'|'.join(PROGRAMS)}) [\w-][^`|]*")


def calls(pattern: str) -> list[tuple[str, str]]:
    """Page and call, wherever what a pattern finds runs one of our programs."""
    found = set()
    for page in PAGES:
        for code in re.findall(pattern, page.read_text(), re.M):
            line = re.split(r"  +|\s#", code)[0].strip()
            if CALL.fullmatch(line) and not line.endswith("DIR"):
                found.add((page.name, line))
    return sorted(found)


LINES = calls(r"^(?: {4})?(\S.*)$")
MENTIONS = calls(r"`([^`\n]+)`")


def find_command(line: str):
    """What a call runs, and its arguments; raises if there is no such command."""
    program, *arguments = shlex.split(line)
    command = typer.main.get_command(importlib.import_module(f"{Path(program).name}.cli").app)
    while hasattr(command, "resolve_command"):
        group = command.make_context(command.name, [], resilient_parsing=True)
        _, command, arguments = command.resolve_command(group, arguments)
    return command, arguments


def test_the_documentation_has_calls_to_try():
    assert (len(LINES) > 20, len(MENTIONS) > 20) == (True, True)


@pytest.mark.parametrize(("page", "line"), LINES)
def test_every_call_in_a_block_of_code_is_understood(page: str, line: str):
    command, arguments = find_command(line)
    command.make_context(command.name, arguments)


@pytest.mark.parametrize(("page", "line"), MENTIONS)
def test_every_call_in_the_text_has_its_options(page: str, line: str):
    command, arguments = find_command(line)
    known = {name for parameter in command.params for name in parameter.opts} | {"--help"}
    assert {word for word in arguments if word.startswith("--")} <= known


def test_every_target_of_make_that_is_named_exists():
    targets = set(re.findall(r"^([a-z0-9-]+):", (ROOT / "Makefile").read_text(), re.M))
    for page in PAGES:
        named = set(re.findall(r"(?:^ {4}|`)make ([a-z0-9-]+)(?!_)\b", page.read_text(), re.M))
        assert named <= targets, page.name


def rows(page: str, columns: int) -> list[list[str]]:
    """The cells of all lines of a page's tables with so many columns, heads left out."""
    lines = [line for line in (ROOT / page).read_text().splitlines() if line.startswith("| ") and "---" not in line]
    cells = [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines]
    return [row for row in cells if len(row) == columns and row[-1] not in {"deviation", "last soak"}]


def test_every_equation_of_the_paper_is_found_in_the_code():
    table = [row for row in rows("docs/maths/paper.md", 5) if row[0].isdigit() and "`" in row[2]]
    assert {int(row[0]) for row in table} >= set(range(1, 24))
    for row in rows("docs/maths/paper.md", 5):
        if row[2] == "–":
            continue
        path, name = row[2].strip("`"), row[3].strip("`")
        assert re.search(rf"^\s*(?:def|class) {name}\b", (ROOT / path).read_text(), re.M), f"{path}: {name}"


def test_every_test_of_the_fault_matrix_exists():
    table = rows("docs/fault-matrix.md", 5)
    assert len(table) > 20
    kinds = (ROOT / "docs/results/soak.md").read_text()
    for fault, _, _, shown_by, soak in table:
        named = re.findall(r"`(tests/[\w/]+\.py)` `(\w+)`", shown_by)
        assert named or shown_by == "none", fault
        for path, name in named:
            assert re.search(rf"^(?:async )?def {name}\b", (ROOT / path).read_text(), re.M), f"{path}: {name}"
        for kind in re.findall(r"`([\w-]+)`", soak):
            assert f"| {kind} |" in kinds, f"{fault}: {kind} is not in the last soak"


def test_the_mission_of_the_tutorial_is_planned(tmp_path: Path):
    (source,) = re.findall(r"```yaml\n(.*?)```", (ROOT / "docs/tutorials/write-a-mission.md").read_text(), re.S)
    path = tmp_path / "warehouse.yaml"
    path.write_text(source)
    mission = load_mission(path)
    (unmapped,) = (box for box in mission.world.boxes if not box.known)
    plan = plan_mission(mission)
    assert plan.feasible
    away_m = [
        np.abs(vehicle.curve_m - np.array(unmapped.centre_m)) - np.array(unmapped.half_m) for vehicle in plan.vehicles
    ]
    assert [bool((each.max(axis=1) < 0.0).any()) for each in away_m] == [False, True]  # the map misleads bravo alone
