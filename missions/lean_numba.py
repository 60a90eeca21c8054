"""numba without SciPy and cffi, and without LLVM in memory, for programs that must be small and start quickly.

numba looks for a BLAS when it loads its array functions, and imports SciPy's linear algebra for it: 17 MB of memory and
a fifth of a second. It looks for cffi, too, to call what that has wrapped: a parser of C, for nothing. No kernel of
these programs multiplies matrices by BLAS or calls C; one that did would fail to compile, saying so. Only programs do
this, never a library: other code in the same process may need what is left out here.
"""

import ctypes
import importlib
import sys
from pathlib import Path

COMPILER = "libllvmlite"
MADV_PAGEOUT = 21

ASKS_FOR = {"scipy.linalg": "numba.np.arraymath", "cffi": "numba.core.typing.cffi_utils"}
"""What is left out -> the module of numba that would import it."""


def leave_out_what_no_kernel_needs() -> None:
    """Load parts of numba as on a machine without SciPy and cffi; afterwards both can be imported as ever."""
    for left_out, asks_for_it in ASKS_FOR.items():
        if left_out in sys.modules:
            continue
        sys.modules[left_out] = None  # pyright: ignore[reportArgumentType] - an import of None is refused
        try:
            importlib.import_module(asks_for_it)
        finally:
            del sys.modules[left_out]


def give_back_the_compiler() -> None:
    """Let the kernel reclaim LLVM's pages, some 65 MB: all is compiled or loaded. It reads them again when needed.

    Only Linux can be told so; elsewhere nothing happens.
    """
    maps = Path("/proc/self/maps")
    if not maps.exists():
        return
    libc = ctypes.CDLL(None)
    for line in maps.read_text().splitlines():
        if COMPILER in line:
            begin, end = (int(address, 16) for address in line.split(maxsplit=1)[0].split("-"))
            libc.madvise(ctypes.c_void_p(begin), ctypes.c_size_t(end - begin), MADV_PAGEOUT)
