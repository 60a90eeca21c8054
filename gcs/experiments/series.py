"""Lists of numbers as text in one cell of a row."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from gcs.experiments.experiment import Cell

Array = npt.NDArray[np.float64]


def to_cell(values: Sequence[float] | Array) -> str:
    """Numbers, six digits each.

    Example:
        >>> to_cell([1.0, 2.5])
        '1;2.5'
    """
    return ";".join(f"{value:.6g}" for value in values)


def from_cell(cell: Cell) -> Array:
    """(n,) the numbers again."""
    return np.array([float(part) for part in str(cell).split(";")])
