"""Required figures, and the tables in which they are printed."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table as RichTable


@dataclass(frozen=True)
class Figure:
    """One required figure.

    Args:
        what: in words.
        found: the measured value.
        limit: that it may reach.
        at_least: whether more is better.
        unit: of both.
    """

    what: str
    found: float
    limit: float
    at_least: bool = False
    unit: str = "s"

    @property
    def met(self) -> bool:
        return bool(self.found >= self.limit if self.at_least else self.found <= self.limit)

    def __str__(self) -> str:
        sense = "at least" if self.at_least else "at most"
        return f"{self.what}: {number(self.found)} {self.unit}, required is {sense} {number(self.limit)} {self.unit}"


@dataclass(frozen=True)
class Table:
    """Rows of text under a header."""

    title: str
    header: tuple[str, ...]
    rows: list[tuple[str, ...]] = field(default_factory=list)

    def print(self, console: Console) -> None:
        table = RichTable(*self.header, title=self.title, title_justify="left")
        for row in self.rows:
            table.add_row(*row)
        console.print(table)

    def markdown(self) -> str:
        lines = [f"### {self.title}", "", _line(self.header), _line(["---"] * len(self.header))]
        return "\n".join(lines + [_line(row) for row in self.rows]) + "\n"


@dataclass
class Results:
    """What a run of the benchmark has found so far."""

    console: Console
    tables: list[Table] = field(default_factory=list)
    figures: list[Figure] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def note(self, text: str) -> None:
        """Keep and print a sentence."""
        self.notes.append(text)
        self.console.print(text, highlight=False)

    def add(self, table: Table, figures: Sequence[Figure]) -> None:
        """Keep and print one part of the benchmark."""
        self.tables.append(table)
        self.figures += figures
        table.print(self.console)
        for figure in figures:
            if not figure.met:
                self.console.print(f"  MISSED  {figure}", style="bold red", highlight=False)

    @property
    def missed(self) -> list[Figure]:
        return [figure for figure in self.figures if not figure.met]

    def conclude(self, path: Path | None) -> int:
        """Write everything to a file, where one is given, and print the verdict; the exit code."""
        if path is not None:
            path.write_text(self.markdown())
        met = len(self.figures) - len(self.missed)
        self.console.print(f"{met} of {len(self.figures)} required figures met", style="bold", highlight=False)
        for figure in self.missed:
            self.console.print(f"MISSED  {figure}", style="bold red", highlight=False)
        return 1 if self.missed else 0

    def markdown(self) -> str:
        """All tables, and the verdict on every figure."""
        verdicts = [f"* {'met' if figure.met else '**missed**'}: {figure}" for figure in self.figures]
        tables = [table.markdown() for table in self.tables]
        return "\n".join([*self.notes, "", *tables, "### Required figures", "", *verdicts]) + "\n"


def expected_time_s(times_s: Sequence[float], reached: Sequence[bool]) -> float:
    """Expected time to a goal when attempts are repeated until one succeeds: all time spent, per success (ERT).

    Args:
        times_s: of each attempt, whether it reached the goal or not.
        reached: whether it did.
    """
    return float(np.sum(times_s)) / successes if (successes := int(np.sum(reached))) else np.inf


def number(value: float) -> str:
    """Three significant digits; a dash for what never happened."""
    return "–" if not np.isfinite(value) else f"{value:.3g}" if abs(value) < 1000.0 else f"{value:.0f}"


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"
