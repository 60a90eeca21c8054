"""Where each vehicle has been, by its own account, for reports, pictures and the page."""

import math
from array import array
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from gcs.fleet.fleet import Fleet
from gcs.fleet.vehicle_state import VehicleState
from missions.frames import LocalFrame

Array = npt.NDArray[np.float64]

Numbers: TypeAlias = "array[float]"

MAX_SAMPLES = 200_000


def _numbers() -> Numbers:
    return array("d")


@dataclass
class Trail:
    """One vehicle's way: times of its own clock [s], ENU positions [m] and velocities [m/s]; 56 bytes a sample."""

    times_s: Numbers = field(default_factory=_numbers)
    _positions_m: Numbers = field(default_factory=_numbers)
    _velocities_m_s: Numbers = field(default_factory=_numbers)

    @classmethod
    def of(cls, times_s: Array, positions_m: Array, velocities_m_s: Array) -> "Trail":
        """A trail of (n,) times [s], (n, 3) positions [m] and (n, 3) velocities [m/s]."""
        return cls(*(array("d", table.astype(float).tobytes()) for table in (times_s, positions_m, velocities_m_s)))

    def append(self, time_s: float, position_m: Array, velocity_m_s: Array) -> None:
        """Add a sample, (3,) ENU [m] and [m/s]; of a flight that is too long, the end is left out."""
        if len(self.times_s) >= MAX_SAMPLES:
            return
        self.times_s.append(time_s)
        self._positions_m.extend(position_m.tolist())
        self._velocities_m_s.extend(velocity_m_s.tolist())

    @property
    def newest_m(self) -> Array:
        """(3,) ENU [m], of the last sample."""
        return np.array(self._positions_m[-3:])

    def positions_m(self, first: int = 0) -> Array:
        """(n, 3) ENU [m], from sample `first` on."""
        return np.array(self._positions_m[3 * first :]).reshape(-1, 3)

    def velocities_m_s(self) -> Array:
        """(n, 3) ENU [m/s]."""
        return np.array(self._velocities_m_s).reshape(-1, 3)


@dataclass
class Trails:
    """All vehicles' ways."""

    frame: LocalFrame
    by_sysid: dict[int, Trail] = field(default_factory=dict[int, Trail])

    def sample(self, fleet: Fleet, ground_offset_m: dict[int, float]) -> None:
        """Take down where every vehicle is, once per new position; all at once: one by one takes long."""
        due = [(sysid, state) for sysid, state in fleet.vehicles.items() if self._is_due(sysid, state)]
        if not due:
            return
        places = [state.place for _, state in due if state.place is not None]
        latitudes, longitudes = [place.latitude_deg for place in places], [place.longitude_deg for place in places]
        altitudes = [
            place.altitude_amsl_m - ground_offset_m.get(sysid, 0.0)
            for (sysid, _), place in zip(due, places, strict=True)
        ]
        positions_m = self.frame.enu(latitudes, longitudes, altitudes)
        for (sysid, state), position_m in zip(due, positions_m, strict=True):
            self.by_sysid[sysid].append(state.boot_time_s, position_m, state.velocity_enu_m_s)

    def _is_due(self, sysid: int, state: VehicleState) -> bool:
        """Whether a vehicle has a place that was not taken down yet."""
        trail = self.by_sysid.setdefault(sysid, Trail())
        newer = not trail.times_s or state.boot_time_s > trail.times_s[-1]
        return newer and state.place is not None and math.isfinite(state.boot_time_s)
