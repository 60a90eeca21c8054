"""The legend: what the things in the scene are, for those that this scene has; pure."""

from collections.abc import Iterator
from html import escape

from gcs.view.colours import PALETTE, THREAT, UNMAPPED, Rgb, css
from gcs.view.theme import Theme
from gcs.view.vehicle_scene import MANY
from missions.mission import Mission

VEHICLE = PALETTE[0]
"""Lines are explained in the first vehicle's colour."""

Entry = tuple[str, Rgb, str]
"""CSS class of the sample, its colour, and what it means."""


def render(mission: Mission | None, theme: Theme, *, simulated: bool) -> str:
    """The legend as HTML; it folds."""
    items = "".join(
        f'<li><s class="{sample}" style="--own:{css(colour)}"></s>{escape(meaning)}</li>'
        for sample, colour, meaning in _entries(mission, theme, simulated)
    )
    return f'<details class="gcs-legend"><summary>Legend</summary><ul>{items}</ul></details>'


def _entries(mission: Mission | None, theme: Theme, simulated: bool) -> Iterator[Entry]:
    yield "line", theme.line_ahead(VEHICLE), "flown next (on board)"
    many = mission is not None and len(mission.vehicles) > MANY
    yield "line", theme.line_behind(VEHICLE, many=many), "flown so far"
    if mission is None:
        return
    yield "thin", theme.line_planned(VEHICLE, many=many), "planned by the cloud"
    if not many:
        yield "dot", theme.line_planned(VEHICLE, many=False), "track point"
    yield "diamond", VEHICLE, "target, in its vehicle's colour"
    yield "area", theme.bounds, "flight range"
    yield "dashed", theme.fence, "geofence"
    world = mission.world
    if world.boxes or world.cylinders:
        yield "area", theme.obstacle_edge, "obstacle"
    if world.threats:
        yield "area", THREAT, "threat: not to be entered"
    if simulated and _has_unmapped(mission):
        yield "area", UNMAPPED, "there, but not on the map"
    if world.peaks:
        yield "thin", theme.contour, "contour line"
    yield "dot", theme.observed, "seen by vehicles, not on the map"


def _has_unmapped(mission: Mission) -> bool:
    world = mission.world
    mapped = (*world.boxes, *world.cylinders, *world.threats, *world.peaks)
    return bool(world.movers) or any(not thing.known for thing in mapped)
