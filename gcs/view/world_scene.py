"""The world as it is drawn: ground, flight range, obstacles, threats, pads and targets. It does not move."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import numpy.typing as npt
import viser

from gcs.view import colours, shapes
from gcs.view.colours import Rgb
from gcs.view.ground_scene import GroundScene, grid_spacing_m
from gcs.view.ground_text import written
from gcs.view.theme import DARK, Theme
from missions import editing, obstacles
from missions.editing import Part
from missions.mission import Mission
from missions.world import Bounds, Box, Cylinder, World

Array = npt.NDArray[np.float64]
OnPick = Callable[[Part], None]
"""Told which part was clicked, in a thread of viser."""

MARKER_SHARE = 0.014
"""A target's size, of the diagonal of the flight range."""
TEXT_SHARE = 0.02
"""Height of what is written on the ground, likewise."""
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


def diagonal_m(bounds: Bounds) -> float:
    return float(np.linalg.norm(bounds.high_enu_m - bounds.low_enu_m))


class WorldScene:
    """Everything of a mission that stands still.

    Args:
        server: of the page.
        mission: what is drawn.
        simulated: the simulator flies in it, so what no planner is told of is there too, and drawn as unmapped.
        theme: dark or light.
    """

    def __init__(self, server: viser.ViserServer, mission: Mission, *, simulated: bool, theme: Theme = DARK) -> None:
        self._scene = server.scene
        self._simulated, self._on_pick = simulated, None
        self._drawn: set[str] = set()
        self._set(mission)
        peaks = obstacles.pack(World(bounds=mission.world.bounds, peaks=self._world.peaks))
        self._ground = GroundScene(server.scene, mission.world.bounds, peaks)
        self._size_m = diagonal_m(mission.world.bounds)
        self._text_m = self._size_m * TEXT_SHARE
        self._target_colours: Mapping[str, Rgb] = {}
        self.draw(theme)

    def draw(self, theme: Theme) -> None:
        """Draw everything, in place of what was drawn before."""
        self._theme = theme
        self._ground.draw(theme)
        self._draw_things()

    def show(self, mission: Mission, on_pick: OnPick | None = None) -> None:
        """Draw another mission in the same flight range and terrain; `on_pick` makes its parts clickable."""
        self._set(mission)
        self._on_pick = on_pick
        self._draw_things()

    def _set(self, mission: Mission) -> None:
        self._mission, self._world = mission, mission.world if self._simulated else mission.world.as_known()

    def _draw_things(self) -> None:
        """Draw all but the ground, and take away what was drawn before and is no more."""
        before, self._drawn = self._drawn, set()
        self._draw_bounds(self._mission.world.bounds)
        self._draw_fence(self._mission.world.bounds)
        self._draw_obstacles()
        self._draw_threats()
        self._draw_movers()
        self._draw_starts()
        self._draw_targets()
        for name in sorted(before - self._drawn, reverse=True):  # a node goes before the one that it hangs on
            self._scene.remove_by_name(name)

    def ground_height_m(self, places_m: Array) -> Array:
        """(n,) height of the ground [m] at (n, 2 or 3) places."""
        return self._ground.height_m(places_m)

    def colour_targets(self, by_target: Mapping[str, Rgb]) -> None:
        """Give targets the colours of the vehicles that fly to them."""
        if by_target != self._target_colours:
            self._target_colours = dict(by_target)
            self._draw_targets()

    def _draw_bounds(self, bounds: Bounds) -> None:
        edges = shapes.box_edges(bounds.low_enu_m, bounds.high_enu_m)
        self._lines("/world/bounds", edges, self._theme.bounds, 1.2)
        self._draw_dimensions(bounds)

    def _draw_fence(self, bounds: Bounds) -> None:
        """The geofence on the ground, dashed: it is as high as the sky for those who look at it from above."""
        margin_m = self._mission.site.fence_margin_m
        (west, east), (south, north) = bounds.east_m, bounds.north_m
        corners = np.array([[west, south], [east, south], [east, north], [west, north]])
        outwards = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * margin_m
        lift_m = bounds.up_m[0] + 0.001 * self._size_m
        fence = np.column_stack((corners + outwards, np.full(4, lift_m)))
        self._lines("/world/fence", shapes.dashed(shapes.ring(fence), 0.012 * self._size_m), self._theme.fence, 2.0)

    def _draw_dimensions(self, bounds: Bounds) -> None:
        (west, east), (south, north) = bounds.east_m, bounds.north_m
        away_m = 1.2 * self._text_m
        self._write(f"{east - west:g} m", np.array([(west + east) / 2, south - away_m, 0.0]), self._theme.writing)
        self._write(
            f"{north - south:g} m", np.array([west - 2.2 * away_m, (south + north) / 2, 0.0]), self._theme.writing
        )

    def _draw_obstacles(self) -> None:
        for box in self._world.boxes:
            centre, half = np.array(box.centre_m), np.array(box.half_m)
            edges = shapes.box_edges(centre - half, centre + half)
            self._draw_solid(box, shapes.box_mesh(box), edges)
        for cylinder in self._world.cylinders:
            self._draw_solid(cylinder, shapes.cylinder_mesh(cylinder), shapes.cylinder_edges(cylinder))

    def _draw_solid(self, thing: Box | Cylinder, mesh: shapes.Mesh, edges: Array) -> None:
        if thing.known:
            self._mesh(f"/world/{thing.name}", mesh, self._theme.obstacle, 0.85, _part(thing))
            self._lines(f"/world/{thing.name}/edges", edges, self._theme.obstacle_edge, 1.5)
            self._write_before(thing.name, mesh, self._theme.obstacle_edge)
        else:
            spacing_m = grid_spacing_m(float(np.ptp(mesh.vertices, axis=0).max()) * 2)
            self._mesh(f"/world/{thing.name}", mesh, colours.UNMAPPED, 0.25, _part(thing))
            self._lines(f"/world/{thing.name}/edges", edges, colours.UNMAPPED, 2.0)
            self._lines(f"/world/{thing.name}/hatching", shapes.hatching(thing, spacing_m), colours.UNMAPPED, 1.0)
            self._write_before(f"{thing.name} (unmapped)", mesh, colours.UNMAPPED)

    def _draw_threats(self) -> None:
        for threat in self._world.threats:
            dome = shapes.hemisphere(threat.radius_m)
            place = np.array([*threat.centre_m, 0.0])
            dome = shapes.Mesh(dome.vertices + place, dome.faces)
            colour = colours.THREAT if threat.known else colours.UNMAPPED
            self._mesh(f"/world/{threat.name}", dome, colour, 0.2, Part(editing.Kind.THREAT, threat.name))
            rims = [self._parallel(threat.centre_m, threat.radius_m, angle) for angle in np.deg2rad([0.0, 30.0, 60.0])]
            self._lines(f"/world/{threat.name}/rims", np.concatenate(rims), colour, 1.5)
            self._write_before(threat.name, dome, colour)

    def _draw_movers(self) -> None:
        for mover in self._world.movers:
            way = np.array([[mover.from_m, mover.to_m]])
            self._lines(f"/world/{mover.name}/way", way, colours.UNMAPPED, 2.0)
            for index, end in enumerate((mover.from_m, mover.to_m)):
                name = f"/world/{mover.name}/{index}"
                self._scene.add_icosphere(name, mover.radius_m, colours.UNMAPPED, opacity=0.3, position=end)
            place = np.array([*mover.from_m[:2], 0.0]) - np.array([0.0, mover.radius_m + self._text_m, 0.0])
            self._write(f"{mover.name} (moves, unmapped)", place, colours.UNMAPPED)

    def _draw_starts(self) -> None:
        radius_m = 0.35 * self._mission.site.pad_spacing_m
        vehicles = self._mission.vehicles
        fleet = colours_of(range(len(vehicles)))
        rings = [shapes.ring(self._on_ground(shapes.circle(radius_m, 32, v.pad_m), v.pad_m[2])) for v in vehicles]
        self._coloured_lines("/world/pads", rings, fleet, 2.0)
        if self._mission.launch_point_m is not None:
            place = np.array(self._mission.launch_point_m)
            self._write("launch point", place - np.array([0.0, self._text_m, 0.0]), self._theme.writing)
        if self._mission.launch_zone_radius_m > 0.0 and self._mission.launch_point_m is not None:
            zone = shapes.circle(self._mission.launch_zone_radius_m, 64, self._mission.launch_point_m)
            self._lines("/world/launch zone", shapes.ring(self._on_ground(zone)), self._theme.writing, 1.0)

    def _draw_targets(self) -> None:
        targets = self._mission.targets
        own = [colours.vivid(self._target_colours.get(target.name, colours.TARGET)) for target in targets]
        places_m = np.array([target.position_m for target in targets])
        mesh = shapes.diamond(self._size_m * MARKER_SHARE)
        diamonds = self._scene.add_batched_meshes_simple(
            "/world/targets",
            mesh.vertices,
            mesh.faces,
            np.tile(UPRIGHT, (len(targets), 1)),
            places_m,
            batched_colors=np.array(own, dtype=np.uint8),
            flat_shading=True,
            lod="off",
        )
        on_pick = self._on_pick
        if on_pick is not None:
            picks = [Part(editing.Kind.TARGET, target.name) for target in targets]
            diamonds.on_click(lambda event: on_pick(picks[event.instance_index or 0]))
        feet = self._on_ground(places_m[:, :2])
        stems = [np.stack((foot, place))[None] for foot, place in zip(feet, places_m, strict=True)]
        feet_m = self._size_m * MARKER_SHARE * 0.6
        rings = [shapes.ring(self._on_ground(shapes.circle(feet_m, 32, place))) for place in places_m]
        lines = [np.concatenate(pair) for pair in zip(stems, rings, strict=True)]
        self._coloured_lines("/world/target stems", lines, own, 1.5)

    def _on_ground(self, outline: Array, above_m: float = 0.0) -> Array:
        lift_m = above_m + 0.001 * self._size_m
        return np.column_stack((outline, self.ground_height_m(outline) + lift_m))

    def _parallel(self, centre_m: tuple[float, float], radius_m: float, angle: float) -> Array:
        rim = shapes.circle(radius_m * np.cos(angle), 64, centre_m)
        return shapes.ring(np.column_stack((rim, np.full(64, radius_m * np.sin(angle)))))

    def _write_before(self, text: str, mesh: shapes.Mesh, colour: Rgb) -> None:
        """On the ground to the south of a body."""
        low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
        self._write(text, np.array([(low[0] + high[0]) / 2, low[1] - 0.9 * self._text_m, 0.0]), colour)

    def _write(self, text: str, place_m: Array, colour: Rgb) -> None:
        """On the ground around a place; it faces up alone."""
        above_m = float(self.ground_height_m(place_m)) + 0.002 * self._size_m
        mesh = written(text, self._text_m, np.array([place_m[0], place_m[1], above_m]))
        name = f"/writing/{text}"
        self._drawn.add(name)
        self._scene.add_mesh_simple(name, mesh.vertices, mesh.faces, color=colour, side="double", cast_shadow=False)

    def _mesh(self, name: str, mesh: shapes.Mesh, colour: Rgb, opacity: float, part: Part | None = None) -> None:
        self._drawn.add(name)
        handle = self._scene.add_mesh_simple(
            name, mesh.vertices, mesh.faces, color=colour, opacity=opacity, flat_shading=len(mesh.faces) < 100
        )
        on_pick = self._on_pick
        if on_pick is not None and part is not None:
            handle.on_click(lambda _: on_pick(part))

    def _lines(self, name: str, segments: Array, colour: Rgb, width_px: float) -> None:
        self._drawn.add(name)
        self._scene.add_line_segments(name, segments, colour, thickness=width_px, thickness_units="screen")

    def _coloured_lines(self, name: str, lines: Sequence[Array], own: Sequence[Rgb], width_px: float) -> None:
        segments = np.concatenate(lines)
        tints = np.concatenate(
            [np.tile(np.array(colour, np.uint8), (len(part), 2, 1)) for part, colour in zip(lines, own, strict=True)]
        )
        self._scene.add_line_segments(name, segments, tints, thickness=width_px, thickness_units="screen")


def _part(thing: Box | Cylinder) -> Part:
    return Part(editing.Kind.BOX if isinstance(thing, Box) else editing.Kind.CYLINDER, thing.name)


def colours_of(indices: Sequence[int]) -> list[Rgb]:
    return [colours.vivid(colours.vehicle_colour(index)) for index in indices]
