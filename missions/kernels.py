"""Compiled functions: how they are declared, and how a fleet of processes compiles them only once.

Machine code is kept beside its source. numba throws it away when that source changes, but not when a function or a
constant that it has taken in from another module does; here it does so as well.
"""

import fcntl
import functools
import hashlib
import os
import re
import tempfile
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import config, njit
from numba.core.caching import InTreeCacheLocator, UserProvidedCacheLocator, UserWideCacheLocator

F = TypeVar("F", bound=Callable[..., Any])

ROOT = Path(__file__).parent.parent
"""Where the project's packages lie side by side."""

_IMPORT = re.compile(
    r"^\s*(?:from|import)\s+((?:missions|gcs|companion|sitl)[\w.]*)(?:\s+import\s+(.*))?$", re.MULTILINE
)


def compiled(function: F) -> F:
    """Compile `function` with numba at its first call and keep the machine code beside its source.

    Compiled code runs without the interpreter lock, so that other threads go on meanwhile. A division by zero gives
    infinity or NaN, as in numpy: the check for an exception would cost a third of the speed of small functions.

    The type of the function is kept, so that type checkers see through it. Every compiled function has a
    readable numpy reference in the tests or beside it, and a test that holds the two equal.
    """
    return cast(F, njit(cache=True, nogil=True, error_model="numpy")(function))


def sources_of(module: Path) -> set[Path]:
    """The files whose change may change what `module` compiles to: itself, and all of ours that it imports."""
    found: set[Path] = set()
    waiting = {module.resolve()}
    while waiting:
        path = waiting.pop()
        found.add(path)
        waiting |= _imported(path) - found
    return found


@functools.cache
def _imported(path: Path) -> frozenset[Path]:
    """The project's files that one file imports itself."""
    names: set[str] = set()
    for package, items in _IMPORT.findall(path.read_text(encoding="utf-8")):
        names |= {package, *(f"{package}.{item}" for item in re.findall(r"\w+", items))}
    stems = [ROOT.joinpath(*name.split(".")) for name in names]
    candidates = [stem.with_suffix(".py") for stem in stems] + [stem / "__init__.py" for stem in stems]
    return frozenset(candidate for candidate in candidates if candidate.is_file())


@functools.cache
def _stamp(py_file: str) -> bytes:
    """A digest of all `sources_of` a module."""
    contents = b"".join(path.read_bytes() for path in sorted(sources_of(Path(py_file))))
    return hashlib.sha256(contents).digest()


class _StampedWithImports:
    """A cache locator whose stamp covers a module's imports."""

    _py_file: str

    def get_source_stamp(self) -> bytes:
        return _stamp(self._py_file)


class KernelsWhereOrdered(_StampedWithImports, UserProvidedCacheLocator):
    """In $NUMBA_CACHE_DIR, if that is set."""


class KernelsBesideSource(_StampedWithImports, InTreeCacheLocator):
    """In `__pycache__`, where that can be written."""


class KernelsOfUser(_StampedWithImports, UserWideCacheLocator):
    """In the user's cache directory otherwise."""


_LOCATORS = (KernelsWhereOrdered, KernelsBesideSource, KernelsOfUser)
config.CACHE_LOCATOR_CLASSES = ",".join(  # pyright: ignore[reportAttributeAccessIssue] - numba makes its settings at run time
    f"{__name__}.{locator.__name__}" for locator in _LOCATORS
)


@contextmanager
def one_at_a_time(package: str) -> Generator[None]:
    """Let one process at a time compile `package`; the others wait and then load what it compiled.

    Ten companions that start together on a fresh machine would otherwise all compile the same planner.
    """
    here = hashlib.sha256(str(Path(__file__).resolve()).encode()).hexdigest()[:12]
    lock = Path(tempfile.gettempdir()) / f"{package}-kernels-{os.getuid()}-{here}.lock"
    with lock.open("w") as handle:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield
