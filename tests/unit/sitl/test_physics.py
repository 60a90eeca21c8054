"""The rigid body obeys Newton and Euler: against a plain numpy model, and against what must come out."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sitl.control.attitude_control import signal_for_thrust
from sitl.dynamics.airframe import GRAVITY_M_S2, SIH, X500_LIKE, Airframe
from sitl.dynamics.rigid_body import move
from sitl.dynamics.state import new_fleet

DT_S = 0.004
CALM = np.zeros(3)


def body(**state):
    fleet = new_fleet(1)
    for name, value in state.items():
        fleet[name][0] = value
    return fleet


def reference_step(v: dict, airframe: Airframe, wind: np.ndarray) -> dict:
    """MR-1 to MR-5 with numpy and scipy, term by term."""
    share = DT_S / (airframe.rotor_lag_s + DT_S)
    rotor = v["rotor"] + share * (v["motor"] - v["rotor"])
    curve = airframe.thrust_curve
    thrust = airframe.thrust_max_n * (curve * rotor**2 + (1.0 - curve) * rotor)
    attitude = Rotation.from_quat(v["attitude"], scalar_first=True)
    lift = attitude.apply([0.0, 0.0, -thrust.sum()])
    force = lift - airframe.drag_n_s_m * (v["velocity_m_s"] - wind)
    velocity = v["velocity_m_s"] + DT_S * (force / airframe.mass_kg + np.array([0.0, 0.0, GRAVITY_M_S2]))
    position = v["position_m"] + DT_S * 0.5 * (v["velocity_m_s"] + velocity)
    signs = np.array([[-1, 1, 1, -1], [1, -1, 1, -1]]) * airframe.arm_m
    yaw_torque = np.array([1, 1, -1, -1]) @ thrust * airframe.torque_max_n_m / airframe.thrust_max_n
    torque = np.array([*(signs @ thrust), yaw_torque])
    w, inertia = v["rates_rad_s"], np.array(airframe.inertia_kg_m2)
    moment = torque - airframe.rotational_drag_n_m_s * w - np.cross(w, inertia * w)
    rates = w + DT_S * moment / inertia
    turned = attitude * Rotation.from_rotvec(rates * DT_S)
    return {
        "rotor": rotor,
        "velocity_m_s": velocity,
        "position_m": position,
        "rates_rad_s": rates,
        "attitude": turned.as_quat(scalar_first=True, canonical=True),
        "specific_force_m_s2": attitude.inv().apply(force / airframe.mass_kg),
    }


@pytest.mark.parametrize("airframe", [X500_LIKE, SIH])
def test_the_compiled_step_equals_the_numpy_model(airframe):
    rng = np.random.default_rng(2)
    for attitude in Rotation.random(30, random_state=4).as_quat(scalar_first=True, canonical=True):
        state = {
            "position_m": rng.normal(size=3),
            "velocity_m_s": rng.normal(size=3) * 5.0,
            "attitude": attitude,
            "rates_rad_s": rng.normal(size=3),
            "rotor": rng.uniform(size=4),
            "motor": rng.uniform(size=4),
        }
        wind = rng.normal(size=3)
        fleet = body(**state)
        move(fleet[0], airframe.record[0], wind, DT_S)
        for name, expected in reference_step(state, airframe, wind).items():
            assert np.allclose(fleet[name][0], expected, atol=1e-12), name


def test_without_thrust_it_falls():
    fleet = body()
    for _ in range(250):
        move(fleet[0], X500_LIKE.record[0], CALM, DT_S)
    assert fleet["velocity_m_s"][0, 2] == pytest.approx(GRAVITY_M_S2, rel=0.03)
    assert fleet["position_m"][0, 2] == pytest.approx(0.5 * GRAVITY_M_S2, rel=0.03)


@pytest.mark.parametrize("airframe", [X500_LIKE, SIH])
def test_hover_thrust_carries_the_weight(airframe):
    signal = signal_for_thrust(airframe.hover_thrust, airframe.thrust_curve)
    fleet = body(motor=[signal] * 4, rotor=[signal] * 4)
    for _ in range(250):
        move(fleet[0], airframe.record[0], CALM, DT_S)
    assert np.allclose(fleet["velocity_m_s"][0], 0.0, atol=1e-9)


def test_wind_carries_a_falling_body_along():
    fleet = body()
    for _ in range(20_000):
        fleet["velocity_m_s"][0, 2] = 0.0
        move(fleet[0], SIH.record[0], np.array([3.0, -2.0, 0.0]), DT_S)
    assert np.allclose(fleet["velocity_m_s"][0, :2], [3.0, -2.0], atol=1e-3)


@pytest.mark.parametrize(
    ("motors", "axis", "sign"),
    [
        ([0.4, 0.6, 0.6, 0.4], 0, 1.0),  # the left rotors lift more: rolls to the right
        ([0.6, 0.4, 0.6, 0.4], 1, 1.0),  # the front rotors lift more: the nose goes up
        ([0.6, 0.6, 0.4, 0.4], 2, 1.0),  # the rotors that turn left, seen from above: the nose goes right
    ],
)
def test_rotors_turn_the_body_as_px4_numbers_them(motors, axis, sign):
    fleet = body(motor=motors, rotor=motors)
    move(fleet[0], X500_LIKE.record[0], CALM, DT_S)
    rates = fleet["rates_rad_s"][0]
    assert rates[axis] * sign > 0.0
    assert np.allclose(np.delete(rates, axis), 0.0, atol=1e-12)


def test_a_tumbling_body_keeps_a_unit_quaternion_and_bounded_rates():
    fleet = body(motor=[1.0, 0.0, 1.0, 0.0], rates_rad_s=[10.0, -9.0, 8.0])
    for _ in range(5000):
        move(fleet[0], X500_LIKE.record[0], CALM, DT_S)
    assert np.linalg.norm(fleet["attitude"][0]) == pytest.approx(1.0, abs=1e-12)
    assert np.abs(fleet["rates_rad_s"]).max() <= 18.85
    assert all(np.isfinite(fleet[name]).all() for name in ("position_m", "velocity_m_s"))


def test_signals_and_thrusts_are_inverse_to_each_other():
    for curve in (0.0, 0.3, 1.0):
        for thrust in np.linspace(0.0, 1.0, 11):
            signal = signal_for_thrust(thrust, curve)
            assert curve * signal**2 + (1.0 - curve) * signal == pytest.approx(thrust)
            assert math.isfinite(signal)
