"""Options that benchmarks have in common."""

import argparse

import pytest

from tests.benchmarks.command_line import machine, seed_range


def test_seeds_are_a_range_without_its_end():
    assert list(seed_range("3:6")) == [3, 4, 5]


@pytest.mark.parametrize("text", ["", "3", "3:", ":3", "3:3", "4:3", "-1:3", "a:b", "1:2:3", "1.0:2", "\u0663:9"])
def test_what_is_no_range_of_seeds_is_refused(text: str):
    with pytest.raises(argparse.ArgumentTypeError, match="expected A:B with A < B, found"):
        seed_range(text)


def test_the_machine_is_named_with_its_load():
    assert "cores, load average " in machine()
