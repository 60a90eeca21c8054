"""Shapes as arrays: meshes of vertices (n, 3) and faces (m, 3), and line segments (n, 2, 3); metres, z up."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from missions.obstacles import Obstacles, terrain_height
from missions.world import Bounds, Box, Cylinder

Array = npt.NDArray[np.float64]
Faces = npt.NDArray[np.uint32]

ROTOR_ANGLES = np.deg2rad([45.0, 135.0, 225.0, 315.0])
ROTOR_RADIUS = 0.19
ARM_LENGTH = 0.5 - ROTOR_RADIUS
"""Of a quadrotor that measures 1 from rotor tip to rotor tip."""


class Mesh(NamedTuple):
    """A triangle mesh."""

    vertices: Array
    faces: Faces


class Quadrotor(NamedTuple):
    """A quadrotor of size 1 in its body frame (x forward, y left, z up), in parts that are coloured apart."""

    hull: Mesh
    airframe: Mesh
    rotors: Mesh


def merged(meshes: Sequence[Mesh]) -> Mesh:
    """All of them as one."""
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = [mesh.faces + offset for mesh, offset in zip(meshes, first[:-1], strict=True)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces).astype(np.uint32))


def loft(low: Array, high: Array) -> Mesh:
    """The closed body between two convex outlines of n corners each, (n, 3), counter-clockwise from above."""
    n = len(low)
    here, following = np.arange(n), np.roll(np.arange(n), -1)
    sides = np.concatenate(
        [np.stack((here, following, following + n), axis=1), np.stack((here, following + n, here + n), axis=1)]
    )
    fan = np.stack((np.zeros(n - 2, dtype=int), np.arange(1, n - 1), np.arange(2, n)), axis=1)
    faces = np.concatenate([sides, fan[:, ::-1], fan + n])
    return Mesh(np.concatenate([low, high]), faces.astype(np.uint32))


def prism(outline: Array, low_m: float, high_m: float) -> Mesh:
    """An upright body over a convex outline (n, 2), counter-clockwise."""
    return loft(_raised(outline, low_m), _raised(outline, high_m))


def circle(radius_m: float, segments: int, centre_m: Sequence[float] = (0.0, 0.0)) -> Array:
    """(segments, 2) corners of a circle, counter-clockwise."""
    angles = np.linspace(0.0, 2.0 * np.pi, segments, endpoint=False)
    return np.asarray(centre_m)[:2] + radius_m * np.stack((np.cos(angles), np.sin(angles)), axis=1)


def quadrotor() -> Quadrotor:
    """An X-shaped quadrotor whose hull points forward."""
    outline = np.array([[0.27, 0.0], [0.1, 0.1], [-0.17, 0.09], [-0.2, 0.0], [-0.17, -0.09], [0.1, -0.1]])
    roof = _raised(outline * 0.6, 0.085)
    hull = merged([loft(_raised(outline, -0.02), _raised(outline, 0.03)), loft(_raised(outline, 0.03), roof)])
    hubs = ARM_LENGTH * np.stack((np.cos(ROTOR_ANGLES), np.sin(ROTOR_ANGLES)), axis=1)
    arms = [prism(_bar(hub, 0.026), -0.005, 0.025) for hub in hubs]
    motors = [prism(circle(0.04, 8, hub), -0.02, 0.07) for hub in hubs]
    legs = [prism(circle(0.014, 6, hub * 0.55), -0.11, 0.0) for hub in hubs]
    rotors = [prism(circle(ROTOR_RADIUS, 20, hub), 0.07, 0.078) for hub in hubs]
    return Quadrotor(hull, merged([*arms, *motors, *legs]), merged(rotors))


def small_quadrotor() -> Mesh:
    """A quadrotor of size 1 of a tenth as many triangles, for a picture in which it is a few pixels wide."""
    outline = np.array([[0.27, 0.0], [-0.17, 0.12], [-0.17, -0.12]])
    hubs = ARM_LENGTH * np.stack((np.cos(ROTOR_ANGLES), np.sin(ROTOR_ANGLES)), axis=1)
    arms = [_plate(_bar(hub, 0.05), 0.02) for hub in hubs]
    rotors = [_plate(circle(ROTOR_RADIUS, 8, hub), 0.07) for hub in hubs]
    return merged([loft(_raised(outline, -0.04), _raised(outline * 0.6, 0.09)), *arms, *rotors])


def hemisphere(radius_m: float, rings: int = 16, segments: int = 48) -> Mesh:
    """The upper half of a sphere around the origin, open below."""
    latitudes = np.linspace(0.0, np.pi / 2, rings + 1)[:-1]
    levels = [_raised(circle(radius_m * np.cos(angle), segments), radius_m * np.sin(angle)) for angle in latitudes]
    vertices = np.concatenate([*levels, [[0.0, 0.0, radius_m]]])
    here, following = np.arange(segments), np.roll(np.arange(segments), -1)
    bands: list[npt.NDArray[np.int64]] = []
    for ring in range(rings - 1):
        low, high = ring * segments, (ring + 1) * segments
        bands.append(np.stack((low + here, low + following, high + following), axis=1))
        bands.append(np.stack((low + here, high + following, high + here), axis=1))
    last, top = (rings - 1) * segments, rings * segments
    bands.append(np.stack((last + here, last + following, np.full(segments, top)), axis=1))
    return Mesh(vertices, np.concatenate(bands).astype(np.uint32))


def diamond(size_m: float) -> Mesh:
    """An octahedron around the origin, `size_m` high and wide."""
    half = size_m / 2
    ring, tip = _raised(circle(half * 0.7, 4), 0.0), np.array([[0.0, 0.0, -half], [0.0, 0.0, half]])
    here, following = np.arange(4), np.roll(np.arange(4), -1)
    below = np.stack((following, here, np.full(4, 4)), axis=1)
    above = np.stack((here, following, np.full(4, 5)), axis=1)
    return Mesh(np.concatenate([ring, tip]), np.concatenate([below, above]).astype(np.uint32))


def terrain(bounds: Bounds, peaks: Obstacles, cells: int) -> Mesh:
    """The ground of a world: a grid of `cells` x `cells` over its bounds, raised to the terrain."""
    east = np.linspace(*bounds.east_m, cells + 1)
    north = np.linspace(*bounds.north_m, cells + 1)
    points = np.stack(np.meshgrid(east, north, indexing="xy"), axis=-1).reshape(-1, 2)
    vertices = np.column_stack((points, terrain_height(points, peaks)))
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    right, above = corner + 1, corner + cells + 1
    faces = np.concatenate([np.stack((corner, right, above + 1), 1), np.stack((corner, above + 1, above), 1)])
    return Mesh(vertices, faces.astype(np.uint32))


def polyline(points_m: Array) -> Array:
    """(n - 1, 2, 3) segments that join (n, 3) points."""
    return np.stack((points_m[:-1], points_m[1:]), axis=1)


def ring(points_m: Array) -> Array:
    """(n, 2, 3) segments of the closed line through (n, 3) points."""
    return np.stack((points_m, np.roll(points_m, -1, axis=0)), axis=1)


def dashed(segments: Array, dash_m: float) -> Array:
    """(m, 2, 3) dashes about `dash_m` long, as far apart, along (n, 2, 3) segments."""
    dashes: list[Array] = []
    for start, end in segments:
        count = max(1, round(float(np.linalg.norm(end - start)) / (2.0 * dash_m)))
        along = (np.arange(count)[:, None] + np.array([0.25, 0.75])) / count
        dashes.append(start + along[..., None] * (end - start))
    return np.concatenate(dashes)


def box_edges(low_m: Array, high_m: Array) -> Array:
    """(12, 2, 3) edges of the box between two corners."""
    outline = _rectangle(low_m, high_m)
    floor, roof = _raised(outline, low_m[2]), _raised(outline, high_m[2])
    return np.concatenate([ring(floor), ring(roof), np.stack((floor, roof), axis=1)])


def cylinder_edges(cylinder: Cylinder, segments: int = 48) -> Array:
    """(2 x segments, 2, 3) the rims of a cylinder."""
    rim = circle(cylinder.radius_m, segments, cylinder.centre_m)
    return np.concatenate([ring(_raised(rim, cylinder.base_m)), ring(_raised(rim, cylinder.top_m))])


def box_mesh(box: Box) -> Mesh:
    centre, half = np.array(box.centre_m), np.array(box.half_m)
    low, high = centre - half, centre + half
    return prism(_rectangle(low, high), low[2], high[2])


def cylinder_mesh(cylinder: Cylinder, segments: int = 48) -> Mesh:
    return prism(circle(cylinder.radius_m, segments, cylinder.centre_m), cylinder.base_m, cylinder.top_m)


def hatching(thing: Box | Cylinder, spacing_m: float) -> Array:
    """(n, 2, 3) slanted lines over the upright faces of an obstacle."""
    if isinstance(thing, Cylinder):
        outline = circle(thing.radius_m, 24, thing.centre_m)
        return _slanted(outline, thing.base_m, thing.top_m, spacing_m)
    centre, half = np.array(thing.centre_m), np.array(thing.half_m)
    return _slanted(_rectangle(centre - half, centre + half), centre[2] - half[2], centre[2] + half[2], spacing_m)


def draped(bounds: Bounds, peaks: Obstacles, spacing_m: float, samples: int) -> Array:
    """(n, 2, 3) a square grid of lines that follow the terrain, a little above it."""
    lines: list[Array] = []
    for axis, (low, high), (start, end) in ((0, bounds.east_m, bounds.north_m), (1, bounds.north_m, bounds.east_m)):
        along = np.linspace(start, end, samples + 1)
        for across in np.arange(math.ceil(low / spacing_m), math.floor(high / spacing_m) + 1) * spacing_m:
            points = np.empty((samples + 1, 3))
            points[:, axis], points[:, 1 - axis] = across, along
            points[:, 2] = terrain_height(points[:, :2], peaks) + 0.002 * (end - start)
            lines.append(polyline(points))
    return np.concatenate(lines)


def _slanted(outline: Array, low_m: float, high_m: float, spacing_m: float) -> Array:
    """Lines that climb at 45 degrees over the walls above an outline (n, 2), cut at floor, roof and edges."""
    corners = np.concatenate([outline, outline[:1]])
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    ends = np.concatenate(([0.0], np.cumsum(lengths)))
    height = high_m - low_m
    segments: list[Array] = []
    for start in np.arange(-height, ends[-1], spacing_m):
        cuts = np.unique(np.clip([start, start + height, *ends], max(start, 0.0), min(start + height, ends[-1])))
        for begin, end in pairwise(cuts):
            along = np.array([begin, end])
            places = np.stack([np.interp(along, ends, corners[:, axis]) for axis in (0, 1)], axis=1)
            segments.append(np.column_stack((places, low_m + along - start)))
    return np.array(segments).reshape(-1, 2, 3)


def _plate(outline: Array, up_m: float) -> Mesh:
    """A convex outline (n, 2) as a face without thickness."""
    n = len(outline)
    fan = np.stack((np.zeros(n - 2, dtype=int), np.arange(1, n - 1), np.arange(2, n)), axis=1)
    return Mesh(_raised(outline, up_m), fan.astype(np.uint32))


def _rectangle(low_m: Array, high_m: Array) -> Array:
    return np.array([[low_m[0], low_m[1]], [high_m[0], low_m[1]], [high_m[0], high_m[1]], [low_m[0], high_m[1]]])


def _bar(tip: Array, width: float) -> Array:
    """(4, 2) corners of a bar from the origin to a tip."""
    side = np.array([-tip[1], tip[0]]) / np.linalg.norm(tip) * width / 2
    return np.array([side, -side, tip - side, tip + side])


def _raised(outline: Array, up_m: float) -> Array:
    return np.column_stack((outline, np.full(len(outline), up_m)))
