"""What the documentation names in the code is there: files and folders, tests, classes and functions."""

import re
from pathlib import Path

import pytest

from tests.unit.documentation.changed_tree import ROOT, changes

PAGES = [ROOT / "README.md", *sorted(path for path in (ROOT / "docs").rglob("*.md") if "decisions" not in path.parts)]
PACKAGES = ("gcs", "companion", "sitl", "missions", "tests", "docs")
FILES = [path.relative_to(ROOT) for package in PACKAGES for path in (ROOT / package).rglob("*") if path.is_file()]
NAMES = {path.name for path in FILES} | {path.stem for path in FILES}
SOURCES = {str(path): (ROOT / path).read_text() for path in FILES if path.suffix in {".py", ".yaml", ".css", ".toml"}}
WORDS = {word for text in SOURCES.values() for word in re.findall(r"\w+", text)}
DEFINED = {name for text in SOURCES.values() for name in re.findall(r"^ *(?:async )?def (\w+)", text, re.M)}

OF_OTHERS = {"px4_sitl", "sihsim_quadx"}
"""Names in PX4's own sources."""

PATH = re.compile(rf"(?:{'|'.join(PACKAGES)})/[\w./-]*")
IN_A_FOLDER = re.compile(r"\w+(?:/\w+)*/\w+\.(?:py|md|yaml|css)")
CODE = re.compile(r"[a-z]\w*_\w+|[A-Z][a-z0-9]+(?:[A-Z][a-z0-9]+)+")
DOTTED = re.compile(r"(?:gcs|companion|sitl|missions|tests)(?:\.\w+)+")


def text_of(page: Path) -> str:
    """A page without its blocks of code."""
    return re.sub(r"^```.*?^```", "", page.read_text(), flags=re.S | re.M)


def quoted(page: Path) -> set[str]:
    return set(re.findall(r"`([^`\n]+)`", text_of(page)))


def named(page: Path, pattern: re.Pattern[str]) -> set[str]:
    """The quoted names of one kind, without those that a how-to page has its reader write."""
    own = " ".join((*changes(page.read_text()), *changes(page.read_text()).values()))
    return {name for name in quoted(page) if pattern.fullmatch(name) and name not in own}


def id_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


@pytest.mark.parametrize("page", PAGES, ids=id_of)
def test_every_path_exists(page: Path):
    assert {name for name in named(page, PATH) if not (ROOT / name).exists()} == set()
    paths = [f"/{path}" for path in FILES]
    ends = {name for name in named(page, IN_A_FOLDER) if not any(path.endswith(f"/{name}") for path in paths)}
    assert ends == set()


@pytest.mark.parametrize("page", PAGES, ids=id_of)
def test_every_test_exists(page: Path):
    tests = {name.removesuffix(".py") for name in named(page, re.compile(r"test_\w+(?:\.py)?"))}
    assert tests - NAMES - DEFINED == set()


@pytest.mark.parametrize("page", PAGES, ids=id_of)
def test_every_name_stands_in_the_code(page: Path):
    assert named(page, CODE) - WORDS - NAMES - OF_OTHERS == set()
    for name in named(page, DOTTED):
        assert set(name.split(".")) <= WORDS | NAMES | {path.parts[0] for path in FILES}, name


def test_there_are_names_to_look_up():
    found = {kind.pattern: sum(len(named(page, kind)) for page in PAGES) for kind in (PATH, IN_A_FOLDER, CODE, DOTTED)}
    assert min(found.values()) > 5, found
