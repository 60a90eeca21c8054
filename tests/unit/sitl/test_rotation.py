"""The compiled quaternions mean what scipy's rotations mean."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sitl.dynamics import rotation


def random_quaternions(n: int = 50) -> list[tuple[float, float, float, float]]:
    return [tuple(q) for q in Rotation.random(n, random_state=3).as_quat(scalar_first=True, canonical=True).tolist()]


def scipy_rotation(q) -> Rotation:
    return Rotation.from_quat(q, scalar_first=True)


def test_products_compose_rotations():
    for p, q in zip(random_quaternions(), reversed(random_quaternions()), strict=True):
        expected = scipy_rotation(p) * scipy_rotation(q)
        assert np.allclose(scipy_rotation(rotation.product(p, q)).as_matrix(), expected.as_matrix())


def test_body_axes_and_vectors_turn_as_they_should():
    vector = (0.3, -1.0, 2.0)
    for q in random_quaternions():
        assert np.allclose(rotation.body_z(q), scipy_rotation(q).apply([0, 0, 1]))
        assert np.allclose(rotation.to_body(q, vector), scipy_rotation(q).inv().apply(vector))


def test_euler_angles_are_yaw_pitch_roll():
    for q in random_quaternions():
        yaw, pitch, roll = scipy_rotation(q).as_euler("ZYX")
        assert np.allclose(rotation.euler(q), (roll, pitch, yaw))


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-3, 1.0, 3.0])
def test_a_rotation_vector_turns_by_its_length(angle):
    axis = np.array([1.0, -2.0, 0.5]) / np.linalg.norm([1.0, -2.0, 0.5])
    q = rotation.from_rotation_vector(*(axis * angle))
    assert np.allclose(scipy_rotation(q).as_rotvec(), axis * angle, atol=1e-12)


def test_matrices_become_the_same_rotation_in_all_four_branches():
    for q in [*random_quaternions(), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0)]:
        matrix = scipy_rotation(q).as_matrix()
        assert np.allclose(scipy_rotation(rotation.from_matrix(*matrix.ravel())).as_matrix(), matrix)


def test_an_attitude_is_found_for_every_thrust_axis_and_heading():
    rng = np.random.default_rng(5)
    for _ in range(50):
        z = rng.normal(size=3)
        z /= np.linalg.norm(z)
        yaw = rng.uniform(-math.pi, math.pi)
        attitude = scipy_rotation(rotation.from_z_and_yaw(tuple(z), yaw))
        x_axis, _, z_axis = attitude.as_matrix().T
        assert np.allclose(z_axis, z)
        sideways = np.array([-math.sin(yaw), math.cos(yaw), 0.0])
        assert abs(x_axis @ sideways) < 1e-9  # the nose stays in the vertical plane of the heading


def test_angles_wrap_to_half_turns():
    for angle in np.linspace(-20.0, 20.0, 401):
        wrapped = rotation.wrap_pi(angle)
        assert -math.pi < wrapped <= math.pi
        assert math.isclose(math.sin(wrapped), math.sin(angle), abs_tol=1e-9)
