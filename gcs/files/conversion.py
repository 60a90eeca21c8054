"""From one file to another: which formats can be read, which written, and what goes from one into the other."""

from collections.abc import Callable
from enum import Enum
from pathlib import Path

from gcs.errors import BadFile, UsageError
from gcs.files.document import PlanDocument
from gcs.files.geojson import format_geojson, parse_geojson
from gcs.files.kml import format_kml, parse_kml
from gcs.files.qgc_plan import format_plan, parse_plan
from gcs.files.waypoints import format_waypoints, parse_waypoints

MOST_BYTES = 32 << 20

Notes = list[str]


class Format(Enum):
    """File formats by their suffix."""

    PLAN = ".plan"
    WAYPOINTS = ".waypoints"
    KML = ".kml"
    GEOJSON = ".geojson"
    MISSION = ".yaml"
    RECORDING = ".tlog"


_WRITERS: dict[Format, Callable[[PlanDocument], str]] = {
    Format.PLAN: format_plan,
    Format.WAYPOINTS: format_waypoints,
    Format.KML: format_kml,
    Format.GEOJSON: format_geojson,
}
WRITABLE = frozenset(_WRITERS)


def format_of(path: Path) -> Format:
    """By the suffix of a name.

    Raises:
        UsageError: it is none that is known.
    """
    suffix = {".yml": ".yaml", ".txt": ".waypoints", ".json": ".geojson"}.get(path.suffix.lower(), path.suffix.lower())
    try:
        return Format(suffix)
    except ValueError:
        known = ", ".join(one.value for one in Format)
        raise UsageError(f"{path}: expected a name that ends in one of {known}, found {path.suffix!r}") from None


def read_document(path: Path) -> tuple[PlanDocument, Notes]:
    """Read a plan or areas from a `.plan`, `.waypoints`, `.kml` or `.geojson`.

    Raises:
        BadFile: it cannot be read, or what is in it cannot be used.
        UsageError: it is in no such format.
    """
    kind = format_of(path)
    if kind not in WRITABLE:
        raise UsageError(f"{path}: expected one of {', '.join(one.value for one in Format if one in WRITABLE)}")
    return parse_document(_bytes(path), str(path), kind)


def parse_document(data: bytes, name: str, kind: Format) -> tuple[PlanDocument, Notes]:
    """The same from the bytes of a file.

    Raises:
        BadFile: what is in it cannot be used.
    """
    match kind:
        case Format.PLAN:
            return parse_plan(data, name), []
        case Format.WAYPOINTS:
            return parse_waypoints(data, name), []
        case Format.KML:
            return parse_kml(data, name)
        case Format.GEOJSON:
            return parse_geojson(data, name)
        case Format.MISSION | Format.RECORDING:
            raise UsageError(f"{name}: a {kind.value} holds no plan")


def format_document(document: PlanDocument, name: str, kind: Format) -> tuple[str, Notes]:
    """The text of a document in a format, and notes on what it cannot tell.

    Raises:
        BadFile: the format cannot hold the document.
    """
    if not document.contents and document.home is None:
        raise BadFile(name, "", "there is nothing to be written")
    if document.tracks and kind in {Format.PLAN, Format.WAYPOINTS}:
        raise BadFile(name, "", f"a {kind.value} holds what is to be flown, not what was: expected .kml or .geojson")
    try:
        text = _WRITERS[kind](document)
    except ValueError as wrong:
        raise BadFile(name, "", str(wrong)) from None
    return text, _losses(document, kind)


def _losses(document: PlanDocument, kind: Format) -> Notes:
    notes: Notes = []
    if kind in {Format.KML, Format.GEOJSON} and document.items:
        notes.append("a map shows where the mission goes, not its commands: it cannot be read back as a plan")
    if kind in {Format.KML, Format.GEOJSON} and document.circles:
        notes.append("circles are written as polygons")
    if kind is Format.KML and any(not polygon.inclusion for polygon in document.polygons):
        notes.append("KML does not tell areas to keep out of from areas to stay inside of: only their names do")
    return notes


def _bytes(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            data = file.read(MOST_BYTES + 1)
    except OSError as problem:
        raise BadFile(str(path), "", f"cannot be read: {problem.strerror}") from None
    if len(data) > MOST_BYTES:
        raise BadFile(str(path), "", f"expected at most {MOST_BYTES >> 20} MiB")
    return data
