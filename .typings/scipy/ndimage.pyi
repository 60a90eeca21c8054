"""What the project calls of scipy.ndimage."""

import numpy as np
import numpy.typing as npt

def label(input: npt.ArrayLike, structure: npt.ArrayLike | None = None, *, output: npt.NDArray[np.int32]) -> int: ...
def binary_closing(input: npt.ArrayLike, structure: npt.ArrayLike | None = None) -> npt.NDArray[np.bool_]: ...
