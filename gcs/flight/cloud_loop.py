"""The cloud's half of the loop in flight: looks at what was seen, plans anew, and swaps missions without a pause.

The decisions are `gcs.replanning`'s; here they meet the planner and the links. A swap is an upload, and the companion's
word that it flies the new plan; until that comes, the upload is read back. The companion names the current item.
"""

import asyncio
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from gcs.errors import GcsError, LinkLost
from gcs.flight import upload
from gcs.flight.events import Severity
from gcs.flight.monitor import Phase
from gcs.flight.preparation import mission_items
from gcs.flight.vehicle_flight import VehicleFlight
from gcs.planner.curves import lengths
from gcs.planner.flown_plan import FlownPlan
from gcs.planner.plan import FleetPlan, VehiclePlan
from gcs.replanning.remaining import Aloft, remaining_mission
from gcs.replanning.replanner import Cause, Replanner
from gcs.security.audit import Origin, acting_as
from gcs.settings import PlanningMode
from missions.errors import MissionError
from missions.mission import Mission
from missions.mission_items import MissionItem, plan_id
from missions.tunnel import CompanionState, Reason
from missions.world import Box

if TYPE_CHECKING:
    from gcs.flight.sequence import FleetFlight

LOOK_INTERVAL_S = 0.05
"""In vehicle time, as all that follows."""
SWAP_TIMEOUT_S = 5.0
"""A companion that has the new mission for so long and does not fly it is said so."""
HAND_OVER_TIMEOUT_S = 15.0
"""A mission that could not be stored within this time was made for places that the vehicles have long left."""
ARRIVING_M = 1.5
"""Who is so near to its last target, or within its arrival tolerance where that is more, is not sent elsewhere."""
SAME_WAY_SHARE = 0.25
"""A vehicle whose new curve stays within this share of the clearance of its old one keeps what it has."""


@dataclass(frozen=True)
class NewPlan:
    """One vehicle's part of a new plan, as it is sent.

    Args:
        part: of the plan.
        items: the mission that it becomes.
    """

    part: VehiclePlan
    items: tuple[MissionItem, ...]


@dataclass
class CloudLoop:
    """Replans one flight while it flies.

    Args:
        flight: whose plan it keeps good.
    """

    flight: "FleetFlight"
    replans: int = 0
    """Plans that were made in flight and flown."""
    swaps_s: list[float] = field(default_factory=list[float])
    """From the moment a cause was noticed to the companion's word that it flies the new plan; vehicle time."""

    def __post_init__(self) -> None:
        observed = self.flight.station.fleet.observed
        observed.bounds = self.flight.mission.world.bounds
        self.replanner = Replanner(self.flight.mission, observed)
        self._unconfirmed: dict[int, dict[int, NewPlan]] = {}

    def edit(self, mission: Mission) -> None:
        """Fly a changed mission: other obstacles, targets, or fewer vehicles."""
        self.flight.mission = mission
        self.replanner.edit(mission)

    async def run(self) -> None:
        """Look, and plan anew when there is a cause; until it is cancelled. Where one side plans alone, do nothing."""
        if self.flight.mode is not PlanningMode.END_CLOUD:
            return
        self.replanner.mission = self.flight.mission  # its origin may have moved since
        self._unconfirmed.clear()
        for vehicle in self.flight.vehicles.values():
            vehicle.passed_samples = 0  # it may have flown this plan before
        while True:
            self._reconcile()
            aloft = list(self._aloft())
            cause = self.replanner.look(aloft, self._now_s)
            if cause is not None and self._can_be_told(aloft):
                with acting_as(Origin.REPLANNER):
                    await self._replan(cause, aloft)
            await asyncio.sleep(LOOK_INTERVAL_S / self.flight.speed)

    @property
    def _now_s(self) -> float:
        return self.flight.station.now_s * self.flight.speed

    async def _replan(self, cause: Cause, aloft: Sequence[Aloft]) -> None:
        flight, began_s, observed = self.flight, self._now_s, self.replanner.observed
        basis = self.replanner.basis
        flight.events.add("replan", f"planning anew: {cause.value}", cause=cause.name.lower())
        rest = remaining_mission(flight.mission, aloft, (*observed.boxes(), *self._parked(aloft)))
        try:
            plan = await flight.planner(rest, FlownPlan({vehicle.sysid: vehicle.curve_m for vehicle in aloft}))
        except MissionError as problem:
            flight.events.add("replan", f"no plan: {problem}", severity=Severity.WARNING)
            self.replanner.put_off(self._now_s)
            return
        kept = self.replanner.judge(cause, plan, aloft, basis, self._now_s)
        if kept:
            flight.events.add("replan", f"the plan stays: {kept}", cause=cause.name.lower())
            return
        self.replans += 1
        text = f"new plan after {self._now_s - began_s:.2f} s for {len(plan.vehicles)} vehicles"
        flight.events.add("replanned", text, objective=plan.objective, cause=cause.name.lower())
        await self._hand_out(plan, aloft, began_s)

    async def _hand_out(self, plan: FleetPlan, aloft: Sequence[Aloft], began_s: float) -> None:
        """Swap the missions of all vehicles whose way changes, all at once."""
        left = {vehicle.sysid: vehicle for vehicle in aloft}
        changed = [part for part in plan.vehicles if self._goes_elsewhere(part, left[part.sysid])]
        outcomes = await asyncio.gather(*(self._swap(part, began_s) for part in changed))
        if not all(outcomes):
            self.replanner.forget_plan()

    def _goes_elsewhere(self, part: VehiclePlan, left: Aloft) -> bool:
        limit_m = SAME_WAY_SHARE * self.flight.mission.limits.clearance_m
        return (
            part.targets != left.targets
            or max(float(lengths(left.curve_m - point_m).min()) for point_m in part.curve_m[::4]) > limit_m
        )

    async def _swap(self, part: VehiclePlan, began_s: float) -> bool:
        """Give one vehicle its new mission; False where it may still fly the old one."""
        flight, vehicle = self.flight, self.flight.vehicles[part.sysid]
        items = mission_items(part, flight.mission, flight.mode, vehicle.monitor.ground_offset_m)
        new = NewPlan(part, items)
        try:
            await self._hand_over(vehicle, items)
        except GcsError as problem:
            flight.events.add("swap failed", str(problem), vehicle.name, Severity.WARNING)
            self._unconfirmed.setdefault(part.sysid, {})[plan_id(items)] = new
            return False
        self._take(vehicle, new)
        self._unconfirmed.pop(part.sysid, None)
        took_s = self._now_s - began_s
        self.swaps_s.append(took_s)
        flight.events.add("swapped", f"flies the new plan after {took_s:.2f} s", vehicle.name, plan_id=plan_id(items))
        return True

    def _take(self, vehicle: VehicleFlight, new: NewPlan) -> None:
        """This is what a vehicle flies from now on."""
        flight = self.flight
        vehicle.change_plan(new.part)
        vehicle.take_items(new.items, flight.mission)
        assert flight.plan is not None
        parts = tuple(new.part if old.sysid == vehicle.sysid else old for old in flight.plan.vehicles)
        flight.plan = replace(flight.plan, vehicles=parts)

    def _reconcile(self) -> None:
        """Companions that fly a plan whose arrival they could not confirm in time: it is theirs, and not sent again.

        What was sent after that plan may be flown yet; what was sent before it is over.
        """
        for sysid, plans in self._unconfirmed.items():
            status = self.flight.state(sysid).companion.status
            if status is not None and status.plan_id in plans:
                vehicle, sent = self.flight.vehicles[sysid], list(plans)
                self._take(vehicle, plans[status.plan_id])
                for over in sent[: sent.index(status.plan_id) + 1]:
                    del plans[over]
                text = "flies a plan that it could not confirm in time"
                self.flight.events.add("reconciled", text, vehicle.name, plan_id=status.plan_id)

    def _can_be_told(self, aloft: Sequence[Aloft]) -> bool:
        """Everybody is heard: the cloud plans for all together, so it waits while one of them is out of reach."""
        now_s = self.flight.station.now_s
        return all(self.flight.state(vehicle.sysid).companion_online(now_s) for vehicle in aloft)

    async def _hand_over(self, vehicle: VehicleFlight, items: tuple[MissionItem, ...]) -> None:
        """Store a mission on a vehicle; over when its companion flies it.

        The companion names a plan by what it has read itself: its word is worth as much as reading the mission back,
        and on a slow link it is there a good while earlier.
        """
        storing = asyncio.ensure_future(upload.swap(self.flight.station, vehicle.sysid, items))
        flying = asyncio.ensure_future(self._flies(vehicle, plan_id(items)))
        try:
            longest_s = HAND_OVER_TIMEOUT_S / self.flight.speed
            await asyncio.wait((storing, flying), timeout=longest_s, return_when=asyncio.FIRST_COMPLETED)
            if not (storing.done() or flying.done()):
                raise LinkLost(f"vehicle {vehicle.sysid} has not got the new plan in time")
            if not flying.done():
                storing.result()
                await asyncio.wait((flying,), timeout=SWAP_TIMEOUT_S / self.flight.speed)
            if not flying.done():
                raise LinkLost(f"vehicle {vehicle.sysid} does not say that it flies the new plan")
        finally:
            storing.cancel()
            flying.cancel()
            await asyncio.gather(storing, flying, return_exceptions=True)

    async def _flies(self, vehicle: VehicleFlight, expected: int) -> None:
        """Return when the companion says that it flies a plan."""
        companion = self.flight.state(vehicle.sysid).companion

        def flies_it() -> bool:
            return companion.status is not None and companion.status.plan_id == expected

        await self.flight.station.holds_within(flies_it, float("inf"))

    # ------------------------------------------------------------------ where the vehicles are

    def _aloft(self) -> Iterator[Aloft]:
        """The vehicles that can be sent another way."""
        for vehicle in self.flight.vehicles.values():
            position_m = self._position_m(vehicle)
            if position_m is None or vehicle.plan is None or not self._is_under_way(vehicle):
                continue
            plan, reach_m = vehicle.plan, 2.0 * self.flight.mission.onboard.horizon_m
            done = vehicle.progress(position_m, reach_m)
            targets = tuple(target for target in plan.targets if target.name not in vehicle.monitor.route.passed)
            curve_m = plan.curve_m[done:]
            if len(curve_m) > 1 and lengths(plan.curve_m[-1] - position_m) > self._arriving_m:
                remaining_s = float(plan.times_s[-1] - plan.times_s[done])
                yield Aloft(vehicle.sysid, position_m, targets, curve_m, remaining_s)

    @property
    def _arriving_m(self) -> float:
        return max(ARRIVING_M, self.flight.mission.site.arrival_tolerance_m)

    def _is_under_way(self, vehicle: VehicleFlight) -> bool:
        status = self.flight.state(vehicle.sysid).companion.status
        if vehicle.monitor.phase is not Phase.FLYING or status is None:
            return False
        return status.state is CompanionState.FLYING or (status.state, status.reason) == (
            CompanionState.HOLDING,
            Reason.NO_PATH,
        )

    def _parked(self, aloft: Sequence[Aloft]) -> Iterator[Box]:
        """Vehicles that are planned for no more, as obstacles that keep the others at the required separation."""
        limits, moving = self.flight.mission.limits, {vehicle.sysid for vehicle in aloft}
        half_m = max(limits.separation_m - limits.clearance_m, limits.body_radius_m)
        for vehicle in self.flight.vehicles.values():
            position_m = self._position_m(vehicle)
            if vehicle.sysid not in moving and position_m is not None:
                east_m, north_m, up_m = position_m.tolist()
                yield Box(name=vehicle.name, centre_m=(east_m, north_m, up_m), half_m=(half_m, half_m, half_m))

    def _position_m(self, vehicle: VehicleFlight) -> np.ndarray | None:
        offset_m = vehicle.monitor.ground_offset_m
        return self.flight.state(vehicle.sysid).position_m(self.flight.mission.frame, offset_m)
