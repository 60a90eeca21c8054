"""What is watched over time: how far each vehicle has come, how well it is heard, and what an operator must know of."""

import math
from collections import deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gcs.desk.alerts import AlertBoard, alarms_of
from gcs.desk.histories import Histories
from gcs.dialect import AUTOPILOT
from gcs.flight.vehicle_flight import VehicleFlight
from gcs.link.codec import SourceCount
from missions import obstacles

if TYPE_CHECKING:
    from gcs.desk.desk import Desk

Array = npt.NDArray[np.float64]

INTERVAL_S = 0.5
NOT_HEARD = SourceCount()
NOWHERE = (math.nan, math.nan, math.nan)
QUALITY_WINDOW = 10
"""Observations over which losses are counted: the last five seconds."""


@dataclass(frozen=True)
class Outlook:
    """One vehicle as of the last observation; NaN where nobody knows.

    Args:
        position_m: (3,) ENU.
        speed_m_s: over all three axes.
        clearance_m: to the nearest thing that is on the map.
        link_quality: share of its messages that arrived, 0 to 1.
        progress: share of its planned curve that lies behind it.
        to_go_m: along the rest of that curve.
        eta_s: how long that takes as planned, in vehicle time.
    """

    position_m: Array
    speed_m_s: float
    clearance_m: float = math.nan
    link_quality: float = math.nan
    progress: float = math.nan
    to_go_m: float = math.nan
    eta_s: float = math.nan


@dataclass
class Observations:
    """Everything that is derived from the fleet's state twice a second.

    Args:
        histories: of each vehicle, for plots.
        alerts: what is wrong now.
        outlooks: by system id.
    """

    histories: Histories = field(default_factory=Histories)
    alerts: AlertBoard = field(default_factory=AlertBoard)
    outlooks: dict[int, Outlook] = field(default_factory=dict[int, Outlook])
    _counts: dict[int, deque[tuple[int, int]]] = field(default_factory=dict[int, deque[tuple[int, int]]])
    _next_s: float = -math.inf
    _solid: tuple[int, obstacles.Obstacles] | None = None

    def observe(self, desk: "Desk", now_s: float) -> None:
        """Look at everything, if it is time to."""
        if self._next_s - INTERVAL_S > now_s:
            self._begin_anew()
        if now_s < self._next_s:
            return
        self._next_s = now_s + INTERVAL_S
        self.outlooks = self._look(desk)
        self.histories.record(now_s, self.outlooks)
        self.alerts.update(alarms_of(desk, self.outlooks, now_s), now_s)
        for change in self.alerts.changes if desk.player is None else ():
            desk.events.add("alert", change.text, change.vehicle, change.severity)

    def _begin_anew(self) -> None:
        """A recording was moved back."""
        self._next_s = -math.inf
        self.histories.clear()
        self.alerts = AlertBoard()
        self._counts.clear()

    def _look(self, desk: "Desk") -> dict[int, Outlook]:
        sysids, places_m = _places_m(desk)
        if not sysids:
            return {}
        clear_m = self._clearances_m(desk, places_m).tolist()
        speeds_m_s = np.linalg.norm([desk.vehicles[sysid].velocity_enu_m_s for sysid in sysids], axis=1).tolist()
        return {
            sysid: self._outlook(desk, sysid, place_m, speed_m_s, free_m)
            for sysid, place_m, speed_m_s, free_m in zip(sysids, places_m, speeds_m_s, clear_m, strict=True)
        }

    def _clearances_m(self, desk: "Desk", places_m: Array) -> Array:
        mission = desk.mission
        if mission is None:
            return np.full(len(places_m), np.nan)
        if self._solid is None or self._solid[0] != id(mission):
            self._solid = (id(mission), obstacles.pack(mission.world.as_known()))
        clear_m = obstacles.clearance(places_m, self._solid[1])
        return np.where(clear_m >= obstacles.FAR_M, np.nan, clear_m)

    def _outlook(self, desk: "Desk", sysid: int, place_m: Array, speed_m_s: float, clearance_m: float) -> Outlook:
        part = desk.part(sysid)
        progress, to_go_m, eta_s = _along(part, place_m) if part is not None else NOWHERE
        return Outlook(
            position_m=place_m,
            speed_m_s=speed_m_s,
            clearance_m=clearance_m,
            link_quality=self._quality(sysid, desk.station.codec.sources.get((sysid, AUTOPILOT), NOT_HEARD)),
            progress=progress,
            to_go_m=to_go_m,
            eta_s=eta_s,
        )

    def _quality(self, sysid: int, count: SourceCount) -> float:
        seen = self._counts.setdefault(sysid, deque(maxlen=QUALITY_WINDOW + 1))
        if seen and count.received < seen[-1][0]:
            seen.clear()  # another vehicle has come in its place
        seen.append((count.received, count.lost))
        received, lost = seen[-1][0] - seen[0][0], max(seen[-1][1] - seen[0][1], 0)
        if len(seen) < 3:
            return math.nan
        return received / (received + lost) if received > 0 else 0.0


def _places_m(desk: "Desk") -> tuple[list[int], Array]:
    """Who is known to be somewhere, and (n, 3) where: all at once, since a hundred one by one take long."""
    seen = [(sysid, state.place) for sysid, state in desk.vehicles.items() if state.place is not None]
    if desk.trails is None or not seen:
        return [], np.zeros((0, 3))
    sysids = [sysid for sysid, _ in seen]
    geodetic = np.array([(p.latitude_deg, p.longitude_deg, p.altitude_amsl_m) for _, p in seen]).T
    parts = [desk.part(sysid) for sysid in sysids]
    offsets_m = np.array([part.monitor.ground_offset_m if part is not None else 0.0 for part in parts])
    return sysids, desk.trails.frame.enu(geodetic[0], geodetic[1], geodetic[2] - offsets_m)


def _along(part: VehicleFlight, place_m: Array) -> tuple[float, float, float]:
    """Share behind, metres and seconds ahead, at the nearest point of the planned curve."""
    plan = part.plan
    if plan is None or len(plan.curve_m) < 2:
        return NOWHERE
    nearest = int(np.argmin(np.sum((plan.curve_m - place_m) ** 2, axis=1)))
    share = nearest / (len(plan.curve_m) - 1)
    return share, plan.length_m * (1.0 - share), float(plan.times_s[-1] - plan.times_s[nearest])
