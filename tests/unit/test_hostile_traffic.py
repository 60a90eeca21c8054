"""A little of `make fuzz` in every run of the tests, always the same."""

import numpy as np
import pytest

from tests.fuzz.targets import TARGETS

ROUNDS = 15


@pytest.mark.parametrize("name", TARGETS)
@pytest.mark.parametrize("seed", range(2))
def test_hostile_traffic_gets_nothing_out_of_a_receive_path(name: str, seed: int):
    target = TARGETS[name](np.random.default_rng(seed))
    try:
        for _ in range(ROUNDS):
            target.feed()
        target.check()
    finally:
        target.close()
