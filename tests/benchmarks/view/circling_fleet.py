"""A fleet without a mission that flies circles: it never stands still, and its trails never end.

The vehicles say once over MAVLink who they are. After that their states are set directly: what is measured is the page.
"""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from gcs.desk import Desk
from gcs.dialect import Mode
from missions.frames import GeodeticPoint, LocalFrame
from missions.trajectory import Trajectory
from missions.tunnel import CompanionState, CompanionStatus
from tests.browser.scripted_desk import ScriptedDesk

Array = npt.NDArray[np.float64]

SPACING_M, RADIUS_M, SPEED_M_S = 12.0, 4.0, 3.0
DRIFT_M_S = 0.15
"""The circles move on, so that trails do not cover themselves."""
KNOT_S, KNOTS = 0.3, 11
REPLANS_HZ = 5.0


@dataclass
class CirclingFleet:
    """So many vehicles, with companions that report what they fly.

    Args:
        count: how many.
    """

    count: int
    clock_s: float = 10.0
    desk: Desk = field(init=False)

    def __post_init__(self) -> None:
        scripted = ScriptedDesk(None, watched=self.count)
        for vehicle in scripted.vehicles:
            vehicle.mode, vehicle.armed = Mode.OFFBOARD, True
        scripted.say()
        self.desk, self._revision = scripted.desk, -1
        index = np.arange(self.count)
        self._centres_m = np.stack((SPACING_M * (index % 10), SPACING_M * (index // 10), np.full(self.count, 5.0)), 1)

    def places_m(self, time_s: float) -> Array:
        """(count, 3) where all vehicles are at a time."""
        angle = time_s * SPEED_M_S / RADIUS_M
        turn_m = RADIUS_M * np.array([np.cos(angle), np.sin(angle), 0.2 * np.sin(3 * angle)])
        return self._centres_m + turn_m + np.array([DRIFT_M_S * time_s, 0.0, 0.0])

    def fly_on(self, seconds: float) -> None:
        """Let time pass, and every vehicle say where it is."""
        self.clock_s += seconds
        assert self.desk.trails is not None
        frame: LocalFrame = self.desk.trails.frame
        latitudes, longitudes, altitudes = frame.geodetic_arrays(self.places_m(self.clock_s))
        now_s = self.desk.station.now_s
        for state, *place in zip(self.desk.vehicles.values(), latitudes, longitudes, altitudes, strict=True):
            state.place = GeodeticPoint(latitude_deg=place[0], longitude_deg=place[1], altitude_amsl_m=place[2])
            state.boot_time_s, state.heard_s, state.telemetry_s, state.companion.heard_s = self.clock_s, *(now_s,) * 3
        self._replan()

    def _replan(self) -> None:
        revision = int(self.clock_s * REPLANS_HZ)
        if revision == self._revision:
            return
        self._revision = revision
        ahead_m = np.stack([self.places_m(self.clock_s + KNOT_S * knot) for knot in range(-1, KNOTS - 1)])
        status = CompanionStatus(state=CompanionState.FLYING, replans=revision, replan_p50_ms=1.4, replan_p99_ms=3.9)
        for index, state in enumerate(self.desk.vehicles.values()):
            state.companion.status = status
            state.companion.trajectory = Trajectory(ahead_m[:, index], self.clock_s, KNOT_S)
            state.companion.trajectory_revision = revision

    def sample(self) -> None:
        assert self.desk.trails is not None
        self.desk.trails.sample(self.desk.station.fleet, {})

    def have_flown(self, seconds: float, interval_s: float) -> None:
        """Let a time pass of which only the trails are left."""
        assert self.desk.trails is not None
        self.fly_on(interval_s)
        self.sample()
        trails = list(self.desk.trails.by_sysid.values())
        for _ in range(round(seconds / interval_s)):
            self.clock_s += interval_s
            for trail, place_m in zip(trails, self.places_m(self.clock_s), strict=True):
                trail.append(self.clock_s, place_m, np.zeros(3))
