"""GeoJSON (RFC 7946): areas in (polygons, their holes as areas to keep out of), plans and flown tracks out."""

from typing import Annotated, Any, TypeVar, cast

import msgspec

from gcs.errors import BadFile
from gcs.files.document import Place, PlanDocument, Polygon
from gcs.files.shapes import Shape, corners_of, shapes_of

MOST_AREAS = 1000
MOST_DEPTH = 20

T = TypeVar("T")

Position = Annotated[list[float], msgspec.Meta(min_length=2, max_length=4)]


def parse_geojson(data: bytes, name: str) -> tuple[PlanDocument, list[str]]:
    """The areas in a GeoJSON file, and notes on what else was in it. A feature's property `inclusion: false` keeps out.

    Raises:
        BadFile: no GeoJSON, or an area that is none; names the key.
    """
    try:
        root = msgspec.json.decode(data)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as wrong:
        raise BadFile(name, "", f"expected GeoJSON: {wrong}") from None
    reader = _Reader(name)
    reader.read("$", root, {})
    return PlanDocument(polygons=tuple(reader.polygons)), reader.notes


def format_geojson(document: PlanDocument) -> str:
    """A FeatureCollection with plan, areas, rally points and tracks.

    Raises:
        ValueError: an altitude counts from where nobody knows.
    """
    features = [_feature(shape) for shape in shapes_of(document)]
    collection = {"type": "FeatureCollection", "features": features}
    return msgspec.json.format(msgspec.json.encode(collection), indent=1).decode() + "\n"


class _Reader:
    """Walks through objects, and collects polygons."""

    def __init__(self, name: str) -> None:
        self.polygons: list[Polygon] = []
        self.notes: list[str] = []
        self._name = name

    def read(self, key: str, thing: object, properties: dict[str, Any], depth: int = 0) -> None:
        """Take in one object and what is inside of it."""
        found = _object(thing)
        if not isinstance(found.get("type"), str) or depth > MOST_DEPTH:
            raise BadFile(self._name, key, f"expected a GeoJSON object with a type, found {str(thing)[:40]!r}")
        match found["type"]:
            case "FeatureCollection":
                self._each(f"{key}.features", found.get("features"), properties, depth)
            case "GeometryCollection":
                self._each(f"{key}.geometries", found.get("geometries"), properties, depth)
            case "Feature":
                if found.get("geometry") is not None:
                    self.read(f"{key}.geometry", found["geometry"], _object(found.get("properties")), depth + 1)
            case "Polygon":
                self._polygon(key, self._rings(key, found, list[list[Position]]), properties)
            case "MultiPolygon":
                for rings in self._rings(key, found, list[list[list[Position]]]):
                    self._polygon(key, rings, properties)
            case "Point" | "MultiPoint" | "LineString" | "MultiLineString" as kind:
                self.notes.append(f"{key}: a {kind} is no area and is left out")
            case other:
                raise BadFile(self._name, f"{key}.type", f"expected a type of GeoJSON, found {other[:40]!r}")

    def _each(self, key: str, things: object, properties: dict[str, Any], depth: int) -> None:
        if not isinstance(things, list):
            raise BadFile(self._name, key, f"expected a list, found {str(things)[:40]!r}")
        for index, thing in enumerate(cast(list[object], things)):
            self.read(f"{key}[{index}]", thing, properties, depth + 1)

    def _rings(self, key: str, thing: dict[str, Any], kind: type[T]) -> T:
        try:
            return msgspec.convert(thing.get("coordinates"), kind)
        except msgspec.ValidationError as wrong:
            raise BadFile(self._name, f"{key}.coordinates", f"{wrong}".replace("`", "")) from None

    def _polygon(self, key: str, rings: list[list[Position]], properties: dict[str, Any]) -> None:
        outer = properties.get("inclusion", True) is not False
        title = str(properties.get("name", ""))[:80]
        for number, ring in enumerate(rings):
            where = f"{key}.coordinates[{number}]"
            if len(self.polygons) >= MOST_AREAS:
                raise BadFile(self._name, where, f"expected at most {MOST_AREAS} areas")
            try:
                places = [msgspec.convert({"latitude_deg": p[1], "longitude_deg": p[0]}, Place) for p in ring]
                self.polygons.append(Polygon(corners=corners_of(places), inclusion=outer and number == 0, name=title))
            except (msgspec.ValidationError, ValueError) as wrong:
                raise BadFile(self._name, where, f"{wrong}".replace("`", "")) from None


def _object(thing: object) -> dict[str, Any]:
    """A decoded JSON object; an empty one in place of anything else."""
    return cast(dict[str, Any], thing) if isinstance(thing, dict) else {}


def _feature(shape: Shape) -> dict[str, Any]:
    points = [[p.longitude_deg, p.latitude_deg, p.altitude_amsl_m] for p in shape.points]
    flat = [point[:2] for point in points]
    if shape.closed:
        geometry: dict[str, Any] = {"type": "Polygon", "coordinates": [flat]}
    elif len(points) == 1:
        geometry = {"type": "Point", "coordinates": points[0]}
    else:
        geometry = {"type": "LineString", "coordinates": points}
    properties: dict[str, Any] = {"name": shape.name, "kind": shape.kind.value}
    if shape.closed:
        properties["inclusion"] = shape.inclusion
    return {"type": "Feature", "properties": properties, "geometry": geometry}
