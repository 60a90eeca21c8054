"""What must be right before a vehicle is armed; pure functions over its state."""

from collections.abc import Iterator

import numpy as np

from gcs.dialect import mavlink
from gcs.fleet.vehicle_state import VehicleState
from missions.frames import GeodeticPoint
from missions.mission import Mission, Vehicle

FRESH_S = 2.0


def problems(state: VehicleState, vehicle: Vehicle, mission: Mission, now_s: float) -> Iterator[str]:
    """Yield a sentence for everything that keeps this vehicle from being armed."""
    if not state.online(now_s):
        yield "no heartbeat"
        return
    if state.place is None or now_s - state.place_s > FRESH_S:
        yield "no position"
    else:
        yield from _misplaced(state, vehicle, mission)
    if state.armed:
        yield "already armed"
    if not state.ready_to_arm:
        said = "; ".join(autopilots_reasons(state))
        yield "not ready to arm" + (f"; it said: {said}" if said else "")


def autopilots_reasons(state: VehicleState) -> list[str]:
    """The last warnings of an autopilot that is not ready to arm, in its own words."""
    return [text.text for text in state.texts if text.severity <= mavlink.MAV_SEVERITY_WARNING][-3:]


def ground_offset_m(state: VehicleState, vehicle: Vehicle, mission: Mission) -> float:
    """What the vehicle's altitude reads too high [m] on its pad: from its home altitude, or its present one."""
    reference = state.home or state.place
    assert reference is not None  # checked before: a vehicle without position does not get here
    return reference.altitude_amsl_m - mission.origin.altitude_amsl_m - vehicle.pad_m[2]


def origin_here(place: GeodeticPoint, vehicle: Vehicle, mission: Mission) -> GeodeticPoint:
    """The mission origin with which a vehicle that stands at `place` stands on its pad."""
    east_m, north_m, up_m = vehicle.pad_m
    moved = mission.moved_to(place).frame.geodetic(np.array([-east_m, -north_m, 0.0]))
    return GeodeticPoint(
        latitude_deg=moved.latitude_deg,
        longitude_deg=moved.longitude_deg,
        altitude_amsl_m=place.altitude_amsl_m - up_m,
    )


def _misplaced(state: VehicleState, vehicle: Vehicle, mission: Mission) -> Iterator[str]:
    position_m = state.position_m(mission.frame)
    assert position_m is not None
    off_m = float(np.linalg.norm(position_m[:2] - np.array(vehicle.pad_m[:2])))
    if off_m > mission.site.start_tolerance_m:
        expected = f"expected at most {mission.site.start_tolerance_m:g} m"
        yield f"stands {off_m:.1f} m from its pad {list(vehicle.pad_m)}, {expected} (--origin here moves the mission)"
