"""A plan document as lines, points and areas on a map, for formats that know nothing else."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from gcs.files.document import CIRCLE_CORNERS, MOST_VERTICES, Circle, Place, PlanDocument
from missions.frames import GeodeticPoint, LocalFrame


class ShapeKind(Enum):
    """What a shape means."""

    MISSION = "mission"
    HOME = "home"
    FENCE = "fence"
    RALLY = "rally"
    TRACK = "track"


@dataclass(frozen=True)
class Shape:
    """One thing on a map.

    Args:
        closed: an area, its first point repeated at the end.
        inclusion: an area that must not be left, rather than not entered.
    """

    kind: ShapeKind
    name: str
    points: tuple[GeodeticPoint, ...]
    closed: bool = False
    inclusion: bool = True


def shapes_of(document: PlanDocument) -> Iterator[Shape]:
    """Yield everything in a document that has a place.

    Raises:
        ValueError: an altitude counts from where nobody knows.
    """
    if document.home is not None:
        yield Shape(ShapeKind.HOME, "home", (document.home,))
    way = tuple(place for _, place in document.way())
    if way:
        yield Shape(ShapeKind.MISSION, "mission", way)
    for polygon in document.polygons:
        yield _area(polygon.name or _fence_name(polygon.inclusion), polygon.corners, polygon.inclusion)
    for circle in document.circles:
        yield _area(
            f"{_fence_name(circle.inclusion)}, r = {circle.radius_m:g} m", circle_corners(circle), circle.inclusion
        )
    home_m = document.home.altitude_amsl_m if document.home is not None else 0.0
    for number, rally in enumerate(document.rally, start=1):
        yield Shape(ShapeKind.RALLY, f"rally point {number}", (_point(rally.place, home_m + rally.height_m),))
    for track in document.tracks:
        yield Shape(ShapeKind.TRACK, track.name, track.points)


def corners_of(ring: Sequence[Place]) -> tuple[Place, ...]:
    """The corners of a ring, whose last one repeats the first in most formats.

    Raises:
        ValueError: it has fewer than three different corners, or too many.
    """
    corners = tuple(ring[:-1] if len(ring) > 1 and ring[0] == ring[-1] else ring)
    if len(set(corners)) < 3 or len(corners) > MOST_VERTICES:
        raise ValueError(f"expected a ring of 3 to {MOST_VERTICES} different corners, found {len(set(corners))}")
    return corners


def _area(name: str, corners: Sequence[Place], inclusion: bool) -> Shape:
    ring = (*corners, corners[0])
    return Shape(ShapeKind.FENCE, name, tuple(_point(corner, 0.0) for corner in ring), True, inclusion)


def circle_corners(circle: Circle) -> list[Place]:
    """A circle's corners, outside of it where it must not be entered."""
    angles = np.linspace(0.0, 2.0 * np.pi, CIRCLE_CORNERS, endpoint=False)
    grown = 1.0 if circle.inclusion else 1.0 / np.cos(np.pi / CIRCLE_CORNERS)
    offsets_m = circle.radius_m * grown * np.stack((np.cos(angles), np.sin(angles), np.zeros_like(angles)), axis=-1)
    frame = LocalFrame(_point(circle.centre, 0.0))
    latitudes, longitudes, _ = frame.geodetic_arrays(offsets_m)
    return [Place(float(latitude), float(longitude)) for latitude, longitude in zip(latitudes, longitudes, strict=True)]


def _fence_name(inclusion: bool) -> str:
    return "stay inside" if inclusion else "keep out"


def _point(place: Place, altitude_amsl_m: float) -> GeodeticPoint:
    return GeodeticPoint(
        latitude_deg=place.latitude_deg, longitude_deg=place.longitude_deg, altitude_amsl_m=altitude_amsl_m
    )
