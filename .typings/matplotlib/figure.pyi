"""What the project calls of matplotlib's figures."""

from pathlib import Path
from typing import IO, Any, overload

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes

class Figure:
    def __init__(
        self, figsize: tuple[float, float] | None = None, dpi: float | None = None, layout: str | None = None
    ) -> None: ...
    def add_subplot(self, rows: int, columns: int, index: int, *, projection: str | None = None) -> Axes: ...
    @overload
    def subplots(self) -> Axes: ...
    @overload
    def subplots(self, nrows: int, ncols: int, **options: Any) -> npt.NDArray[np.object_]: ...
    def savefig(self, fname: Path | IO[bytes], *, format: str | None = None, dpi: float | None = None) -> None: ...
