"""The compiled step of a fleet is its source, interpreted."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from sitl.dynamics.state import Crash
from tests.unit.sitl.mixed_fleet import end_state, flown_fleet


def test_the_compiled_fleet_flies_as_the_interpreted_one(tmp_path):
    path = tmp_path / "interpreted.npy"
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    command = [sys.executable, "-m", "tests.unit.sitl.mixed_fleet", str(path)]
    subprocess.run(command, check=True, env=environment, cwd=Path(__file__).parents[3], timeout=120)
    np.testing.assert_allclose(end_state(), np.load(path), rtol=1e-9, atol=1e-12)


def test_the_compared_flight_is_worth_comparing():
    v = flown_fleet().vehicles
    assert v["crash"].tolist()[:4] == [Crash.NONE] * 4
    assert v["crash"][4] == Crash.OBSTACLE
    assert np.linalg.norm(v["velocity_m_s"][[0, 2, 3]], axis=1).min() > 0.5
    assert v["grounded"][1] == 1
