"""What the project calls of scipy.stats."""

from typing import Literal, NamedTuple

import numpy.typing as npt

_Alternative = Literal["two-sided", "less", "greater"]

class _Significance(NamedTuple):
    statistic: float
    pvalue: float

def mannwhitneyu(x: npt.ArrayLike, y: npt.ArrayLike, *, alternative: _Alternative = "two-sided") -> _Significance: ...
def wilcoxon(x: npt.ArrayLike, *, alternative: _Alternative = "two-sided") -> _Significance: ...
