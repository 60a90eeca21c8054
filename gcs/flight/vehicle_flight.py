"""One vehicle's part in a flight: who flies, what was planned and stored, and how far it has come."""

from dataclasses import dataclass

import numpy as np

from gcs.flight.monitor import VehicleMonitor
from gcs.planner.plan import VehiclePlan
from missions.mission import Mission, Vehicle
from missions.mission_items import MissionItem, decode_track


@dataclass
class VehicleFlight:
    """One vehicle's part in the flight."""

    vehicle: Vehicle
    monitor: VehicleMonitor
    plan: VehiclePlan | None = None
    items: tuple[MissionItem, ...] = ()

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
        self.plan, self.monitor.target, route.stops = plan, plan.target, behind + plan.targets[:-1]

    def take_items(self, items: tuple[MissionItem, ...], mission: Mission) -> None:
        """These mission items are what is stored on the vehicle: its stops are found among them."""
        assert self.plan is not None
        self.items = items
        track = decode_track(items, mission.frame, ground_offset_m=self.monitor.ground_offset_m)
        nearest = [int(np.argmin(np.linalg.norm(track.points_m - stop_m, axis=1))) for stop_m in self.plan.stops_m]
        behind = len(self.monitor.route.stops) - len(nearest)
        self.monitor.route.stop_items = (-1,) * behind + tuple(track.item_seq[index] for index in nearest)
