"""Distances to everything solid or forbidden in a world: packed arrays, and compiled functions over them.

`clearance` is the distance lambda of the paper (eqs. 3, 13): from a point to the nearest surface of a threat, a peak's
body or an obstacle, flat ground excluded, negative inside. `terrain_height` is the ground of eq. 23.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from missions.kernels import compiled
from missions.world import BASE_HEIGHT_SHARE, World

Array = npt.NDArray[np.float64]

FAR_M = 1e6
"""The clearance of a world with nothing in it [m]."""

PROFILE_STEPS = 32
PROFILE_EDGE = float(np.sqrt(-np.log(BASE_HEIGHT_SHARE)))
"""Radius of a peak's foot in units of its slope."""
PROFILE = np.exp(-(np.linspace(0.0, PROFILE_EDGE, PROFILE_STEPS + 1) ** 2))
"""The profile of eq. 23 in units of height and slope: one table serves every peak. The nearest point is looked for
among these; it is sharpened ..."""
NEAR_ENOUGH = 1e-5
"""... until it moves by no more than this share of the slope; the distance is off by the square of that."""


class Obstacles(NamedTuple):
    """The solid and forbidden things of a world as arrays, which compiled code can read."""

    boxes: Array
    """(n, 6): centre east, north, up; half size east, north, up [m]."""
    cylinders: Array
    """(n, 5): centre east, north; radius; base; top [m]."""
    threats: Array
    """(n, 3): centre east, north; radius [m]."""
    peaks: Array
    """(n, 5): centre east, north; slope x_s = y_s; height; bottom radius [m]."""


def pack(world: World, *, with_threats: bool = True) -> Obstacles:
    """Arrays of everything in `world` but its movers; sensors and collisions do without the threats."""
    boxes = [(*box.centre_m, *box.half_m) for box in world.boxes]
    cylinders = [(*c.centre_m, c.radius_m, c.base_m, c.top_m) for c in world.cylinders]
    threats = [(*threat.centre_m, threat.radius_m) for threat in world.threats if with_threats]
    peaks = [(*peak.centre_m, peak.slope_m, peak.top_m, peak.radius_m) for peak in world.peaks]
    return Obstacles(
        boxes=np.array(boxes, dtype=float).reshape(-1, 6),
        cylinders=np.array(cylinders, dtype=float).reshape(-1, 5),
        threats=np.array(threats, dtype=float).reshape(-1, 3),
        peaks=np.array(peaks, dtype=float).reshape(-1, 5),
    )


def clearance(points_enu_m: Array, obstacles: Obstacles) -> Array:
    """Distances [m] from (n, 3) ENU points to the nearest surface; negative inside, `FAR_M` with no obstacle."""
    return _clearance_of_points(np.ascontiguousarray(points_enu_m, dtype=float).reshape(-1, 3), obstacles)


def terrain_height(points_enu_m: Array, obstacles: Obstacles) -> Array:
    """Height of the ground [m] below (n, 2 or 3) ENU points: the sum of all peaks (eq. 23)."""
    points = np.ascontiguousarray(points_enu_m, dtype=float)
    return _terrain_below_points(points.reshape(-1, points.shape[-1]), obstacles).reshape(points.shape[:-1])


@compiled
def _clearance_of_points(points_enu_m: Array, obstacles: Obstacles) -> Array:
    out = np.empty(len(points_enu_m))
    fill_clearance(points_enu_m, obstacles, out)
    return out


@compiled
def _terrain_below_points(points_enu_m: Array, obstacles: Obstacles) -> Array:
    out = np.empty(len(points_enu_m))
    for i in range(len(points_enu_m)):
        out[i] = terrain_height_at(points_enu_m[i, 0], points_enu_m[i, 1], obstacles)
    return out


@compiled
def fill_clearance(points_enu_m: Array, obstacles: Obstacles, out: Array) -> None:
    """Write `clearance` of (n, 3 or more) points into `out` (n,); further columns are not read.

    The arrays are taken out of `obstacles` once: doing so for every point would cost more than the distances.
    """
    boxes, cylinders, threats, peaks = obstacles.boxes, obstacles.cylinders, obstacles.threats, obstacles.peaks
    if len(boxes) + len(cylinders) + len(threats) + len(peaks) == 0:
        out[:] = FAR_M
        return
    for i in range(len(points_enu_m)):
        east, north, up = points_enu_m[i, 0], points_enu_m[i, 1], points_enu_m[i, 2]
        out[i] = nearest_of(east, north, up, boxes, cylinders, threats, peaks)


@compiled
def clearance_at(east: float, north: float, up: float, obstacles: Obstacles) -> float:
    """`clearance` of one point, to be called from compiled code."""
    return nearest_of(east, north, up, obstacles.boxes, obstacles.cylinders, obstacles.threats, obstacles.peaks)


@compiled
def nearest_of(
    east: float, north: float, up: float, boxes: Array, cylinders: Array, threats: Array, peaks: Array
) -> float:
    """`clearance` [m] of one point to what stands in the arrays of `Obstacles`, whose shapes are said there."""
    nearest = FAR_M
    for i in range(len(boxes)):
        nearest = min(nearest, _to_box(east, north, up, boxes, i))
    for i in range(len(cylinders)):
        nearest = min(nearest, _to_cylinder(east, north, up, cylinders, i))
    for i in range(len(threats)):
        de, dn = east - threats[i, 0], north - threats[i, 1]
        nearest = min(nearest, np.sqrt(de * de + dn * dn + up * up) - threats[i, 2])  # eq. 22
    for i in range(len(peaks)):
        nearest = min(nearest, _to_peak(east, north, up, peaks[i], nearest))
    return nearest


@compiled
def terrain_height_at(east: float, north: float, obstacles: Obstacles) -> float:
    """`terrain_height` of one point, to be called from compiled code."""
    height = 0.0
    peaks = obstacles.peaks
    for i in range(len(peaks)):
        de, dn = east - peaks[i, 0], north - peaks[i, 1]
        height += peaks[i, 3] * np.exp(-(de * de + dn * dn) / (peaks[i, 2] * peaks[i, 2]))
    return height


@compiled
def _to_box(east: float, north: float, up: float, boxes: Array, i: int) -> float:
    de, dn = abs(east - boxes[i, 0]) - boxes[i, 3], abs(north - boxes[i, 1]) - boxes[i, 4]
    du = abs(up - boxes[i, 2]) - boxes[i, 5]
    inside = min(max(de, max(dn, du)), 0.0)
    de, dn, du = max(de, 0.0), max(dn, 0.0), max(du, 0.0)
    return np.sqrt(de * de + dn * dn + du * du) + inside


@compiled
def _to_cylinder(east: float, north: float, up: float, cylinders: Array, i: int) -> float:
    de, dn = east - cylinders[i, 0], north - cylinders[i, 1]
    radial = np.sqrt(de * de + dn * dn) - cylinders[i, 2]
    axial = max(cylinders[i, 3] - up, up - cylinders[i, 4])
    inside = min(max(radial, axial), 0.0)
    radial, axial = max(radial, 0.0), max(axial, 0.0)
    return np.sqrt(radial * radial + axial * axial) + inside


@compiled
def _to_peak(east: float, north: float, up: float, peak: Array, nearer_than: float) -> float:
    """Distance to a Gaussian hill of revolution: the nearest point of its profile z(u) = H exp(-u^2 / s^2).

    With r the distance from the axis, the squared distance d(u) = (u - r)^2 + (z(u) - up)^2 may have several
    minima between where the vertical and the horizontal through the point meet the profile: a coarse look
    finds the lowest, safeguarded Newton steps on d'(u) / 2 sharpen it.
    """
    de, dn = east - peak[0], north - peak[1]
    radius = np.sqrt(de * de + dn * dn)
    slope, height, foot = peak[2], peak[3], peak[4]
    beyond, above = max(radius - foot, 0.0), max(up - height, 0.0)
    if nearer_than > 0.0 and beyond * beyond + above * above >= nearer_than * nearer_than:
        return nearer_than  # its bounding cylinder is farther off already
    steepness = -1.0 / (slope * slope)
    level = min(max(up, BASE_HEIGHT_SHARE * height), height)
    beside = slope * np.sqrt(np.log(height / level))
    low, high = min(radius, beside), min(max(radius, beside), foot)
    spacing = slope * PROFILE_EDGE / PROFILE_STEPS
    best, nearest_u = np.inf, low
    for i in range(int(low / spacing), min(int(high / spacing) + 1, PROFILE_STEPS) + 1):
        across, along = i * spacing - radius, height * PROFILE[i] - up
        squared = across * across + along * along
        if squared < best:
            best, nearest_u = squared, i * spacing
    low, high = max(low, nearest_u - spacing), min(high, nearest_u + spacing)
    u = min(max(nearest_u, low), high)
    for _ in range(30):
        z = height * np.exp(steepness * u * u)
        dz = 2.0 * steepness * u * z
        ddz = (2.0 * steepness + 4.0 * steepness * steepness * u * u) * z
        half_slope = (u - radius) + (z - up) * dz
        if half_slope > 0.0:
            high = u
        else:
            low = u
        curvature = 1.0 + dz * dz + (z - up) * ddz
        stepped = u - half_slope / curvature if curvature > 0.0 else low - 1.0
        stepped = stepped if low <= stepped <= high else 0.5 * (low + high)
        moved, u = abs(stepped - u), stepped
        if moved < NEAR_ENOUGH * slope:
            break
    best = (u - radius) ** 2 + (height * np.exp(steepness * u * u) - up) ** 2
    inside = radius < foot and up < height * np.exp(steepness * radius * radius)
    return -np.sqrt(best) if inside else np.sqrt(best)
