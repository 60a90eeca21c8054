"""The CSV file of an experiment: rows are appended as runs are done, so that an interrupted experiment can go on."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import TextIO

from gcs.errors import UsageError
from gcs.experiments.experiment import Cell, Row, Run

TRUE, FALSE = "yes", "no"


class Ledger:
    """Rows that are done, on disk. To be used in a `with` block.

    Args:
        path: of the CSV file; made if there is none.
        key: columns that name a run.
        values: the other columns.

    Raises:
        UsageError: the file cannot be written, or is that of another experiment.
    """

    def __init__(self, path: Path, key: Sequence[str], values: Sequence[str]) -> None:
        self.path, self._key, self._columns = path, tuple(key), (*key, *values)
        self.rows: list[Row] = []
        try:
            if path.exists():
                self._read()
            self._file = self._open()
        except OSError as problem:
            raise UsageError(f"{path}: cannot be read and written: {problem.strerror}") from None
        self._done = {self._name(row) for row in self.rows}

    def has(self, run: Run) -> bool:
        """Whether a run is done."""
        return self._name(dict(run.key)) in self._done

    def append(self, run: Run, values: Row) -> Row:
        """Write the row of a run that is done, at once."""
        row = {**dict(run.key), **values}
        if set(row) != set(self._columns):
            raise ValueError(f"{self.path}: a row needs the columns {self._columns}, found {tuple(row)}")
        self._write(self._file, [_as_text(row[column]) for column in self._columns])
        written = {column: _as_cell(_as_text(row[column])) for column in self._columns}
        self.rows.append(written)
        self._done.add(self._name(row))
        return written

    def __enter__(self) -> "Ledger":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    def _name(self, row: Row) -> tuple[str, ...]:
        return tuple(_as_text(row[column]) for column in self._key)

    def _open(self) -> TextIO:
        file = self.path.open("a", encoding="utf-8", newline="")
        if file.tell() == 0:
            self._write(file, self._columns)
        return file

    def _write(self, file: TextIO, cells: Sequence[str]) -> None:
        line = io.StringIO()
        csv.writer(line, lineterminator="\n").writerow(cells)
        file.write(line.getvalue())
        file.flush()

    def _read(self) -> None:
        """Take over what is there, but for a last line that was torn off while it was written."""
        content = self.path.read_bytes()
        whole = content[: content.rfind(b"\n") + 1]
        if whole != content:
            with self.path.open("r+b") as file:
                file.truncate(len(whole))
        lines = list(csv.reader(io.StringIO(whole.decode("utf-8", errors="replace"))))
        if lines and tuple(lines[0]) != self._columns:
            raise UsageError(
                f"{self.path}:1: expected the columns {', '.join(self._columns)}, found {', '.join(lines[0])}; "
                "give another --output, or remove the file"
            )
        for number, cells in enumerate(lines[1:], start=2):
            if len(cells) != len(self._columns):
                raise UsageError(f"{self.path}:{number}: expected {len(self._columns)} columns, found {len(cells)}")
            self.rows.append(dict(zip(self._columns, map(_as_cell, cells), strict=True)))


def _as_text(cell: Cell) -> str:
    if cell is None:
        return ""
    if isinstance(cell, bool):
        return TRUE if cell else FALSE
    text = f"{cell:.6g}" if isinstance(cell, float) else str(cell)
    if "\n" in text or "\r" in text:
        raise ValueError(f"a cell has to be one line, found {text!r}")
    return text


def _as_cell(text: str) -> Cell:
    if text in {"", TRUE, FALSE}:
        return {"": None, TRUE: True, FALSE: False}[text]
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text
