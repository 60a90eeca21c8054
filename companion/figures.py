"""Figures of a flight that the status reports: quantiles of what was measured, without keeping all of it."""

import numpy as np


class Quantiles:
    """Quantiles of non-negative values, to a fixed resolution.

    Args:
        resolution: width of a bin.
        largest: everything above counts as this.

    Example:
        >>> errors = Quantiles(resolution=0.01, largest=10.0)
        >>> for value in (0.1, 0.2, 0.3):
        ...     errors.add(value)
        >>> round(errors.at(0.5), 2)
        0.2
    """

    def __init__(self, resolution: float, largest: float) -> None:
        self._resolution = resolution
        self._counts = np.zeros(int(np.ceil(largest / resolution)) + 1, dtype=np.int64)

    def add(self, value: float) -> None:
        self._counts[min(round(value / self._resolution), len(self._counts) - 1)] += 1

    def at(self, share: float) -> float:
        """The value that `share` of all do not exceed; 0 before there is any."""
        total = np.cumsum(self._counts)
        if total[-1] == 0:
            return 0.0
        return float(np.searchsorted(total, share * int(total[-1]))) * self._resolution
