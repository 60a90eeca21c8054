"""Airframes as parameter sets: every value with its unit and its source."""

from dataclasses import dataclass
from enum import Enum

import numpy as np

from sitl.dynamics.state import record

GRAVITY_M_S2 = 9.80665

AIRFRAME = record(
    [
        ("mass_kg", "f8"),
        ("inertia_kg_m2", "f8", 3),
        ("arm_m", "f8"),
        ("thrust_max_n", "f8"),
        ("torque_max_n_m", "f8"),
        ("thrust_curve", "f8"),
        ("rotor_lag_s", "f8"),
        ("drag_n_s_m", "f8"),
        ("rotational_drag_n_m_s", "f8"),
    ]
)
"""An `Airframe` as compiled code reads it."""


@dataclass(frozen=True)
class Airframe:
    """A quadrotor in X configuration, rotors numbered as PX4 does: front right, back left, front left, back right."""

    mass_kg: float
    inertia_kg_m2: tuple[float, float, float]
    """Moments about the body's x, y, z axes."""
    arm_m: float
    """Lever of every rotor about the roll and the pitch axis."""
    thrust_max_n: float
    """Of one rotor."""
    torque_max_n_m: float
    """Reaction torque of one rotor at full thrust."""
    thrust_curve: float
    """Share of the square in thrust / thrust_max = curve * signal^2 + (1 - curve) * signal (PX4's THR_MDL_FAC)."""
    rotor_lag_s: float
    """Time constant with which a rotor's speed follows its signal."""
    drag_n_s_m: float
    """Linear drag against the air."""
    rotational_drag_n_m_s: float

    @property
    def hover_thrust(self) -> float:
        """Share of the rotors' full thrust that carries the weight."""
        return self.mass_kg * GRAVITY_M_S2 / (4.0 * self.thrust_max_n)

    @property
    def record(self) -> np.ndarray:
        """(1,) array of dtype `AIRFRAME`."""
        return np.array([tuple(getattr(self, name) for name in AIRFRAME.fields or ())], dtype=AIRFRAME)


X500_LIKE = Airframe(
    mass_kg=2.064,  # Gazebo model x500: base 2.0 kg and four rotors of 16 g
    inertia_kg_m2=(0.0217, 0.0217, 0.0400),  # Gazebo model x500, base link
    arm_m=0.174,  # Gazebo model x500, rotor positions
    thrust_max_n=8.55,  # motor constant 8.54858e-6 N s^2 at 1000 rad/s
    torque_max_n_m=0.137,  # moment constant 0.016 m times full thrust
    thrust_curve=1.0,  # thrust goes with the square of the rotor's speed
    rotor_lag_s=0.018,  # between the model's 12.5 ms (up) and 25 ms (down)
    drag_n_s_m=0.10,  # little: 0.15 m/s^2 at 3 m/s
    rotational_drag_n_m_s=0.01,
)

SIH = Airframe(  # PX4's simulation in hardware, airframe 10040: default values of the SIH_* parameters
    mass_kg=1.0,  # SIH_MASS
    inertia_kg_m2=(0.025, 0.025, 0.030),  # SIH_IXX, SIH_IYY, SIH_IZZ
    arm_m=0.2,  # SIH_L_ROLL, SIH_L_PITCH
    thrust_max_n=5.0,  # SIH_T_MAX
    torque_max_n_m=0.1,  # SIH_Q_MAX
    thrust_curve=0.0,
    rotor_lag_s=0.05,  # SIH_T_TAU
    drag_n_s_m=1.0,  # SIH_KDV
    rotational_drag_n_m_s=0.025,  # SIH_KDW
)


class AirframeName(Enum):
    """The airframes that `sitl --airframe` knows."""

    X500_LIKE = "x500-like"
    SIH = "sih"

    @property
    def airframe(self) -> Airframe:
        return X500_LIKE if self is AirframeName.X500_LIKE else SIH
