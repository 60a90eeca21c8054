"""Quaternions (w, x, y, z) as tuples of floats, for compiled code; Hamilton's product, FRD -> NED."""

import math

from missions.kernels import compiled

Quaternion = tuple[float, float, float, float]
Vector = tuple[float, float, float]


@compiled
def product(p: Quaternion, q: Quaternion) -> Quaternion:
    """The rotation q followed by p."""
    return (
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    )


@compiled
def conjugate(q: Quaternion) -> Quaternion:
    """The rotation back."""
    return (q[0], -q[1], -q[2], -q[3])


@compiled
def unit(q: Quaternion) -> Quaternion:
    """`q` at length 1, with w >= 0."""
    scale = 1.0 / math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    if q[0] < 0.0:
        scale = -scale
    return (q[0] * scale, q[1] * scale, q[2] * scale, q[3] * scale)


@compiled
def body_z(q: Quaternion) -> Vector:
    """The body's z axis (down) in NED."""
    return (
        2.0 * (q[1] * q[3] + q[0] * q[2]),
        2.0 * (q[2] * q[3] - q[0] * q[1]),
        q[0] * q[0] - q[1] * q[1] - q[2] * q[2] + q[3] * q[3],
    )


@compiled
def to_body(q: Quaternion, v: Vector) -> Vector:
    """A NED vector in the body's axes."""
    turned = product(product(conjugate(q), (0.0, v[0], v[1], v[2])), q)
    return (turned[1], turned[2], turned[3])


@compiled
def from_rotation_vector(x: float, y: float, z: float) -> Quaternion:
    """The rotation by |(x, y, z)| [rad] about (x, y, z)."""
    angle = math.sqrt(x * x + y * y + z * z)
    scale = math.sin(0.5 * angle) / angle if angle > 1e-9 else 0.5
    return (math.cos(0.5 * angle), x * scale, y * scale, z * scale)


@compiled
def yaw_of(q: Quaternion) -> float:
    """Heading [rad] of the body's x axis, in (-pi, pi]."""
    return math.atan2(2.0 * (q[0] * q[3] + q[1] * q[2]), 1.0 - 2.0 * (q[2] * q[2] + q[3] * q[3]))


@compiled
def euler(q: Quaternion) -> Vector:
    """Roll, pitch, yaw [rad]."""
    roll = math.atan2(2.0 * (q[0] * q[1] + q[2] * q[3]), 1.0 - 2.0 * (q[1] * q[1] + q[2] * q[2]))
    pitch = math.asin(min(max(2.0 * (q[0] * q[2] - q[3] * q[1]), -1.0), 1.0))
    return (roll, pitch, yaw_of(q))


@compiled
def from_z_and_yaw(z: Vector, yaw_rad: float) -> Quaternion:
    """The attitude whose z axis is the unit vector `z` and whose nose points along `yaw_rad` as well as it can."""
    cos_yaw, sin_yaw = math.cos(yaw_rad), math.sin(yaw_rad)
    # x = y_c cross z, where y_c is the horizontal axis to the right of the heading
    xx, xy, xz = cos_yaw * z[2], sin_yaw * z[2], -sin_yaw * z[1] - cos_yaw * z[0]
    if z[2] < 0.0:  # keep the nose to the front when upside down
        xx, xy, xz = -xx, -xy, -xz
    length = math.sqrt(xx * xx + xy * xy + xz * xz)
    if length < 1e-6:
        xx, xy, xz, length = 0.0, 0.0, 1.0, 1.0
    xx, xy, xz = xx / length, xy / length, xz / length
    yx, yy, yz = z[1] * xz - z[2] * xy, z[2] * xx - z[0] * xz, z[0] * xy - z[1] * xx
    return from_matrix(xx, yx, z[0], xy, yy, z[1], xz, yz, z[2])


@compiled
def from_matrix(
    m00: float, m01: float, m02: float, m10: float, m11: float, m12: float, m20: float, m21: float, m22: float
) -> Quaternion:
    """The quaternion of a rotation matrix given row by row (Shepperd's method)."""
    trace = m00 + m11 + m22
    if trace > 0.0:
        w = 1.0 + trace
        return unit((w, m21 - m12, m02 - m20, m10 - m01))
    if m00 >= m11 and m00 >= m22:
        return unit((m21 - m12, 1.0 + m00 - m11 - m22, m01 + m10, m02 + m20))
    if m11 >= m22:
        return unit((m02 - m20, m01 + m10, 1.0 + m11 - m00 - m22, m12 + m21))
    return unit((m10 - m01, m02 + m20, m12 + m21, 1.0 + m22 - m00 - m11))


@compiled
def wrap_pi(angle_rad: float) -> float:
    """The same direction in (-pi, pi]."""
    return math.pi - (math.pi - angle_rad) % (2.0 * math.pi)
