"""KML: areas in (polygons, their holes as areas to keep out of), plans and flown tracks out.

Files come from anywhere: no document type, and so no entity, is accepted, nesting and size are bounded.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat
from xml.sax.saxutils import escape

import msgspec

from gcs.errors import BadFile
from gcs.files.document import MOST_VERTICES, Place, PlanDocument, Polygon
from gcs.files.shapes import Shape, corners_of, shapes_of
from missions.frames import GeodeticPoint

MOST_DEPTH = 60
MOST_AREAS = 1000
LEFT_OUT = frozenset({"Point", "LineString", "LinearRing", "Model", "Track", "MultiTrack"})
_HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n<kml xmlns="http://www.opengis.net/kml/2.2">\n<Document>\n'
_TAIL = "</Document>\n</kml>\n"


def parse_kml(data: bytes, name: str) -> tuple[PlanDocument, list[str]]:
    """The areas in a KML file, and notes on what else was in it.

    Raises:
        BadFile: no KML, a document type, or an area that is none; names the line.
    """
    reader = _Reader(name)
    parser = expat.ParserCreate(namespace_separator=" ")
    parser.buffer_text = True
    parser.StartDoctypeDeclHandler = reader.refuse_doctype
    parser.StartElementHandler = reader.start
    parser.EndElementHandler = reader.end
    parser.CharacterDataHandler = reader.text
    reader.line = lambda: parser.CurrentLineNumber
    try:
        parser.Parse(data, True)
    except expat.ExpatError as wrong:
        raise BadFile(name, f"line {wrong.lineno}", f"expected KML, found {expat.ErrorString(wrong.code)}") from None
    except (LookupError, ValueError) as wrong:  # of Python's codecs
        raise BadFile(name, "line 1", f"expected UTF-8, found another encoding ({wrong})") from None
    if not reader.is_kml:
        raise BadFile(name, "", "expected a kml element")
    return PlanDocument(polygons=tuple(reader.polygons)), reader.notes


def format_kml(document: PlanDocument) -> str:
    """A KML file with plan, areas, rally points and tracks.

    Raises:
        ValueError: an altitude counts from where nobody knows.
    """
    return _HEAD + "".join(_placemark(shape) for shape in shapes_of(document)) + _TAIL


@dataclass
class _Reader:
    """Collects polygons while a parser reads."""

    name: str
    polygons: list[Polygon] = field(default_factory=list[Polygon])
    notes: list[str] = field(default_factory=list[str])
    is_kml: bool = False
    _path: list[str] = field(default_factory=list[str])
    _title: str = ""
    _text: list[str] = field(default_factory=list[str])

    def line(self) -> int:
        """Where the parser is."""
        return 0

    def refuse_doctype(self, *_: object) -> None:
        raise BadFile(self.name, f"line {self.line()}", "expected no document type: it could define entities")

    def start(self, tag: str, _: dict[str, str]) -> None:
        element = tag.rpartition(" ")[2]
        if len(self._path) >= MOST_DEPTH:
            raise BadFile(self.name, f"line {self.line()}", f"expected at most {MOST_DEPTH} nested elements")
        self.is_kml = self.is_kml or (not self._path and element == "kml")
        if element == "Placemark":
            self._title = ""
        if element in LEFT_OUT and "Polygon" not in self._path:
            self.notes.append(f"line {self.line()}: {element} {self._title!r} is no area and is left out")
        self._path.append(element)
        self._text = []

    def text(self, text: str) -> None:
        if self._path and self._path[-1] in {"name", "coordinates"}:
            self._text.append(text)

    def end(self, _: str) -> None:
        element, text = self._path.pop(), "".join(self._text)
        if element == "name" and self._path and self._path[-1] == "Placemark":
            self._title = text.strip()[:80]
        if element == "coordinates" and "Polygon" in self._path:
            self._add(text)
        self._text = []

    def _add(self, text: str) -> None:
        where = f"line {self.line()}: polygon {self._title!r}"
        if len(self.polygons) >= MOST_AREAS:
            raise BadFile(self.name, where, f"expected at most {MOST_AREAS} areas")
        inclusion = "innerBoundaryIs" not in self._path
        try:
            places = list(_places(text))
            self.polygons.append(Polygon(corners=corners_of(places), inclusion=inclusion, name=self._title))
        except ValueError as wrong:
            raise BadFile(self.name, where, str(wrong)) from None


def _places(text: str) -> Iterator[Place]:
    """Places of `lon,lat[,alt]` tuples between blanks."""
    words = text.split()
    if len(words) > MOST_VERTICES:
        raise ValueError(f"expected at most {MOST_VERTICES} corners, found {len(words)}")
    for word in words:
        parts = word.split(",")
        try:
            longitude, latitude = float(parts[0]), float(parts[1])
            yield msgspec.convert({"latitude_deg": latitude, "longitude_deg": longitude}, Place)
        except (ValueError, IndexError, msgspec.ValidationError):
            raise ValueError(
                f"expected longitude,latitude[,altitude] in degrees and metres, found {word[:60]!r}"
            ) from None


def _placemark(shape: Shape) -> str:
    coordinates = " ".join(_tuple(point) for point in shape.points)
    ring = f"<coordinates>{coordinates}</coordinates>"
    if shape.closed:
        inner = f"<Polygon><outerBoundaryIs><LinearRing>{ring}</LinearRing></outerBoundaryIs></Polygon>"
    else:
        kind = "Point" if len(shape.points) == 1 else "LineString"
        inner = f"<{kind}><altitudeMode>absolute</altitudeMode>{ring}</{kind}>"
    return f"<Placemark><name>{escape(shape.name)}</name>{inner}</Placemark>\n"


def _tuple(point: GeodeticPoint) -> str:
    return f"{point.longitude_deg!r},{point.latitude_deg!r},{point.altitude_amsl_m!r}"
