"""What the project calls of scipy.optimize."""

import numpy as np
import numpy.typing as npt

def linear_sum_assignment(
    cost_matrix: npt.ArrayLike, maximize: bool = False
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]: ...
