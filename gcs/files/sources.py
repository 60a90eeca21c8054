"""Documents from what is no plan file: a mission's flight range, a cloud plan, a recorded flight."""

from pathlib import Path

import numpy as np

from gcs.files.document import Circle, ItemCommand, Place, PlanDocument, Polygon, Way
from gcs.flight.fence import fence_items
from gcs.planner.plan import FleetPlan, VehiclePlan
from gcs.replay.recording import read_recording
from gcs.replay.ways import Ways
from missions.frames import GeodeticPoint
from missions.mission import Mission, OnArrival, Site
from missions.mission_items import DEG_E7, Command, MissionItem, encode_track

MOST_TRACK_POINTS = 5000


def mission_area(mission: Mission, plan: FleetPlan | None = None) -> PlanDocument:
    """The fence of a mission: its flight range, and the threats that no curve of the plan passes over."""
    curves_m = [part.curve_m for part in plan.vehicles] if plan is not None else []
    corners: list[Place] = []
    circles: list[Circle] = []
    for item in fence_items(mission, curves_m):
        place = Place(item.x / DEG_E7, item.y / DEG_E7)
        if item.command == ItemCommand.FENCE_CIRCLE_EXCLUSION:
            circles.append(Circle(centre=place, radius_m=item.param1, inclusion=False))
        else:
            corners.append(place)
    return PlanDocument(
        home=mission.origin,
        polygons=(Polygon(corners=tuple(corners), name=mission.name),),
        circles=tuple(circles),
    )


def vehicle_document(mission: Mission, plan: FleetPlan, part: VehiclePlan) -> PlanDocument:
    """One vehicle's plan, to be flown by its autopilot from the pad: take-off, track points, and how it ends."""
    vehicle = mission.vehicle(part.sysid)
    home = mission.frame.geodetic(np.array(vehicle.pad_m))
    above_m = np.array(vehicle.pad_m) + np.array([0.0, 0.0, mission.takeoff_height_m])
    endings = {OnArrival.LAND: Command.NAV_LAND, OnArrival.RTL: Command.NAV_RETURN_TO_LAUNCH}
    radius_m = 0.3 if mission.site is Site.INDOOR else 2.0
    ending = endings.get(mission.on_arrival)
    track = encode_track(part.track, mission.frame, acceptance_radius_m=radius_m, ending=ending)
    area = mission_area(mission, plan)
    return PlanDocument(
        items=(_take_off(mission.frame.geodetic(above_m)), *track),
        home=home,
        cruise_speed_m_s=mission.limits.cruise_speed_m_s,
        hover_speed_m_s=mission.limits.cruise_speed_m_s,
        polygons=area.polygons,
        circles=area.circles,
    )


def flown_tracks(path: Path) -> PlanDocument:
    """The ways of all vehicles in a recording.

    Raises:
        RecordingError: there is nothing whole in it.
    """
    ways = Ways(read_recording(path)).by_sysid
    tracks: list[Way] = []
    for sysid, way in sorted(ways.items()):
        geodetic = way.geodetic[:: 1 + len(way.records) // MOST_TRACK_POINTS]
        points = tuple(
            GeodeticPoint(latitude_deg=latitude, longitude_deg=longitude, altitude_amsl_m=altitude)
            for latitude, longitude, altitude in geodetic.tolist()
        )
        tracks.append(Way(name=f"vehicle {sysid}", points=points))
    return PlanDocument(tracks=tuple(tracks))


def _take_off(above: GeodeticPoint) -> MissionItem:
    return MissionItem(
        command=ItemCommand.NAV_TAKEOFF,
        param4=float("nan"),
        x=round(above.latitude_deg * DEG_E7),
        y=round(above.longitude_deg * DEG_E7),
        z=round(above.altitude_amsl_m, 3),
    )
