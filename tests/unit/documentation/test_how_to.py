"""What the how-to pages for contributors add can be added, keeps the house's format, and does what they say."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.unit.documentation.changed_tree import ROOT, apply, changes, commands

PAGES = sorted((ROOT / "docs/how-to").glob("add-*.md"))
RUNS = [(page.stem, command) for page in PAGES for command in commands(page.read_text())]
TIMEOUT_S = 250.0
OURS = 'lint.isort.known-first-party = ["gcs", "companion", "sitl", "missions", "tests"]'
"""Ruff looks on the disk for what is ours, and new files are not there."""


def run(*words: str, text: str | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(words, input=text, cwd=ROOT, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)


def test_there_is_a_page_for_everything_that_contributors_add():
    assert [page.stem for page in PAGES] == [
        "add-a-mavlink-service",
        "add-a-panel",
        "add-a-planner",
        "add-an-autopilot-behaviour",
    ]
    assert {page for page, _ in RUNS} == {page.stem for page in PAGES}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_file_that_is_changed_is_in_the_pages_table_and_well_formed(page: Path):
    table = re.findall(r"^\| `([^`]+)` \|", page.read_text(), re.M)
    for path, text in changes(page.read_text()).items():
        assert path in table
        for check in (["check"], ["format", "--check"]):
            done = run(sys.executable, "-m", "ruff", *check, "--config", OURS, "--stdin-filename", path, "-", text=text)
            assert done.returncode == 0, f"{path}: {done.stdout}{done.stderr}"


@pytest.mark.parametrize(("page", "command"), RUNS, ids=[f"{page}-{command}" for page, command in RUNS])
def test_the_commands_of_a_page_succeed_in_the_changed_tree(page: str, command: str, tmp_path: Path):
    begin = (sys.executable, "-m", "tests.unit.documentation.changed_tree", f"docs/how-to/{page}.md", str(tmp_path))
    done = run(*begin, *shlex.split(command))
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    if command.startswith("pytest"):
        assert re.search(r"\b\d+ passed", done.stdout)


def test_a_hunk_that_fits_nowhere_or_twice_is_refused():
    assert apply("a = 1\nb = 2\n", " a = 1\n-b = 2\n+b = 3\n") == "a = 1\nb = 3\n"
    for source in ("a = 1\n", "b = 2\nb = 2\n"):
        with pytest.raises(ValueError, match="expected once"):
            apply(source, "-b = 2\n+b = 3\n", "some.py")
