"""What the project calls of scipy.sparse.csgraph."""

from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array

def dijkstra(
    csgraph: csr_array, *, indices: int, return_predecessors: Literal[True]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int32]]: ...
