"""numba without SciPy, for a program that must be small.

numba looks for a BLAS when it loads its array functions, and imports SciPy's linear algebra for it: 17 MB of memory and
a fifth of a second. No kernel of the simulator multiplies matrices by BLAS; one that did would fail to compile, saying
so. Only the program does this, never the library: other code in the same process may need what is left out here.
"""

import importlib
import sys

LEFT_OUT = "scipy.linalg"
_ASKS_FOR_IT = "numba.np.arraymath"


def leave_scipy_out() -> None:
    """Load numba's array functions as on a machine without SciPy; afterwards SciPy can be imported as ever."""
    if LEFT_OUT in sys.modules:
        return
    sys.modules[LEFT_OUT] = None  # pyright: ignore[reportArgumentType] - an import of None is refused
    try:
        importlib.import_module(_ASKS_FOR_IT)
    finally:
        del sys.modules[LEFT_OUT]
