"""Says on standard error that kernels are being compiled, which takes long; is silent while they are only loaded."""

import sys
import threading
import time
from collections.abc import Generator
from contextlib import contextmanager

from numba.core.event import Event, Listener, install_listener

PATIENCE_S = 2.0
"""Compiling that takes longer than this is announced, and again each time that it has passed."""
OTHERS_PATIENCE_S = 10.0
"""Who waits this long without compiling waits for another process that does."""


class Compilations(Listener):
    """Whether numba compiles anything: machine code that it finds on the disk is no event."""

    def __init__(self) -> None:
        self.seen = False

    def on_start(self, event: Event) -> None:
        self.seen = True

    def on_end(self, event: Event) -> None:
        """Nothing ends the need for an announcement."""


@contextmanager
def announced_compilation(text: str) -> Generator[None]:
    """Say so while the block compiles, or waits for who does, and for how long already."""
    over, compilations = threading.Event(), Compilations()
    begun_s = time.monotonic()

    def announce() -> None:
        while not over.wait(PATIENCE_S):
            waited_s = time.monotonic() - begun_s
            if compilations.seen or waited_s >= OTHERS_PATIENCE_S:
                print(f"{text} ({waited_s:.0f} s)", file=sys.stderr, flush=True)

    thread = threading.Thread(target=announce, daemon=True)
    thread.start()
    try:
        with install_listener("numba:compile", compilations):
            yield
    finally:
        over.set()
        thread.join()
