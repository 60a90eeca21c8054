"""What the project calls of pymap3d, whose own functions say neither what they take nor what is in their tuples."""

from typing import Protocol

import numpy as np
import numpy.typing as npt

_Array = npt.NDArray[np.float64]

class _Conversion(Protocol):
    """Three coordinates of places to three others, about an origin in degrees and metres."""

    def __call__(
        self, x: npt.ArrayLike, y: npt.ArrayLike, z: npt.ArrayLike, lat0: float, lon0: float, h0: float, /
    ) -> tuple[_Array, _Array, _Array]: ...

enu2geodetic: _Conversion
geodetic2enu: _Conversion
