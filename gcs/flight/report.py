"""The report of a flight: `report.json`, from what the vehicles said and, in simulation, from the simulator's truth."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import msgspec
import numpy as np
import numpy.typing as npt

from gcs.flight.sequence import FleetFlight
from gcs.flight.trails import Trail
from gcs.flight.vehicle_flight import VehicleFlight
from missions import obstacles
from missions.mission import Mission
from missions.time_law import arc_length
from missions.tunnel import CompanionState, CompanionStatus

Array = npt.NDArray[np.float64]

TRUTH_HEADER = "t_s,sysid,east_m,north_m,up_m,ve_m_s,vn_m_s,vu_m_s"
SPEED_OF_A_FLIGHT_M_S = 0.2
"""A vehicle is in flight from the first to the last moment at which it moves faster than this."""

SEPARATION_GRID_S = 0.02


class LinkReport(msgspec.Struct, frozen=True, kw_only=True):
    """Messages between the ground station and one vehicle."""

    sent: int
    received: int
    lost: int


class VehicleReport(msgspec.Struct, frozen=True, kw_only=True):
    """How one vehicle's flight went."""

    name: str
    sysid: int
    reached: bool
    landed: bool
    collided: bool
    reason: str
    target_error_m: float
    min_clearance_m: float
    path_length_m: float
    flight_time_s: float
    max_speed_m_s: float
    tracking_error_m_p99: float
    onboard_replans: int
    replan_ms_p50: float
    replan_ms_p99: float
    offboard_losses: int
    link: LinkReport


class FlightReport(msgspec.Struct, frozen=True, kw_only=True):
    """How a flight went; docs/reports.md says what each field means."""

    mission: str
    mode: str
    success: bool
    reason: str
    wall_s: float
    sim_s: float
    speed: float
    min_separation_m: float | None
    cloud_replans: int
    swap_s_p50: float | None
    vehicles: tuple[VehicleReport, ...]


@dataclass(frozen=True)
class Flown:
    """Where a vehicle was, sample by sample: the simulator's truth, or what the vehicle said of itself."""

    times_s: Array
    """(n,) vehicle or simulated time."""
    positions_m: Array
    """(n, 3) ENU [m]."""
    velocities_m_s: Array
    """(n, 3) ENU [m/s]."""

    def in_flight(self) -> "Flown":
        """From the first to the last movement."""
        moving = np.flatnonzero(np.linalg.norm(self.velocities_m_s, axis=1) > SPEED_OF_A_FLIGHT_M_S)
        if len(moving) == 0:
            return Flown(self.times_s[:0], self.positions_m[:0], self.velocities_m_s[:0])
        window = slice(moving[0], moving[-1] + 1)
        return Flown(self.times_s[window], self.positions_m[window], self.velocities_m_s[window])


def read_truth(path: Path) -> dict[int, Flown]:
    """The simulator's truth log by system id; a torn last line is left out.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is not a truth log.
    """
    lines = path.read_text().splitlines()
    if not lines or lines[0] != TRUTH_HEADER:
        raise ValueError(f"{path}: expected a truth log with the header {TRUTH_HEADER}")
    rows = [line for line in lines[1:] if line.count(",") == TRUTH_HEADER.count(",")]
    table = np.loadtxt(rows, delimiter=",", ndmin=2) if rows else np.empty((0, 8))
    return {
        int(sysid): Flown(part[:, 0], part[:, 2:5], part[:, 5:8])
        for sysid in np.unique(table[:, 1])
        for part in [table[table[:, 1] == sysid]]
    }


def flown_from_trail(trail: Trail) -> Flown:
    """What a vehicle said of itself, as a flight without simulator has it."""
    return Flown(np.array(trail.times_s), trail.positions_m(), trail.velocities_m_s())


def make_report(
    flight: FleetFlight, flown: dict[int, Flown], *, reason: str, wall_s: float, sim_s: float
) -> FlightReport:
    """Judge a flight that has ended."""
    vehicles = tuple(_vehicle_report(flight, part, flown.get(part.sysid)) for part in flight.vehicles.values())
    success = flight.success and not any(vehicle.collided for vehicle in vehicles) and not reason
    return FlightReport(
        mission=flight.mission.name,
        mode=flight.mode.value,
        success=success,
        reason=reason or _summary(vehicles),
        wall_s=round(wall_s, 2),
        sim_s=round(sim_s, 2),
        speed=flight.speed,
        min_separation_m=_rounded(min_separation_m(list(flown.values()))),
        cloud_replans=flight.cloud.replans,
        swap_s_p50=_rounded(median(flight.cloud.swaps_s)) if flight.cloud.swaps_s else None,
        vehicles=vehicles,
    )


def min_separation_m(flown: Sequence[Flown]) -> float | None:
    """The least distance between two vehicles' centres at equal times, while both have been seen; None for one."""
    least_m = np.inf
    for index, one in enumerate(flown):
        for other in flown[:index]:
            if len(one.times_s) == 0 or len(other.times_s) == 0:
                continue
            begin_s = max(one.times_s[0], other.times_s[0])
            end_s = min(one.times_s[-1], other.times_s[-1])
            times_s = np.arange(begin_s, end_s, SEPARATION_GRID_S)
            if len(times_s):
                apart_m = np.linalg.norm(_positions_at(one, times_s) - _positions_at(other, times_s), axis=1)
                least_m = min(least_m, float(apart_m.min()))
    return least_m if np.isfinite(least_m) else None


def _vehicle_report(flight: FleetFlight, part: VehicleFlight, flown: Flown | None) -> VehicleReport:
    state = flight.station.fleet.vehicles.get(part.sysid)  # none if it was not heard after a restart
    told = state.companion.status if state is not None else None
    status = told or CompanionStatus(state=CompanionState.CONNECTING)
    quality = flight.station.quality(part.sysid)
    received, lost = (quality.received, quality.lost) if quality is not None else (0, 0)
    moved = flown.in_flight() if flown else Flown(np.empty(0), np.empty((0, 3)), np.empty((0, 3)))
    clearance_m = min_clearance_m(flight.mission, moved)
    landed = state is not None and not state.armed
    return VehicleReport(
        name=part.name,
        sysid=part.sysid,
        reached=part.monitor.reached,
        landed=landed,
        collided=clearance_m < flight.mission.limits.body_radius_m,
        reason=part.monitor.reason,
        target_error_m=round(_target_error_m(part, moved, horizontal=landed), 3),
        min_clearance_m=round(clearance_m, 3),
        path_length_m=round(float(arc_length(moved.positions_m)[-1]), 2) if len(moved.times_s) else 0.0,
        flight_time_s=round(float(np.ptp(moved.times_s)), 2) if len(moved.times_s) else 0.0,
        max_speed_m_s=round(float(np.linalg.norm(moved.velocities_m_s, axis=1).max(initial=0.0)), 3),
        tracking_error_m_p99=status.tracking_error_p99_m,
        onboard_replans=status.replans,
        replan_ms_p50=status.replan_p50_ms,
        replan_ms_p99=status.replan_p99_ms,
        offboard_losses=part.monitor.offboard_losses,
        link=LinkReport(sent=flight.station.sent[part.sysid], received=received, lost=lost),
    )


def min_clearance_m(mission: Mission, moved: Flown) -> float:
    """The least distance [m] to anything real, unmapped obstacles included; movers are not in it."""
    if len(moved.times_s) == 0:
        return obstacles.FAR_M
    return float(obstacles.clearance(moved.positions_m, obstacles.pack(mission.world)).min())


def _target_error_m(part: VehicleFlight, moved: Flown, *, horizontal: bool) -> float:
    if len(moved.times_s) == 0:
        return float("inf")
    axes = 2 if horizontal else 3
    return float(np.linalg.norm((moved.positions_m[-1] - np.array(part.monitor.target.position_m))[:axes]))


def _positions_at(flown: Flown, times_s: Array) -> Array:
    return np.stack([np.interp(times_s, flown.times_s, flown.positions_m[:, axis]) for axis in range(3)], axis=-1)


def _summary(vehicles: tuple[VehicleReport, ...]) -> str:
    collided = [f"{vehicle.name}: collided" for vehicle in vehicles if vehicle.collided]
    return "; ".join(collided + [f"{vehicle.name}: {vehicle.reason}" for vehicle in vehicles])


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 3)
