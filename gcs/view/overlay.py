"""What lies over one browser's picture: name tags, marks of what is out of the picture, compass, scale bar; pure HTML.

The server knows each browser's camera, so it says where everything stands, in pixels; the look is in `overlay.css`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
import numpy.typing as npt

from gcs.view.colours import Rgb, css
from gcs.view.labels import RINGS, Lens, place

Array = npt.NDArray[np.float64]

FEW = 14
"""Vehicles up to which every tag tells mode and battery; in larger fleets only those that want attention do."""
CHARACTER_PX, PADDING_PX, HEIGHT_PX = 6.9, 20.0, 20.0
SMALL_HEIGHT_PX = 17.0
EDGE_PX, MOST_ARROWS = 16.0, 24
SETTLE, SETTLE_MANY = 3, 12
"""Where tags stand is chosen anew once in so many times."""
RINGS_OF_MANY = 0
"""In a large fleet a tag without room near its vehicle is left out."""
CORNER_PX = (210.0, 128.0)
"""The upper right corner belongs to compass, scale bar and legend."""
BAR_PX = 120.0
"""The scale bar is at most this long."""
TARGET = "target"
UNITS = ((1e3, "km"), (1.0, "m"), (1e-2, "cm"))


@dataclass(frozen=True)
class Tag:
    """The name tag of a vehicle or a target.

    Args:
        key: stays the same while everything else changes.
        name: what is written in front.
        details: written behind, where there is room.
        colour: of what is named.
        span_px: how large that is in the picture.
        urgency: tags with more of it get the better places, and their details are always written.
        look: a CSS class.
    """

    key: str
    name: str
    details: str
    colour: Rgb
    span_px: float
    urgency: int = 0
    look: str = "vehicle"
    selected: bool = False


class Overlay:
    """One browser's overlay; it remembers where tags stood, so that they do not tremble."""

    def __init__(self) -> None:
        self._stood: dict[str, Array] = {}
        self._settled: tuple[list[int], list[str]] = ([], [])
        self._renders = 0

    def render(self, tags: Sequence[Tag], places_m: Array, lens: Lens) -> str:
        """The HTML for tags of what is at (n, 3) places."""
        pixels, seen = lens.project(places_m)
        parts = [self._tags(tags, pixels, seen, lens), _arrows(tags, places_m, seen, lens), _compass(lens), _bar(lens)]
        size = f"width:{lens.width_px}px;height:{lens.height_px}px"
        return f'<div class="gcs-overlay" style="{size}">{"".join(parts)}</div>'

    def _tags(self, tags: Sequence[Tag], pixels: Array, seen: npt.NDArray[np.bool_], lens: Lens) -> str:
        brief = sum(tag.look != TARGET for tag in tags) > FEW
        shown = sorted(np.flatnonzero(seen).tolist(), key=lambda index: -tags[index].urgency)
        details = ["" if brief and not tags[index].urgency else tags[index].details for index in shown]
        sizes = np.array([_size_px(tags[i], text) for i, text in zip(shown, details, strict=True)]).reshape(-1, 2)
        self._renders += 1
        keys = [tags[index].key for index in shown]
        if (shown, keys) != self._settled or self._renders % (SETTLE_MANY if brief else SETTLE) == 0:
            self._settled = (shown, keys)
            spans = np.array([tags[index].span_px for index in shown])
            self._settle(keys, pixels[shown], sizes, spans, lens, rings=RINGS_OF_MANY if brief else RINGS)
        offsets = [self._stood[key] for key in keys]
        told = [
            _tag(tags[index], text, pixels[index], offset, size)
            for index, text, offset, size in zip(shown, details, offsets, sizes, strict=True)
        ]
        stems = "".join(stem for stem, _ in told)
        return f"<svg>{stems}</svg>" + "".join(label for _, label in told)

    def _settle(
        self, keys: Sequence[str], pixels: Array, sizes: Array, spans: Array, lens: Lens, *, rings: int
    ) -> None:
        """Choose anew where each tag stands; in between they go along with what they name."""
        before = np.array([self._stood.get(key, np.full(2, np.nan)) for key in keys]).reshape(-1, 2)
        corner = (lens.width_px - CORNER_PX[0], 0.0, float(lens.width_px), CORNER_PX[1])
        picture = (lens.width_px, lens.height_px)
        offsets = place(pixels, sizes, spans, picture, before, rings=rings, kept_free_px=[corner])
        self._stood = dict(zip(keys, offsets, strict=True))


def _tag(tag: Tag, details: str, anchor: Array, offset: Array, size: Array) -> tuple[str, str]:
    """The stem and the tag; neither where there is no room, but a ring around what is selected in any case."""
    colour = css(tag.colour)
    ring = tag.span_px * 0.62
    mark = f'<circle cx="{anchor[0]:.0f}" cy="{anchor[1]:.0f}" r="{ring:.0f}"/>' if tag.selected else ""
    if math.isnan(offset[0]):
        return mark, ""
    x, y = anchor + offset
    far = abs(offset[1]) > (tag.span_px + size[1]) / 2 + 8.0
    edge = y - np.sign(offset[1]) * size[1] / 2
    stem = f'<line x1="{anchor[0]:.0f}" y1="{anchor[1]:.0f}" x2="{x:.0f}" y2="{edge:.0f}" stroke="{colour}"/>'
    told = f"<span>{escape(details)}</span>" if details else ""
    look = f"{tag.look} sel" if tag.selected else tag.look
    return mark + (stem if far else ""), (
        f'<div class="tag {look}" style="left:{x:.0f}px;top:{y:.0f}px;--own:{colour}">'
        f"<b>{escape(tag.name)}</b>{told}</div>"
    )


def _size_px(tag: Tag, details: str) -> tuple[float, float]:
    """About how large a tag will be."""
    height = HEIGHT_PX if tag.look != TARGET else SMALL_HEIGHT_PX
    characters = len(tag.name) + (len(details) + 1 if details else 0)
    return CHARACTER_PX * characters * height / HEIGHT_PX + PADDING_PX, height


def _arrows(tags: Sequence[Tag], places_m: Array, seen: npt.NDArray[np.bool_], lens: Lens) -> str:
    """At the picture's edge: where the vehicles are that are out of it."""
    hidden = [index for index, tag in enumerate(tags) if tag.look != TARGET and not seen[index]][:MOST_ARROWS]
    if not hidden:
        return ""
    right, up, _ = lens.axes
    towards_m = places_m[hidden] - lens.pose.look_at_m
    across, down = towards_m @ right, -(towards_m @ up)
    half = np.array([lens.width_px, lens.height_px]) / 2 - EDGE_PX
    reach = np.maximum(np.maximum(np.abs(across) / half[0], np.abs(down) / half[1]), 1e-9)
    marks = []
    for index, x, y, angle in zip(
        hidden, across / reach, down / reach, np.degrees(np.arctan2(down, across)), strict=True
    ):
        left, top = lens.width_px / 2 + x, lens.height_px / 2 + y
        place = f"left:{left:.0f}px;top:{top:.0f}px;color:{css(tags[index].colour)};--turn:{round(angle)}deg"
        marks.append(f'<i class="out" style="{place}" title="{escape(tags[index].name)}"></i>')
    return "".join(marks)


def _compass(lens: Lens) -> str:
    """North in the picture; the needle turns with the camera."""
    right, up, back = lens.axes
    forward = -back[:2] if abs(back[2]) < 0.99 else up[:2]
    angle = math.degrees(math.atan2(float(right[1]), float(forward[1])))
    return (
        f'<div class="compass" title="north"><svg viewBox="-20 -20 40 40"><circle r="18"/>'
        f'<g transform="rotate({angle:.0f})"><path d="M0-13 4 0H-4Z"/><path class="south" d="M0 13 4 0H-4Z"/></g>'
        "</svg></div>"
    )


def _bar(lens: Lens) -> str:
    """A scale bar; it holds at the distance of what the camera looks at."""
    metres = BAR_PX * float(lens.metres_per_pixel(lens.pose.look_at_m[None])[0])
    power = 10.0 ** math.floor(math.log10(metres))
    length_m = max(step * power for step in (1.0, 2.0, 5.0) if step * power <= metres)
    return f'<div class="scale" style="width:{BAR_PX * length_m / metres:.0f}px">{length_words(length_m)}</div>'


def length_words(length_m: float) -> str:
    """A length in the unit in which it is a small number."""
    for factor, unit in UNITS:
        if length_m >= factor:
            return f"{length_m / factor:g} {unit}"
    return f"{length_m * 1e3:g} mm"
