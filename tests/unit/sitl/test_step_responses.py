"""Step responses stay within a quarter of a real PX4's."""

import pytest

from sitl.step_responses import figures


@pytest.mark.slow
def test_the_sih_airframe_responds_as_px4s_simulation_does():
    off = [figure for figure in figures() if not figure.holds]
    assert off == []
