"""What an experiment consists of: runs that do not depend on one another, and what is made of their rows."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

Cell = str | int | float | bool | None
"""One value of a row; None where there is none."""
Row = Mapping[str, Cell]


@dataclass(frozen=True)
class Run:
    """One run: what makes it different from the others. Its result is a row with these and further columns.

    Args:
        key: (column, value) pairs; the values of all columns together name the run.
    """

    key: tuple[tuple[str, str | int], ...]

    def __getitem__(self, column: str) -> str | int:
        return dict(self.key)[column]

    def text(self, column: str) -> str:
        """A value that is a text."""
        return str(self[column])

    def number(self, column: str) -> int:
        """A value that is a whole number."""
        return int(self[column])


@dataclass(frozen=True)
class Experiment:
    """An experiment, as plain data and functions that can be sent to another process.

    Args:
        name: on the command line.
        title: one line.
        default_runs: seeds, where the command line says nothing.
        key: columns that name a run.
        values: columns that it fills.
        runs: all runs for such seeds, in the order in which they should be done.
        work: does one run; gives its values.
        figures: draws what belongs into the directory, and returns the names of the pictures.
        summary: the Markdown text below the title.
    """

    name: str
    title: str
    default_runs: int
    key: tuple[str, ...]
    values: tuple[str, ...]
    runs: Callable[[Sequence[int]], list[Run]]
    work: Callable[[Run], Row]
    figures: Callable[[Sequence[Row], Path], list[str]]
    summary: Callable[[Sequence[Row]], str]

    @property
    def columns(self) -> tuple[str, ...]:
        return self.key + self.values


def product(**columns: Sequence[str | int]) -> list[Run]:
    """All combinations of the values of columns, the last column changing fastest.

    Example:
        >>> [run.key for run in product(seed=[1, 2], algorithm=["pso"])]
        [(('seed', 1), ('algorithm', 'pso')), (('seed', 2), ('algorithm', 'pso'))]
    """
    keys: list[tuple[tuple[str, str | int], ...]] = [()]
    for column, values in columns.items():
        keys = [(*key, (column, value)) for key in keys for value in values]
    return [Run(key) for key in keys]
