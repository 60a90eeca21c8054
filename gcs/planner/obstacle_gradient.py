"""Clearance and height above the terrain with their gradients, for the compiled cost of a curve.

The same distances as `missions.obstacles.clearance`, which has no gradients; a test holds the two equal.
"""

import numpy as np
import numpy.typing as npt

from missions.kernels import compiled
from missions.obstacles import FAR_M, Obstacles
from missions.world import BASE_HEIGHT_SHARE

Array = npt.NDArray[np.float64]
Gradient = tuple[float, float, float, float]
"""A value [m] and its derivatives by east, north and up."""

PROFILE_STEPS = 32
PROFILE_EDGE = float(np.sqrt(-np.log(BASE_HEIGHT_SHARE)))
"""Radius of a peak's foot in units of its slope."""
PROFILE = np.exp(-(np.linspace(0.0, PROFILE_EDGE, PROFILE_STEPS + 1) ** 2))
"""The profile of eq. 23 in units of height and slope: one table serves every peak."""

NEWTON_STEPS = 20


@compiled
def clearance_gradient_at(east: float, north: float, up: float, obstacles: Obstacles, cap_m: float) -> Gradient:
    """min(clearance, cap_m) of one point and its gradient; the gradient is zero where the cap holds."""
    nearest = (min(cap_m, FAR_M), 0.0, 0.0, 0.0)
    threats = obstacles.threats
    for i in range(len(threats)):
        de, dn = east - threats[i, 0], north - threats[i, 1]
        distance = max(np.sqrt(de * de + dn * dn + up * up), 1e-9)
        if distance - threats[i, 2] < nearest[0]:  # eq. 22
            nearest = (distance - threats[i, 2], de / distance, dn / distance, up / distance)
    for i in range(len(obstacles.boxes)):
        nearest = _nearer_box(east, north, up, obstacles.boxes, i, nearest)
    for i in range(len(obstacles.cylinders)):
        nearest = _nearer_cylinder(east, north, up, obstacles.cylinders, i, nearest)
    for i in range(len(obstacles.peaks)):
        nearest = _nearer_peak(east, north, up, obstacles.peaks, i, nearest)
    return nearest


@compiled
def height_gradient_at(east: float, north: float, up: float, obstacles: Obstacles) -> Gradient:
    """Height above the terrain of eq. 23 and its gradient."""
    height, ge, gn = up, 0.0, 0.0
    peaks = obstacles.peaks
    for i in range(len(peaks)):
        de, dn = east - peaks[i, 0], north - peaks[i, 1]
        steepness = 1.0 / (peaks[i, 2] * peaks[i, 2])
        exponent = (de * de + dn * dn) * steepness
        if exponent < 40.0:  # below a double's resolution of any height beyond
            ground = peaks[i, 3] * np.exp(-exponent)
            height -= ground
            ge += 2.0 * de * steepness * ground
            gn += 2.0 * dn * steepness * ground
    return height, ge, gn, 1.0


@compiled
def _nearer_box(east: float, north: float, up: float, boxes: Array, i: int, nearest: Gradient) -> Gradient:
    oe, on, ou = east - boxes[i, 0], north - boxes[i, 1], up - boxes[i, 2]
    de, dn, du = abs(oe) - boxes[i, 3], abs(on) - boxes[i, 4], abs(ou) - boxes[i, 5]
    ce, cn, cu = max(de, 0.0), max(dn, 0.0), max(du, 0.0)
    outside = np.sqrt(ce * ce + cn * cn + cu * cu)
    distance = outside + min(max(de, max(dn, du)), 0.0)
    if distance >= nearest[0]:
        return nearest
    if outside > 0.0:
        return distance, np.sign(oe) * ce / outside, np.sign(on) * cn / outside, np.sign(ou) * cu / outside
    if de >= dn and de >= du:  # inside: out through the nearest face
        return distance, np.sign(oe), 0.0, 0.0
    if dn >= du:
        return distance, 0.0, np.sign(on), 0.0
    return distance, 0.0, 0.0, np.sign(ou)


@compiled
def _nearer_cylinder(east: float, north: float, up: float, cylinders: Array, i: int, nearest: Gradient) -> Gradient:
    de, dn = east - cylinders[i, 0], north - cylinders[i, 1]
    from_axis = max(np.sqrt(de * de + dn * dn), 1e-9)
    radial, below, above = from_axis - cylinders[i, 2], cylinders[i, 3] - up, up - cylinders[i, 4]
    axial = max(below, above)
    cr, ca = max(radial, 0.0), max(axial, 0.0)
    outside = np.sqrt(cr * cr + ca * ca)
    distance = outside + min(max(radial, axial), 0.0)
    if distance >= nearest[0]:
        return nearest
    gr, ga = (cr / outside, ca / outside) if outside > 0.0 else ((1.0, 0.0) if radial >= axial else (0.0, 1.0))
    return distance, gr * de / from_axis, gr * dn / from_axis, ga if above > below else -ga


@compiled
def _nearer_peak(east: float, north: float, up: float, peaks: Array, i: int, nearest: Gradient) -> Gradient:
    """Distance to a Gaussian hill of revolution: to the nearest point of its profile z(u) = H exp(-u^2 / s^2)."""
    de, dn = east - peaks[i, 0], north - peaks[i, 1]
    radius = max(np.sqrt(de * de + dn * dn), 1e-9)
    slope, height, edge = peaks[i, 2], peaks[i, 3], peaks[i, 4]
    if max(radius - edge, up - height) >= nearest[0]:
        return nearest  # its bounding cylinder is farther off already
    foot = slope * _foot_on_profile(radius / slope, up / slope, height / slope)
    ground = height * np.exp(-(foot * foot) / (slope * slope))
    across, along = radius - foot, up - ground
    distance = max(np.sqrt(across * across + along * along), 1e-9)
    if radius < edge and up < height * np.exp(-(radius * radius) / (slope * slope)):
        distance = -distance
    if distance >= nearest[0]:
        return nearest
    outwards = across / distance / radius
    return distance, outwards * de, outwards * dn, along / distance


@compiled
def _foot_on_profile(radius: float, up: float, height: float) -> float:
    """The u that minimises (u - radius)^2 + (height exp(-u^2) - up)^2, lengths in units of the peak's slope.

    It lies between where the horizontal and the vertical through the point meet the profile; there may be several
    minima: a look at the table finds the lowest, safeguarded Newton steps sharpen it.
    """
    level = min(max(up, BASE_HEIGHT_SHARE * height), height)
    beside = np.sqrt(np.log(height / level))
    low, high = min(radius, beside), min(max(radius, beside), PROFILE_EDGE)
    spacing = PROFILE_EDGE / PROFILE_STEPS
    best, u = np.inf, low
    for j in range(int(low / spacing), min(int(high / spacing) + 1, PROFILE_STEPS) + 1):
        across, along = j * spacing - radius, height * PROFILE[j] - up
        squared = across * across + along * along
        if squared < best:
            best, u = squared, j * spacing
    low, high = max(low, u - spacing), min(high, u + spacing)
    u = min(max(u, low), high)
    for _ in range(NEWTON_STEPS):
        z = height * np.exp(-u * u)
        dz = -2.0 * u * z
        half_slope = (u - radius) + (z - up) * dz
        low, high = (low, u) if half_slope > 0.0 else (u, high)
        curvature = 1.0 + dz * dz + (z - up) * (4.0 * u * u - 2.0) * z
        stepped = u - half_slope / curvature if curvature > 0.0 else low - 1.0
        stepped = stepped if low <= stepped <= high else 0.5 * (low + high)
        if abs(stepped - u) < 1e-7:
            return stepped
        u = stepped
    return u
