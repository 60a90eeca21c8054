"""`gcs convert`: plans, areas and tracks from one file format into another."""

from pathlib import Path
from typing import Annotated

import typer

from gcs.errors import UsageError
from missions.mission import load_mission


def convert(
    source: Annotated[Path, typer.Argument(metavar="IN", help=".plan, .waypoints, .kml, .geojson, .yaml or .tlog")],
    target: Annotated[Path, typer.Argument(metavar="OUT", help=".plan, .waypoints, .kml or .geojson")],
) -> None:
    """Convert a plan, areas or flown tracks into another format. What the other one cannot hold is refused.

    Examples:

        gcs convert survey.plan survey.waypoints     for MAVProxy or Mission Planner

        gcs convert field.kml fence.plan             polygons drawn in Google Earth become a fence

        gcs convert out/flight.tlog flown.kml        where the vehicles were
    """
    from gcs.files.conversion import WRITABLE, Format, format_document, format_of, read_document
    from gcs.files.sources import flown_tracks, mission_area

    into = format_of(target)
    if into not in WRITABLE:
        hint = "a mission needs vehicles, targets and limits" if into is Format.MISSION else "nothing is recorded here"
        raise UsageError(f"{target}: cannot be made from {source}: {hint}")
    notes: list[str] = []
    match format_of(source):
        case Format.MISSION:
            document = mission_area(load_mission(source))
        case Format.RECORDING:
            document = flown_tracks(source)
        case _:
            document, notes = read_document(source)
    text, losses = format_document(document, str(source), into)
    write_text(target, text)
    for note in notes + losses:
        print(f"note: {note}")
    print(f"{target}: {', '.join(document.contents) or 'home'}")


def write_text(path: Path, text: str) -> None:
    """Write a file as a whole.

    Raises:
        UsageError: it cannot be written.
    """
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as problem:
        raise UsageError(f"{path}: cannot be written: {problem.strerror}") from None
