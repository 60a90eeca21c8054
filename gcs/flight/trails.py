"""Where each vehicle has been, by its own account, for reports, pictures and the page."""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from gcs.fleet.fleet import Fleet
from missions.frames import LocalFrame

Array = npt.NDArray[np.float64]

MAX_SAMPLES = 200_000


@dataclass
class Trail:
    """One vehicle's way: times of its own clock [s], ENU positions [m] and velocities [m/s]."""

    times_s: list[float] = field(default_factory=list)
    _positions_m: list[Array] = field(default_factory=list)
    _velocities_m_s: list[Array] = field(default_factory=list)

    def append(self, time_s: float, position_m: Array, velocity_m_s: Array) -> None:
        if len(self.times_s) >= MAX_SAMPLES:
            return
        self.times_s.append(time_s)
        self._positions_m.append(position_m)
        self._velocities_m_s.append(velocity_m_s)

    @property
    def newest_m(self) -> Array:
        """(3,) ENU [m], of the last sample."""
        return self._positions_m[-1]

    def positions_m(self, first: int = 0) -> Array:
        """(n, 3) ENU [m], from sample `first` on."""
        return np.array(self._positions_m[first:]).reshape(-1, 3)

    def velocities_m_s(self) -> Array:
        """(n, 3) ENU [m/s]."""
        return np.array(self._velocities_m_s).reshape(-1, 3)


@dataclass
class Trails:
    """All vehicles' ways."""

    frame: LocalFrame
    by_sysid: dict[int, Trail] = field(default_factory=dict)

    def sample(self, fleet: Fleet, ground_offset_m: dict[int, float]) -> None:
        """Take down where every vehicle is, once per new position."""
        for sysid, state in fleet.vehicles.items():
            trail = self.by_sysid.setdefault(sysid, Trail())
            if trail.times_s and state.boot_time_s <= trail.times_s[-1]:
                continue
            position_m = state.position_m(self.frame, ground_offset_m.get(sysid, 0.0))
            if position_m is not None and np.isfinite(state.boot_time_s):
                trail.append(state.boot_time_s, position_m, state.velocity_enu_m_s)
