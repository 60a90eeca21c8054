"""`flight.png`: plan, flown path and obstacles, from above and from the side."""

from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from gcs.planner.plan import FleetPlan
from missions.mission import Mission
from missions.obstacles import pack, terrain_height
from missions.world import World

Array = npt.NDArray[np.float64]

KNOWN, UNKNOWN, THREAT = "#8a8f98", "#d9822b", "#d64545"


def draw_flight(path: Path, mission: Mission, plan: FleetPlan | None, flown_m: dict[str, Array]) -> None:
    """Write a PNG.

    Args:
        path: the file.
        mission: its world is drawn whole, unmapped obstacles in another colour.
        plan: the cloud's curves and track points, dashed.
        flown_m: vehicle name -> (n, 3) ENU positions.
    """
    figure = Figure(figsize=(11, 9), layout="constrained")
    top, side = figure.subplots(2, 1, height_ratios=[3, 1], sharex=True)
    _draw_top(top, mission.world)
    _draw_side(side, mission.world)
    colours = {vehicle.name: f"C{index % 10}" for index, vehicle in enumerate(mission.vehicles)}
    for part in plan.vehicles if plan else ():
        colour = colours[part.name]
        for axes, rows in ((top, (0, 1)), (side, (0, 2))):
            axes.plot(*part.curve_m[:, rows].T, "--", color=colour, linewidth=1.0)
            axes.plot(*part.track.points_m[:, rows].T, ".", color=colour, markersize=5)
    for name, positions_m in flown_m.items():
        for axes, rows in ((top, (0, 1)), (side, (0, 2))):
            axes.plot(*positions_m[:, rows].T, color=colours[name], linewidth=1.8, label=name)
    for target in mission.targets:
        top.plot(*target.position_m[:2], "*", color="black", markersize=10)
        side.plot(target.position_m[0], target.position_m[2], "*", color="black", markersize=10)
    top.set(title=f"{mission.name}: planned (dashed) and flown", ylabel="north [m]", aspect="equal")
    side.set(xlabel="east [m]", ylabel="up [m]")
    if flown_m:
        top.legend(loc="upper left")
    figure.savefig(path, dpi=110)


def _draw_top(axes: Axes, world: World) -> None:
    (west, east), (south, north) = world.bounds.east_m, world.bounds.north_m
    axes.add_patch(Rectangle((west, south), east - west, north - south, fill=False, linestyle=":"))
    for box in world.boxes:
        corner = (box.centre_m[0] - box.half_m[0], box.centre_m[1] - box.half_m[1])
        axes.add_patch(Rectangle(corner, 2 * box.half_m[0], 2 * box.half_m[1], color=_colour(box.known), alpha=0.6))
    for cylinder in world.cylinders:
        axes.add_patch(Circle(cylinder.centre_m, cylinder.radius_m, color=_colour(cylinder.known), alpha=0.6))
    for threat in world.threats:
        axes.add_patch(Circle(threat.centre_m, threat.radius_m, color=THREAT, alpha=0.2))
    if world.peaks:
        axes.contour(*_terrain(world), levels=8, colors="#5b8c5a", linewidths=0.7)
    axes.autoscale_view()


def _draw_side(axes: Axes, world: World) -> None:
    low, high = world.bounds.up_m
    (west, east) = world.bounds.east_m
    axes.add_patch(Rectangle((west, low), east - west, high - low, fill=False, linestyle=":"))
    for box in world.boxes:
        corner = (box.centre_m[0] - box.half_m[0], box.centre_m[2] - box.half_m[2])
        axes.add_patch(Rectangle(corner, 2 * box.half_m[0], 2 * box.half_m[2], color=_colour(box.known), alpha=0.3))
    for cylinder in world.cylinders:
        corner = (cylinder.centre_m[0] - cylinder.radius_m, cylinder.base_m)
        size = (2 * cylinder.radius_m, cylinder.top_m - cylinder.base_m)
        axes.add_patch(Rectangle(corner, *size, color=_colour(cylinder.known), alpha=0.3))
    for threat in world.threats:
        axes.add_patch(Circle((threat.centre_m[0], 0.0), threat.radius_m, color=THREAT, alpha=0.12))
    if world.peaks:
        east_m, _, height_m = _terrain(world)
        axes.fill_between(east_m, height_m.max(axis=0), color="#5b8c5a", alpha=0.3)
    axes.autoscale_view()
    axes.set_ylim(low - 0.05 * (high - low), high + 0.05 * (high - low))


def _terrain(world: World) -> tuple[Array, Array, Array]:
    east_m = np.linspace(*world.bounds.east_m, 200)
    north_m = np.linspace(*world.bounds.north_m, 200)
    grid = np.stack(np.meshgrid(east_m, north_m), axis=-1)
    return east_m, north_m, terrain_height(grid, pack(world))


def _colour(known: bool) -> str:
    return KNOWN if known else UNKNOWN
