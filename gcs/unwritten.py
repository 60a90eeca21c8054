"""A file that cannot be written, on a full disk or a lost one, costs what was to stand in it, and never a flight."""

from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType


@dataclass
class Unwritten:
    """Surrounds the writes to one file: what the system refuses is counted, and told once.

    Args:
        what: the file, as an operator knows it.
        say: takes the sentence.
    """

    what: str
    say: Callable[[str], None]
    count: int = 0

    def __enter__(self) -> None:
        return

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, trace: TracebackType | None
    ) -> bool:
        if not isinstance(problem, OSError):
            return False
        self.count += 1
        if self.count == 1:
            self.say(f"{self.what} cannot be written: {problem.strerror}; everything else goes on without it")
        return True


def unheard(text: str) -> None:
    """Where nobody is told."""
