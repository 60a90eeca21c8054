"""What each vehicle's height, speed, clearance and link were over time: bounded, for plots; pure."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from gcs.desk.observations import Outlook

Array = npt.NDArray[np.float64]

MOST_SAMPLES = 1200
"""Ten minutes at two a second; when there are more, every other one of the old ones goes."""


class Quantity(Enum):
    """What is recorded: its title and unit."""

    HEIGHT = ("Height", "m")
    SPEED = ("Speed", "m/s")
    CLEARANCE = ("Clearance", "m")
    LINK = ("Link quality", "%")

    @property
    def title(self) -> str:
        return self.value[0]

    @property
    def unit(self) -> str:
        return self.value[1]


QUANTITIES = tuple(Quantity)


@dataclass
class Histories:
    """One row of all vehicles' quantities per observation."""

    times_s: list[float] = field(default_factory=list[float])
    _rows: list[dict[int, tuple[float, ...]]] = field(default_factory=list[dict[int, tuple[float, ...]]])

    def record(self, now_s: float, outlooks: Mapping[int, "Outlook"]) -> None:
        """Take down one observation."""
        self.times_s.append(now_s)
        self._rows.append({sysid: _quantities(outlook) for sysid, outlook in outlooks.items()})
        if len(self.times_s) > MOST_SAMPLES:
            half = MOST_SAMPLES // 2
            self.times_s[:half], self._rows[:half] = self.times_s[:half:2], self._rows[:half:2]

    def clear(self) -> None:
        """Begin anew: other vehicles fly."""
        self.times_s.clear()
        self._rows.clear()

    def series(self, quantity: Quantity, sysids: Sequence[int], most: int = 300) -> tuple[Array, ...]:
        """Times since the first observation [s], then one array per vehicle, all (n,); NaN where it was not seen.

        Args:
            quantity: which one.
            sysids: of these vehicles, in this order.
            most: samples, at most.
        """
        step = max(1, math.ceil(len(self.times_s) / most))
        rows, index = self._rows[::step], QUANTITIES.index(quantity)
        times_s = np.array(self.times_s[::step]) - (self.times_s[0] if self.times_s else 0.0)
        unseen = (math.nan,) * len(QUANTITIES)
        return (times_s, *(np.array([row.get(sysid, unseen)[index] for row in rows]) for sysid in sysids))


def _quantities(outlook: "Outlook") -> tuple[float, ...]:
    return float(outlook.position_m[2]), outlook.speed_m_s, outlook.clearance_m, 100.0 * outlook.link_quality
