"""The ground link's benchmark finds what it is to find."""

import pytest

from tests.benchmarks.link.fleet import FleetFigures
from tests.benchmarks.link.matrix import Cell, Trial, trial


@pytest.mark.parametrize("loss", [0.0, 0.1, 0.3])
def test_a_hundred_items_meet_the_required_figures(loss: float):
    cell = Cell(100, loss, tuple(trial(100, loss, seed) for seed in range(5)))
    assert list(cell.missed()) == []


def test_a_trial_is_the_same_each_time():
    assert trial(10, 0.3, 4) == trial(10, 0.3, 4)


def test_misses_are_named():
    cell = Cell(100, 0.1, (Trial(False, 9.0, 20.0, 4.0, 9.0),))
    assert list(cell.missed()) == [
        "100 items at 10% loss: right in 0 of 1 trials",
        "100 items at 10% loss: 9.00 s, at most 3.90 s are allowed",
        "100 items at 10% loss: 4.00 item messages per item, at most 3",
    ]
    assert len(FleetFigures(100, 1.0, 1.5, 0.5, 30.0, 99).missed()) == 4
