"""Compiled functions: how they are declared, and how a fleet of processes compiles them only once."""

import fcntl
import hashlib
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import njit

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """Compile `function` with numba at its first call and keep the machine code beside its source.

    Compiled code runs without the interpreter lock, so that other threads go on meanwhile. A division by zero gives
    infinity or NaN, as in numpy: the check for an exception would cost a third of the speed of small functions.

    The type of the function is kept, so that type checkers see through it. Every compiled function has a
    readable numpy reference in the tests or beside it, and a test that holds the two equal.
    """
    return cast(F, njit(cache=True, nogil=True, error_model="numpy")(function))


def inlined(function: F) -> F:
    """As `compiled`, for the small helpers that other compiled functions call in their inner loops."""
    return cast(F, njit(cache=True, inline="always", error_model="numpy")(function))


@contextmanager
def one_at_a_time(package: str) -> Iterator[None]:
    """Let one process at a time compile `package`; the others wait and then load what it compiled.

    Ten companions that start together on a fresh machine would otherwise all compile the same planner.
    """
    here = hashlib.sha256(str(Path(__file__).resolve()).encode()).hexdigest()[:12]
    lock = Path(tempfile.gettempdir()) / f"{package}-kernels-{os.getuid()}-{here}.lock"
    with lock.open("w") as handle:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield
