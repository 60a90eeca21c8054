"""What is done on the ground before a vehicle may be armed: hear it, check it, set it up, store fence and mission."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from gcs.dialect import AUTOPILOT, mavlink
from gcs.errors import CommandRefused, LinkLost, PreflightError
from gcs.fleet.vehicle_state import VehicleState
from gcs.flight import actions, preflight, safety_parameters, upload
from gcs.flight.fence import fence_items
from gcs.flight.monitor import Phase, describe
from gcs.flight.operation import Operation
from gcs.flight.vehicle_flight import VehicleFlight
from gcs.link.shaper import fitting_rates
from gcs.microservices.command_client import CommandClient
from gcs.microservices.mission_messages import FENCE
from gcs.planner.plan import VehiclePlan
from gcs.settings import PlanningMode
from missions.mission import Mission, OnArrival, Site, Vehicle
from missions.mission_items import Command as ItemCommand
from missions.mission_items import MissionItem, encode_track, plan_id
from missions.tunnel import CompanionState

Array = npt.NDArray[np.float64]

CONNECT_TIMEOUT_S = 240.0
"""Until an autopilot is heard, wall clock; on a fresh machine the simulator is first compiled."""
COMPANION_TIMEOUT_S = 480.0
"""Until its companion is, from then on: it compiles for longer, and a busy machine takes four times as long."""

SETTLING_S, READY_TIMEOUT_S = 3.0, 60.0
"""A vehicle that is not ready after the first of them is asked why, and given until the second."""
COMPANION_READY_TIMEOUT_S = 30.0

FRAME_BYTES = 12
"""Of a MAVLink 2 frame besides its payload."""
STREAM_RATES_HZ = {
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 10.0,
    mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: 10.0,
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 5.0,
    mavlink.MAVLINK_MSG_ID_MISSION_CURRENT: 5.0,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: 2.0,
}


class Preparation(Operation):
    """How the vehicles of one flight are prepared."""

    async def connect(self, vehicle: Vehicle) -> None:
        """Hear a vehicle, and its companion where one is needed, and order its telemetry.

        Raises:
            LinkLost: not heard.
        """
        fleet, sysid = self.station.fleet.vehicles, vehicle.sysid
        await self.station.wait_until(
            lambda: sysid in fleet and fleet[sysid].place is not None, CONNECT_TIMEOUT_S, f"vehicle {sysid} not heard"
        )
        self.events.add("connected", "autopilot heard", vehicle.name)
        if self.mode.needs_companions:
            what = f"no companion of vehicle {sysid} heard; start one, or fly with --mode cloud"
            await self.station.wait_until(
                lambda: fleet[sysid].companion_online(self.station.now_s), COMPANION_TIMEOUT_S, what
            )
            self.events.add("companion", "companion heard", vehicle.name)
        await self._request_streams(vehicle)

    async def prepare(self, flight: VehicleFlight, curves_m: Sequence[Array]) -> None:
        """Check a vehicle, set what is needed, and store its fence and mission.

        Args:
            flight: the vehicle's part.
            curves_m: the curves of the whole fleet's plan, each (n, 3) ENU.

        Raises:
            PreflightError: it is not fit for the flight.
            MissionTransferError: something else than what was sent is stored.
        """
        await self._ready_to_arm(flight)
        for change in await safety_parameters.ensure(self.station, flight.sysid, self.mission, self.speed):
            self.events.add("parameter", change, flight.name)
        state = self._state(flight)
        offset_m = preflight.ground_offset_m(state, flight.vehicle, self.mission)
        flight.monitor.ground_offset_m = offset_m
        fence = await self._store(flight, curves_m)
        text = f"{len(flight.items)} mission items and {fence} fence items stored and read back"
        self.events.add("uploaded", text, flight.name, plan_id=plan_id(flight.items), ground_offset_m=offset_m)
        if self.mode.needs_companions:
            await self._companion_ready(flight)
        flight.monitor.phase = Phase.PREPARED

    async def _store(self, flight: VehicleFlight, curves_m: Sequence[Array]) -> int:
        """Store the mission, and what belongs to it; how many items the fence has."""
        assert flight.plan is not None
        given, offset_m = flight.plan.given, flight.monitor.ground_offset_m
        if given is None:
            flight.take_items(mission_items(flight.plan, self.mission, self.mode, offset_m), self.mission)
            fence = fence_items(self.mission, curves_m)
        else:
            flight.items, fence = given.items, given.fence
            await upload.store(self.station, flight.sysid, given.rally, mavlink.MAV_MISSION_TYPE_RALLY)
        await upload.store(self.station, flight.sysid, fence, FENCE)
        await upload.store(self.station, flight.sysid, flight.items)
        return len(fence)

    def _state(self, flight: VehicleFlight) -> VehicleState:
        return self.station.vehicle(flight.sysid)

    async def _request_streams(self, vehicle: Vehicle) -> None:
        n_vehicles, budget_bytes_s = self.station.vehicles_on_link_of(vehicle.sysid)
        sizes = {number: mavlink.mavlink_map[number].unpacker.size + FRAME_BYTES for number in STREAM_RATES_HZ}
        for message_id, rate_hz in fitting_rates(STREAM_RATES_HZ, sizes, n_vehicles, budget_bytes_s).items():
            command = actions.set_message_interval(message_id, rate_hz)
            try:
                await self.station.run(CommandClient(command, (vehicle.sysid, AUTOPILOT)))
            except CommandRefused:  # a PX4 sends MISSION_CURRENT at its own rate alone
                name = mavlink.mavlink_map[message_id].msgname
                self.events.add("stream", f"the autopilot keeps its own rate of {name}", vehicle.name)

    async def _ready_to_arm(self, flight: VehicleFlight) -> None:
        def problems() -> list[str]:
            return list(preflight.problems(self._state(flight), flight.vehicle, self.mission, self.station.now_s))

        if await self.station.holds_within(lambda: not problems(), SETTLING_S):
            return
        if not self._state(flight).ready_to_arm:
            with suppress(CommandRefused, LinkLost):  # then it has said all that it will
                await self.station.run(CommandClient(actions.check_readiness(), (flight.sysid, AUTOPILOT)))
        if not await self.station.holds_within(lambda: not problems(), READY_TIMEOUT_S):
            raise PreflightError(f"{flight.name} (vehicle {flight.sysid}): {'; '.join(problems())}")

    async def _companion_ready(self, flight: VehicleFlight) -> None:
        expected = plan_id(flight.items)

        def ready() -> bool:
            status = self._state(flight).companion.status
            return status is not None and status.state is CompanionState.READY and status.plan_id == expected

        if not await self.station.holds_within(ready, COMPANION_READY_TIMEOUT_S):
            raise PreflightError(f"{flight.name}: {self._companion_complaint(flight, expected)}")
        status = self._state(flight).companion.status
        assert status is not None
        if status.mission_digest != self.mission.digest:
            raise PreflightError(f"{flight.name}: its companion has read another mission file, or another origin")

    def _companion_complaint(self, flight: VehicleFlight, expected: int) -> str:
        status = self._state(flight).companion.status
        if status is None:
            return "its companion sends no status"
        if status.plan_id != expected:
            return f"its companion has plan {status.plan_id:08x}, uploaded was {expected:08x}"
        return f"after {COMPANION_READY_TIMEOUT_S:g} s its companion is still {describe(status.state, status.reason)}"


def mission_items(
    plan: VehiclePlan, mission: Mission, mode: PlanningMode, ground_offset_m: float
) -> tuple[MissionItem, ...]:
    """What is stored on a vehicle of its plan: all track points, or the targets alone where the companion plans."""
    track, ending = plan.track, None
    if mode is PlanningMode.ONBOARD:
        track = plan.targets_alone
    if mode is PlanningMode.CLOUD:
        # all legs alike, or the fleet would not keep step
        track = replace(track, speeds_m_s=(1.0 - safety_parameters.OVERSHOOT_SHARE) * track.speeds_m_s)
        endings = {OnArrival.LAND: ItemCommand.NAV_LAND, OnArrival.RTL: ItemCommand.NAV_RETURN_TO_LAUNCH}
        ending = endings.get(mission.on_arrival)
    return encode_track(
        track,
        mission.frame,
        acceptance_radius_m=0.3 if mission.site is Site.INDOOR else 2.0,
        ground_offset_m=ground_offset_m,
        ending=ending,
    )
