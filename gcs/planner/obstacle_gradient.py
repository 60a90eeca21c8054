"""Clearance and height above the terrain with their gradients, for the samples of a curve.

The same distances as `missions.obstacles.clearance`, which has no gradients; a test holds the two equal. Every function
goes through all samples, so that its arrays are unpacked once per curve.
"""

import numpy as np
import numpy.typing as npt

from missions.kernels import compiled
from missions.obstacles import FAR_M, PROFILE, PROFILE_EDGE, PROFILE_STEPS, Obstacles
from missions.world import BASE_HEIGHT_SHARE

Array = npt.NDArray[np.float64]

NEWTON_STEPS = 20
NEAR_ENOUGH = 1e-4
"""A Newton step as short as this, in units of the slope, leaves an error of its square."""
NO_GROUND = 40.0
"""Exponent from which on a peak of eq. 23 is lower than a double can tell."""


@compiled
def clearances(points_m: Array, obstacles: Obstacles, cap_m: float, out: Array) -> None:
    """Fill (m, 4) `out` with min(clearance, cap_m) of (m, 3) points and its gradient, zero where the cap holds."""
    out[:, 0] = min(cap_m, FAR_M)
    out[:, 1:] = 0.0
    _threats(points_m, obstacles.threats, out)
    _boxes(points_m, obstacles.boxes, out)
    _cylinders(points_m, obstacles.cylinders, out)
    _peaks(points_m, obstacles.peaks, out)


@compiled
def heights(points_m: Array, obstacles: Obstacles, out: Array) -> None:
    """Fill (m, 4) `out` with the heights of (m, 3) points above the terrain of eq. 23, and their gradients."""
    peaks = obstacles.peaks
    for m in range(len(points_m)):
        out[m, 0], out[m, 1], out[m, 2], out[m, 3] = points_m[m, 2], 0.0, 0.0, 1.0
        for i in range(len(peaks)):
            de, dn = points_m[m, 0] - peaks[i, 0], points_m[m, 1] - peaks[i, 1]
            steepness = 1.0 / (peaks[i, 2] * peaks[i, 2])
            exponent = (de * de + dn * dn) * steepness
            if exponent < NO_GROUND:
                ground = peaks[i, 3] * np.exp(-exponent)
                out[m, 0] -= ground
                out[m, 1] += 2.0 * de * steepness * ground
                out[m, 2] += 2.0 * dn * steepness * ground


@compiled
def _threats(points_m: Array, threats: Array, out: Array) -> None:
    for i in range(len(threats)):
        for m in range(len(points_m)):
            de, dn, du = points_m[m, 0] - threats[i, 0], points_m[m, 1] - threats[i, 1], points_m[m, 2]
            from_centre = np.sqrt(de * de + dn * dn + du * du)
            if from_centre - threats[i, 2] < out[m, 0]:  # eq. 22
                scale = 1.0 / max(from_centre, 1e-9)
                out[m, 0] = from_centre - threats[i, 2]
                out[m, 1], out[m, 2], out[m, 3] = de * scale, dn * scale, du * scale


@compiled
def _boxes(points_m: Array, boxes: Array, out: Array) -> None:
    for i in range(len(boxes)):
        for m in range(len(points_m)):
            oe, on, ou = points_m[m, 0] - boxes[i, 0], points_m[m, 1] - boxes[i, 1], points_m[m, 2] - boxes[i, 2]
            de, dn, du = abs(oe) - boxes[i, 3], abs(on) - boxes[i, 4], abs(ou) - boxes[i, 5]
            ce, cn, cu = max(de, 0.0), max(dn, 0.0), max(du, 0.0)
            outside = np.sqrt(ce * ce + cn * cn + cu * cu)
            inside = min(max(de, max(dn, du)), 0.0)
            if outside + inside >= out[m, 0]:
                continue
            if outside > 0.0:
                ce, cn, cu = ce / outside, cn / outside, cu / outside
            else:  # out through the nearest face
                ce, cn, cu = 1.0 * (de == inside), 1.0 * (dn == inside), 1.0 * (du == inside)
            out[m, 0] = outside + inside
            out[m, 1], out[m, 2], out[m, 3] = np.sign(oe) * ce, np.sign(on) * cn, np.sign(ou) * cu


@compiled
def _cylinders(points_m: Array, cylinders: Array, out: Array) -> None:
    for i in range(len(cylinders)):
        for m in range(len(points_m)):
            de, dn, up = points_m[m, 0] - cylinders[i, 0], points_m[m, 1] - cylinders[i, 1], points_m[m, 2]
            from_axis = np.sqrt(de * de + dn * dn)
            radial, below, above = from_axis - cylinders[i, 2], cylinders[i, 3] - up, up - cylinders[i, 4]
            axial = max(below, above)
            cr, ca = max(radial, 0.0), max(axial, 0.0)
            outside = np.sqrt(cr * cr + ca * ca)
            inside = min(max(radial, axial), 0.0)
            if outside + inside >= out[m, 0]:
                continue
            if outside > 0.0:
                cr, ca = cr / outside, ca / outside
            else:
                cr, ca = 1.0 * (radial == inside), 1.0 * (axial == inside)
            scale = cr / max(from_axis, 1e-9)
            out[m, 0] = outside + inside
            out[m, 1], out[m, 2], out[m, 3] = de * scale, dn * scale, ca if above > below else -ca


@compiled
def _peaks(points_m: Array, peaks: Array, out: Array) -> None:
    """Distances to Gaussian hills of revolution: to the nearest points of their profiles z(u) = H exp(-u^2 / s^2)."""
    for i in range(len(peaks)):
        slope, height, edge = peaks[i, 2], peaks[i, 3], peaks[i, 4]
        for m in range(len(points_m)):
            de, dn, up = points_m[m, 0] - peaks[i, 0], points_m[m, 1] - peaks[i, 1], points_m[m, 2]
            radius = np.sqrt(de * de + dn * dn)
            across, along = max(radius - edge, 0.0), max(up - height, 0.0)
            if across * across + along * along >= out[m, 0] * out[m, 0] and out[m, 0] > 0.0:
                continue  # its bounding cylinder is farther off already
            foot = slope * _foot_on_profile(radius / slope, up / slope, height / slope)
            ground = height * np.exp(-(foot * foot) / (slope * slope))
            across, along = radius - foot, up - ground
            distance = max(np.sqrt(across * across + along * along), 1e-9)
            if radius < edge and up < height * np.exp(-(radius * radius) / (slope * slope)):
                distance = -distance
            if distance < out[m, 0]:
                scale = across / distance / max(radius, 1e-9)
                out[m, 0] = distance
                out[m, 1], out[m, 2], out[m, 3] = scale * de, scale * dn, along / distance


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
        moved, u = abs(stepped - u), stepped
        if moved < NEAR_ENOUGH:
            break
    return u
