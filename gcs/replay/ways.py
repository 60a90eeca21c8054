"""Where all vehicles were in a recording, read out of it at once, so that a trail is there after any jump."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from gcs.dialect import AUTOPILOT, mavlink
from gcs.replay.recording import Recording
from missions.frames import GeodeticPoint, LocalFrame

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

MOST_SAMPLES = 20_000
"""Per vehicle; of longer flights every k-th is kept."""

GLOBAL_POSITION = np.dtype(
    [
        ("time_boot_ms", "<u4"),
        ("place", "<i4", 3),  # latitude, longitude [1e-7 deg], altitude AMSL [mm]
        ("height_mm", "<i4"),
        ("velocity", "<i2", 3),  # north, east, down [cm/s]
        ("heading", "<u2"),
    ]
)


@dataclass(frozen=True)
class Way:
    """One vehicle's positions.

    Args:
        records: (n,) of the recording.
        times_s: (n,) of the vehicle's clock.
        geodetic: (n, 3) latitude, longitude [deg], altitude AMSL [m].
        velocities_m_s: (n, 3) ENU.
    """

    records: IntArray
    times_s: Array
    geodetic: Array
    velocities_m_s: Array

    def positions_m(self, frame: LocalFrame, ground_offset_m: float = 0.0) -> Array:
        """(n, 3) ENU [m]."""
        return frame.enu(self.geodetic[:, 0], self.geodetic[:, 1], self.geodetic[:, 2] - ground_offset_m)


@dataclass(frozen=True)
class Ways:
    """The ways of all vehicles in a recording."""

    recording: Recording

    @cached_property
    def by_sysid(self) -> dict[int, Way]:
        number = mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
        return {
            kind[0]: way
            for kind, records in self.recording.kinds.items()
            if kind[1:3] == (AUTOPILOT, number) and len((way := self._way(records)).records)
        }

    def first_place(self) -> GeodeticPoint | None:
        """Where the vehicle that is first heard of begins; None where nobody says where it is."""
        ways = self.by_sysid.values()
        if not ways:
            return None
        latitude, longitude, altitude = min(ways, key=lambda way: int(way.records[0])).geodetic[0].tolist()
        return GeodeticPoint(latitude_deg=latitude, longitude_deg=longitude, altitude_amsl_m=altitude)

    def _way(self, records: IntArray) -> Way:
        records = records[:: 1 + len(records) // MOST_SAMPLES]
        told = self.recording.payloads(records, GLOBAL_POSITION.itemsize).view(GLOBAL_POSITION).ravel()
        place = told["place"].astype(np.float64) * np.array([1e-7, 1e-7, 1e-3])
        known = (told["place"][:, :2] != 0).any(axis=1) & (np.abs(place[:, 0]) <= 85.0) & (np.abs(place[:, 1]) <= 180.0)
        velocity = told["velocity"][:, [1, 0, 2]].astype(np.float64) * np.array([0.01, 0.01, -0.01])
        return Way(records[known], told["time_boot_ms"][known] / 1e3, place[known], velocity[known])
