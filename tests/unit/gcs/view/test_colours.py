"""Colours of vehicles."""

import itertools

import numpy as np

from gcs.view.colours import PALETTE, THREAT, UNMAPPED, css, faded, vehicle_colour, vivid


def test_the_first_ten_vehicles_are_told_apart_from_each_other_and_from_warnings():
    named = [*PALETTE, THREAT, UNMAPPED]
    apart = [np.abs(np.subtract(one, other)).sum() for one, other in itertools.combinations(named, 2)]
    assert len(PALETTE) == 10
    assert min(apart) > 60


def test_a_hundred_vehicles_have_a_hundred_colours():
    fleet = [vehicle_colour(index) for index in range(100)]
    assert len(set(fleet)) == 100
    assert all(0 <= channel <= 255 for colour in fleet for channel in colour)


def test_colours_are_written_as_css_does():
    assert css((255, 10, 0)) == "#ff0a00"


def test_fading_goes_from_one_colour_to_the_other():
    assert faded((100, 0, 50), (0, 100, 50), 0.0) == (100, 0, 50)
    assert faded((100, 0, 50), (0, 100, 50), 1.0) == (0, 100, 50)
    assert faded((100, 0, 50), (0, 100, 50), 0.5) == (50, 50, 50)


def test_what_is_drawn_vividly_keeps_its_hue_and_is_darker():
    red, green, blue = vivid((77, 184, 255))
    assert blue > green > red
    assert red + green + blue < 77 + 184 + 255
