"""One vehicle's part in a flight: who flies, what was planned and stored, and how far it has come."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gcs.flight.monitor import VehicleMonitor
from gcs.planner.curves import lengths
from gcs.planner.plan import VehiclePlan
from missions.mission import Mission, Vehicle
from missions.mission_items import MissionItem, decode_track

Array = npt.NDArray[np.float64]


@dataclass
class VehicleFlight:
    """One vehicle's part in the flight."""

    vehicle: Vehicle
    monitor: VehicleMonitor
    plan: VehiclePlan | None = None
    items: tuple[MissionItem, ...] = ()
    passed_samples: int = 0
    """Of the plan's curve."""

    @property
    def name(self) -> str:
        return self.vehicle.name

    @property
    def sysid(self) -> int:
        return self.vehicle.sysid

    def change_plan(self, plan: VehiclePlan) -> None:
        """Fly another plan from here on; the targets that the vehicle has come to already stay behind it."""
        route = self.monitor.route
        behind = tuple(stop for stop in route.stops if stop.name in route.passed)
        self.passed_samples = 0
        self.plan, self.monitor.target, route.stops = plan, plan.target, behind + plan.targets[:-1]

    def progress(self, position_m: Array, reach_m: float) -> int:
        """Index of the sample of the plan's curve beside which the vehicle is; it does not go back.

        Args:
            position_m: (3,) of the vehicle, ENU [m].
            reach_m: it is looked for so far ahead [m].
        """
        assert self.plan is not None
        curve_m = self.plan.curve_m[self.passed_samples :]
        step_m = max(self.plan.length_m / (len(self.plan.curve_m) - 1), 1e-6)
        ahead_m = curve_m[: 2 + round(reach_m / step_m)]
        self.passed_samples += int(np.argmin(lengths(ahead_m - position_m)))
        return self.passed_samples

    def take_items(self, items: tuple[MissionItem, ...], mission: Mission) -> None:
        """These mission items are what is stored on the vehicle: its stops are found among them."""
        assert self.plan is not None
        self.items = items
        track = decode_track(items, mission.frame, ground_offset_m=self.monitor.ground_offset_m)
        nearest = [int(np.argmin(np.linalg.norm(track.points_m - stop_m, axis=1))) for stop_m in self.plan.stops_m]
        behind = len(self.monitor.route.stops) - len(nearest)
        self.monitor.route.stop_items = (-1,) * behind + tuple(track.item_seq[index] for index in nearest)
