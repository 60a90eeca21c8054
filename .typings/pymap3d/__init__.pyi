"""What the project calls of pymap3d, whose own functions say neither what they take nor what is in their tuples."""

import numpy as np
import numpy.typing as npt

_Array = npt.NDArray[np.float64]
_Triple = tuple[_Array, _Array, _Array]

class Ellipsoid:
    semimajor_axis: float
    semiminor_axis: float
    def __init__(self, semimajor_axis: float, semiminor_axis: float, name: str = ..., model: str = ...) -> None: ...

def enu2geodetic(
    e: npt.ArrayLike,
    n: npt.ArrayLike,
    u: npt.ArrayLike,
    lat0: float,
    lon0: float,
    h0: float,
    ell: Ellipsoid | None = None,
    deg: bool = True,
) -> _Triple: ...
def geodetic2enu(
    lat: npt.ArrayLike,
    lon: npt.ArrayLike,
    h: npt.ArrayLike,
    lat0: float,
    lon0: float,
    h0: float,
    ell: Ellipsoid | None = None,
    deg: bool = True,
) -> _Triple: ...
