"""Step responses stay within a quarter of a real PX4's, but for two that are known."""

import pytest

from sitl.step_responses import figures

KNOWN_OFF = {("Hold, 50 m away", "overshoot %"): (0.0, 2.375), ("velocity 1 m/s down", "t63 s"): (0.3, 0.54)}
"""1.0 m after 50 m where a PX4 has 0.45 m, and a tenth of a second; docs/simulator.md says so. They must not grow."""


@pytest.mark.slow
def test_the_sih_airframe_responds_as_px4s_simulation_does():
    off = {(figure.test, figure.name): figure.ours for figure in figures() if not figure.holds}
    assert set(off) == set(KNOWN_OFF)
    for figure, ours in off.items():
        assert KNOWN_OFF[figure][0] <= ours <= KNOWN_OFF[figure][1]
