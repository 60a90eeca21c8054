"""What the project calls of scipy.spatial."""

import numpy as np
import numpy.typing as npt

class KDTree:
    n: int
    data: npt.NDArray[np.float64]
    def __init__(self, data: npt.ArrayLike) -> None: ...
    def query(self, x: npt.ArrayLike, k: int = 1) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.intp]]: ...
