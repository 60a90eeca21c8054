"""The cascade's compiled laws equal their formulas in numpy, and do what a pilot expects of them."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sitl.autopilot.parameter_table import parameter_table
from sitl.control.attitude_control import attitude_control, mix
from sitl.control.gains import GAINS
from sitl.control.land_detection import detect_landing
from sitl.control.position_control import is_flyable, position_control
from sitl.dynamics.airframe import GRAVITY_M_S2, SIH
from sitl.dynamics.state import Guidance, TakeoffStage, new_fleet

DT_S = 0.004
NAN = math.nan


def default_gains() -> np.ndarray:
    gains = np.zeros(1, dtype=GAINS)
    for parameter in parameter_table(SIH):
        if parameter.name in GAINS.names:
            gains[parameter.name] = parameter.default
    return gains


def flying(**state) -> np.ndarray:
    """A vehicle that flies, with settled filters."""
    fleet = new_fleet(1)
    for flag in ("landed", "maybe_landed", "ground_contact", "grounded"):
        fleet[flag] = 0
    fleet["takeoff_stage"], fleet["guidance"] = TakeoffStage.FLIGHT, Guidance.SETPOINT
    fleet["tilt_limit_rad"] = math.radians(45.0)
    for name in ("setpoint_position_m", "setpoint_velocity_m_s", "setpoint_acceleration_m_s2"):
        fleet[name] = NAN
    fleet["setpoint_yaw_rad"] = fleet["setpoint_yawspeed_rad_s"] = NAN
    for name, value in state.items():
        fleet[name][0] = value
    fleet["velocity_before_m_s"] = fleet["velocity_m_s"]
    return fleet


def reference_thrust(v: np.void, g: np.void) -> np.ndarray:
    """(3,) PX4's thrust vector from position, velocity and acceleration setpoints, in the unsaturated case."""
    xyz = ("XY", "XY", "Z")
    p_gain = np.array([g[f"MPC_{axis}_P"] for axis in xyz])
    v_gain = np.array([g[f"MPC_{axis}_VEL_P_ACC"] for axis in xyz])
    correction = p_gain * (v["setpoint_position_m"] - v["position_m"])
    both = np.stack((correction, v["setpoint_velocity_m_s"]))
    wanted = np.where(np.isnan(both).all(axis=0), np.nan, np.nansum(both, axis=0))
    pid = v_gain * (wanted - v["velocity_m_s"]) + v["velocity_integral_m_s2"]
    acceleration = np.nansum(np.stack((v["setpoint_acceleration_m_s2"], pid)), axis=0)
    axis = np.array([-acceleration[0], -acceleration[1], GRAVITY_M_S2])
    axis /= np.linalg.norm(axis)
    collective = (acceleration[2] / GRAVITY_M_S2 - 1.0) * g["MPC_THR_HOVER"] / axis[2]
    return axis * collective


@pytest.mark.parametrize(
    "setpoint",
    [
        {"setpoint_position_m": [1.0, -0.5, -0.3]},
        {"setpoint_velocity_m_s": [0.5, 0.2, 0.3]},
        {"setpoint_acceleration_m_s2": [0.5, -1.0, 0.4]},
        {"setpoint_position_m": [1.0, 1.0, NAN], "setpoint_velocity_m_s": [NAN, NAN, 0.4]},
        {
            "setpoint_position_m": [0.2, 0.1, -0.1],
            "setpoint_velocity_m_s": [1.0, 0.5, -0.2],
            "setpoint_acceleration_m_s2": [0.3, 0.2, 0.1],
        },
    ],
)
def test_thrust_and_attitude_follow_px4s_formulas(setpoint):
    fleet, gains = (
        flying(velocity_m_s=[0.3, -0.2, 0.1], velocity_integral_m_s2=[0.1, 0.2, -0.3], **setpoint),
        default_gains(),
    )
    expected = reference_thrust(fleet[0].copy(), gains[0])
    position_control(fleet[0], gains[0], False, DT_S)
    thrust = fleet["setpoint_thrust"][0]
    attitude = Rotation.from_quat(fleet["setpoint_attitude"][0], scalar_first=True)
    assert thrust == pytest.approx(np.linalg.norm(expected), abs=1e-9)
    assert np.allclose(attitude.apply([0.0, 0.0, -thrust]), expected, atol=1e-9)


def test_the_heading_is_the_ordered_one():
    fleet, gains = flying(setpoint_position_m=[0.0, 0.0, 0.0], setpoint_yaw_rad=1.2), default_gains()
    position_control(fleet[0], gains[0], False, DT_S)
    attitude = Rotation.from_quat(fleet["setpoint_attitude"][0], scalar_first=True)
    assert attitude.as_euler("ZYX")[0] == pytest.approx(1.2)


def test_position_errors_go_before_feed_forward_when_both_are_too_fast():
    gains = default_gains()
    far = flying(setpoint_position_m=[10.0, 0.0, 0.0], setpoint_velocity_m_s=[0.0, 30.0, 0.0])
    position_control(far[0], gains[0], False, DT_S)
    north, east, _ = far["commanded_velocity_m_s"][0]
    assert north == pytest.approx(9.5)  # MPC_XY_P of the way
    assert math.hypot(north, east) == pytest.approx(gains["MPC_XY_VEL_MAX"][0])


def test_tilt_and_thrust_stay_within_their_limits():
    gains = default_gains()
    fleet = flying(setpoint_velocity_m_s=[100.0, 0.0, -100.0])
    position_control(fleet[0], gains[0], False, DT_S)
    attitude = Rotation.from_quat(fleet["setpoint_attitude"][0], scalar_first=True)
    tilt_deg = math.degrees(math.acos(attitude.as_matrix()[2, 2]))
    assert tilt_deg <= 45.0 + 1e-6
    assert gains["MPC_THR_MIN"][0] <= fleet["setpoint_thrust"][0] <= 1.0 + 1e-9


def test_up_goes_before_sideways_but_for_a_margin():
    gains = default_gains()
    fleet = flying(setpoint_velocity_m_s=[100.0, 0.0, -100.0])
    position_control(fleet[0], gains[0], False, DT_S)
    attitude = Rotation.from_quat(fleet["setpoint_attitude"][0], scalar_first=True)
    north, _, up = attitude.apply([0.0, 0.0, -fleet["setpoint_thrust"][0]])
    assert abs(north) == pytest.approx(gains["MPC_THR_XY_MARG"][0], abs=1e-6)
    assert -up == pytest.approx(math.sqrt(1.0 - 0.3**2), abs=1e-6)


def test_the_vertical_integral_does_not_wind_up_at_full_thrust():
    gains = default_gains()
    fleet = flying(setpoint_velocity_m_s=[0.0, 0.0, -3.0])
    fleet["velocity_integral_m_s2"][0, 2] = -9.0
    position_control(fleet[0], gains[0], False, DT_S)
    assert fleet["velocity_integral_m_s2"][0, 2] == pytest.approx(-9.0)


def test_the_horizontal_integral_unwinds_while_the_tilt_is_at_its_limit():
    gains = default_gains()
    fleet = flying(setpoint_velocity_m_s=[12.0, 0.0, 0.0])
    for _ in range(2500):  # held in place for ten seconds
        position_control(fleet[0], gains[0], False, DT_S)
    assert abs(fleet["velocity_integral_m_s2"][0, 0]) < 12.0  # without it: 48


@pytest.mark.parametrize(
    ("thrust", "sink_m_s", "ordered_m_s", "contact"),
    [
        (0.2, 0.0, 0.7, True),
        (0.48, 0.0, 0.7, False),  # something carries it: the rotors
        (0.2, 0.6, 0.7, False),  # it does sink
        (0.2, 0.0, 0.0, False),  # nobody wants it down
    ],
)
def test_the_ground_is_where_an_ordered_descent_stops_without_thrust(thrust, sink_m_s, ordered_m_s, contact):
    gains = default_gains()
    fleet = flying(setpoint_velocity_m_s=[0.0, 0.0, ordered_m_s], velocity_m_s=[0.0, 0.0, sink_m_s])
    fleet["setpoint_thrust"] = thrust
    for _ in range(100):
        detect_landing(fleet[0], gains[0], DT_S)
    assert bool(fleet["ground_contact"][0]) == contact


@pytest.mark.parametrize(
    ("setpoint", "flyable"),
    [
        ({"setpoint_position_m": [0.0, 0.0, 0.0]}, True),
        ({"setpoint_position_m": [0.0, NAN, 0.0]}, False),  # one horizontal axis alone
        ({"setpoint_position_m": [NAN, NAN, 0.0]}, False),  # nothing across
        ({"setpoint_position_m": [0.0, 0.0, NAN]}, False),  # nothing up and down
        ({"setpoint_position_m": [0.0, 0.0, NAN], "setpoint_velocity_m_s": [NAN, NAN, 1.0]}, True),
        ({"setpoint_velocity_m_s": [0.0, 0.0, NAN], "setpoint_position_m": [NAN, NAN, 1.0]}, True),
    ],
)
def test_setpoints_that_leave_an_axis_alone_are_replaced_by_a_stop(setpoint, flyable):
    fleet, gains = flying(**setpoint), default_gains()
    assert is_flyable(fleet[0]) == flyable
    position_control(fleet[0], gains[0], False, DT_S)
    if not flyable:
        assert fleet["commanded_velocity_m_s"][0].tolist() == [0.0, 0.0, 0.0]


def reference_rates(q: Rotation, wanted: Rotation, g: np.void) -> np.ndarray:
    """(3,) Brescianini's reduced-attitude law, written with scipy's rotations."""
    z, z_wanted = q.apply([0, 0, 1]), wanted.apply([0, 0, 1])
    axis, angle = np.cross(z, z_wanted), math.acos(np.clip(z @ z_wanted, -1.0, 1.0))
    length = np.linalg.norm(axis)
    reduced = (Rotation.from_rotvec(axis / length * angle) if length > 1e-12 else Rotation.identity()) * q
    yaw = (reduced.inv() * wanted).as_rotvec()[2]
    full = reduced * Rotation.from_rotvec([0.0, 0.0, yaw * g["MC_YAW_WEIGHT"]])
    error = (q.inv() * full).as_quat(scalar_first=True, canonical=True)[1:]
    gains = np.array([g["MC_ROLL_P"], g["MC_PITCH_P"], g["MC_YAW_P"] / g["MC_YAW_WEIGHT"]])
    limits = np.radians([g["MC_ROLLRATE_MAX"], g["MC_PITCHRATE_MAX"], g["MC_YAWRATE_MAX"]])
    return np.clip(2.0 * error * gains, -limits, limits)


def test_body_rates_follow_the_reduced_attitude_law():
    gains = default_gains()
    for q, offset in zip(Rotation.random(40, random_state=1), Rotation.random(40, random_state=2), strict=True):
        wanted = q * Rotation.from_rotvec(offset.as_rotvec() * 0.4)
        fleet = flying(
            estimated_attitude=q.as_quat(scalar_first=True, canonical=True),
            setpoint_attitude=wanted.as_quat(scalar_first=True, canonical=True),
        )
        attitude_control(fleet[0], gains[0])
        assert np.allclose(fleet["setpoint_rates_rad_s"][0], reference_rates(q, wanted, gains[0]), atol=1e-9)


def mixed(roll: float, pitch: float, yaw: float, thrust: float) -> tuple[np.ndarray, np.ndarray]:
    """Motor thrusts, and the torques and thrust that they make up."""
    fleet = new_fleet(1)
    mix(fleet[0], roll, pitch, yaw, thrust)
    m = fleet["motor"][0]
    half = math.sqrt(0.5) * 0.5
    made = np.array(
        [
            half * (-m[0] + m[1] + m[2] - m[3]),
            half * (m[0] - m[1] + m[2] - m[3]),
            (m[0] + m[1] - m[2] - m[3]) / 4,
            m.mean(),
        ]
    )
    return m, made


@pytest.mark.parametrize("wanted", [(0.1, 0.0, 0.0, 0.5), (0.05, -0.1, 0.05, 0.4), (-0.02, 0.03, -0.1, 0.7)])
def test_the_mixer_gives_what_is_wanted_where_it_can(wanted):
    _, made = mixed(*wanted)
    assert np.allclose(made, wanted, atol=1e-12)


def test_motors_never_leave_their_range():
    rng = np.random.default_rng(3)
    for _ in range(500):
        motors, _ = mixed(*rng.uniform(-2.0, 2.0, size=3), rng.uniform(-0.5, 1.5))
        assert motors.min() >= 0.0
        assert motors.max() <= 1.0


def test_at_full_thrust_roll_is_kept_and_thrust_given_up():
    _, made = mixed(0.2, 0.0, 0.0, 1.0)
    assert made[0] == pytest.approx(0.2)
    assert made[3] == pytest.approx(1.0 - 0.2 * math.sqrt(0.5))


def test_at_no_thrust_roll_is_given_up_and_nothing_lifts():
    _, made = mixed(0.2, 0.0, 0.0, 0.0)
    assert made[0] == pytest.approx(0.0, abs=1e-9)
    assert made[3] == pytest.approx(0.0, abs=1e-9)


def test_yaw_yields_to_roll_and_pitch():
    _, made = mixed(0.3, 0.3, 1.0, 0.5)
    assert np.allclose(made[:2], 0.3, atol=1e-6)
    assert 0.0 < made[2] < 0.5
