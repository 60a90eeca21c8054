"""Every step response stays within a quarter of a real PX4's."""

import pytest

from sitl.dynamics.airframe import SIH
from sitl.step_flights import reposition
from sitl.step_responses import Figure, about, figures, most


@pytest.mark.slow
def test_the_sih_airframe_responds_as_px4s_simulation_does():
    assert [(figure.test, figure.name, figure.ours) for figure in figures() if not figure.holds] == []


def test_a_cruise_against_drag_does_not_carry_a_vehicle_past_its_target():
    assert reposition(SIH)["overshoot %"] < 0.95


@pytest.mark.parametrize(
    ("px4", "ours", "holds"),
    [
        (about(4.0), 5.0, True),
        (about(4.0), 5.1, False),
        (about(4.0), 2.9, False),
        (about(3.0, 5.0), 6.2, True),
        (about(3.0, 5.0), 2.2, False),
        (most(4.0), 0.0, True),
        (most(4.0), 4.4, True),
        (most(4.0), 4.6, False),
    ],
)
def test_figures_are_held_against_what_a_px4_did(px4, ours, holds):
    assert Figure("a test", "a figure", px4, ours).holds is holds
