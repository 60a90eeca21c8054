"""The tree as a how-to page would change it: what the page adds or changes is imported in place of what is on disk.

A page's blocks have the file that they belong to as their title. A block of Python is a new file; a diff has hunks,
with `@@` between them, whose unchanged and removed lines stand exactly once in the file.

    python -m tests.unit.documentation.changed_tree PAGE FOLDER WORD...

runs `pytest ARGUMENTS...` or one of our programs in the changed tree, with the page's tests written into FOLDER.
"""

import importlib
import re
import sys
from collections.abc import Mapping, Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import spec_from_file_location
from pathlib import Path
from types import CodeType, ModuleType

import pytest

ROOT = Path(__file__).parents[3]
BLOCK = re.compile(r'^```(python|diff) title="([^"]+)"\n(.*?)^```$', re.M | re.S)
COMMAND = re.compile(r"^    (?:\.venv/bin/python -m )?((?:pytest|gcs|companion|sitl) .*)$", re.M)


def changes(page: str) -> dict[str, str]:
    """Path and whole new text of every file that a page adds or changes.

    Raises:
        ValueError: a file that is to be added is there already, or a hunk does not fit.
    """
    return {path: _changed(kind, path, block) for kind, path, block in BLOCK.findall(page)}


def commands(page: str) -> list[str]:
    """What the page has its reader run."""
    return COMMAND.findall(page)


def _changed(kind: str, path: str, block: str) -> str:
    if kind == "diff":
        return apply((ROOT / path).read_text(), block, path)
    if (ROOT / path).exists():
        raise ValueError(f"{path} is to be added, and there already")
    return block


def apply(source: str, diff: str, path: str = "") -> str:
    """A text after a diff."""
    for hunk in diff.split("@@\n"):
        lines = hunk.splitlines(keepends=True)
        old = "".join(line[1:] for line in lines if line[0] in " -")
        new = "".join(line[1:] for line in lines if line[0] in " +")
        if source.count(old) != 1:
            raise ValueError(f"{path}: found {source.count(old)} times, expected once:\n{old}")
        source = source.replace(old, new)
    return source


class _Given(SourceFileLoader):
    """Loads a module from a text, under the name and path of its file."""

    def __init__(self, name: str, path: str, text: str) -> None:
        super().__init__(name, path)
        self._text = text

    def get_code(self, fullname: str) -> CodeType:
        return compile(self._text, self.path, "exec", dont_inherit=True)


class ChangedModules(MetaPathFinder):
    """Finds the modules that a page adds or changes."""

    def __init__(self, changed: Mapping[str, str]) -> None:
        self._changed = changed

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        file = fullname.replace(".", "/") + ".py"
        if file not in self._changed:
            return None
        place = str(ROOT / file)
        return spec_from_file_location(fullname, place, loader=_Given(fullname, place, self._changed[file]))


def main(page: str, folder: str, program: str, *arguments: str) -> int:
    """Run one command in the changed tree; its exit code."""
    changed = changes(Path(page).read_text())
    sys.meta_path.insert(0, ChangedModules(changed))
    if program == "pytest":
        written = {path: _written(Path(folder), path, text) for path, text in changed.items() if path in arguments}
        words = [written.get(word, word) for word in arguments]
        return int(pytest.main([*words, "-q", "-p", "no:cacheprovider", "-c", "pyproject.toml", "--rootdir", "."]))
    sys.argv = [program, *arguments]
    importlib.import_module(f"{program}.cli").main()
    return 0


def _written(folder: Path, path: str, text: str) -> str:
    place = folder / Path(path).name
    place.write_text(text)
    return str(place)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
