"""The page's colours: one per vehicle, and what the things of the world look like on a dark ground."""

import colorsys
from enum import Enum
from functools import cache

Rgb = tuple[int, int, int]

PALETTE: tuple[Rgb, ...] = (
    (77, 184, 255),
    (255, 200, 87),
    (94, 224, 150),
    (238, 130, 205),
    (160, 148, 255),
    (64, 214, 208),
    (214, 226, 92),
    (255, 160, 122),
    (84, 126, 240),
    (226, 188, 160),
)
"""Colours of the first vehicles: bright on dark, and neither the red of threats nor the orange of unmapped things."""

THREAT: Rgb = (255, 70, 70)
UNMAPPED: Rgb = (255, 150, 40)
TARGET: Rgb = (230, 236, 245)

BRAND: Rgb = (45, 125, 235)
CAUTION: Rgb = (196, 132, 30)
QUIET: Rgb = (64, 76, 94)

GOLDEN_RATIO = 0.618033988749895


class Tone(Enum):
    """What a word on the page says about the state that it names; the value is its CSS class."""

    QUIET = "quiet"
    INFO = "info"
    GOOD = "good"
    WARN = "warn"
    BAD = "bad"


@cache
def vehicle_colour(index: int) -> Rgb:
    """The colour of the vehicle at this place of the fleet's order; beyond the palette, evenly spread hues."""
    if index < len(PALETTE):
        return PALETTE[index]
    hue = (index * GOLDEN_RATIO) % 1.0
    red, green, blue = colorsys.hls_to_rgb(hue, 0.7, 0.75)
    return round(red * 255), round(green * 255), round(blue * 255)


@cache
def css(colour: Rgb) -> str:
    """The colour as CSS writes it."""
    return "#{:02x}{:02x}{:02x}".format(*colour)


def faded(colour: Rgb, towards: Rgb, share: float) -> Rgb:
    """A colour on its way to another one: `share` 0 is itself, 1 the other."""
    red, green, blue = (round(own + (other - own) * share) for own, other in zip(colour, towards, strict=True))
    return red, green, blue


@cache
def vivid(colour: Rgb) -> Rgb:
    """The colour that has to be drawn in the scene to look like `colour`: its renderer bleaches what is bright."""
    hue, lightness, saturation = colorsys.rgb_to_hls(*(channel / 255 for channel in colour))
    red, green, blue = colorsys.hls_to_rgb(hue, lightness * 0.76, min(1.0, saturation * 1.15))
    return round(red * 255), round(green * 255), round(blue * 255)
