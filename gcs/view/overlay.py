"""What lies over one browser's picture: name tags, marks of what is out of the picture, compass, scale bar; pure HTML.

The server knows each browser's camera, so it says where everything stands, in pixels of the picture. Those are not the
screen's own where a browser draws more or fewer of them: `overlay.css` knows how large they are there.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
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
NO_ROOM = np.full(2, np.nan)
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
        self._offsets = np.zeros((0, 2))
        self._settled: tuple[list[int], list[str]] = ([], [])
        self._renders = 0

    def render(self, tags: Sequence[Tag], places_m: Array, lens: Lens) -> str:
        """The HTML for tags of what is at (n, 3) places."""
        pixels, seen = lens.project(places_m)
        parts = [self._tags(tags, pixels, seen, lens), _arrows(tags, places_m, seen, lens), _compass(lens), _bar(lens)]
        size = f"--width:{lens.width_px};--height:{lens.height_px}"
        return f'<section class="gcs-overlay" style="{size}">{"".join(parts)}</section>'

    def _tags(self, tags: Sequence[Tag], pixels: Array, seen: npt.NDArray[np.bool_], lens: Lens) -> str:
        brief = sum(tag.look != TARGET for tag in tags) > FEW
        shown = sorted(np.flatnonzero(seen).tolist(), key=lambda index: -tags[index].urgency)
        details = ["" if brief and not tags[index].urgency else tags[index].details for index in shown]
        sizes = np.array([_size_px(tags[i], text) for i, text in zip(shown, details, strict=True)]).reshape(-1, 2)
        self._renders += 1
        keys = [tags[index].key for index in shown]
        due = self._renders % (SETTLE_MANY if brief else SETTLE) == 0
        if brief and not due and (shown, keys) != self._settled and self._stood:
            self._settled = (shown, keys)  # who has come into the picture of a large fleet gets a tag next time
            self._offsets = np.array([self._stood.get(key, NO_ROOM) for key in keys]).reshape(-1, 2)
        elif due or (shown, keys) != self._settled:
            self._settled = (shown, keys)
            spans = np.array([tags[index].span_px for index in shown])
            self._settle(keys, pixels[shown], sizes, spans, lens, rings=RINGS_OF_MANY if brief else RINGS)
        anchors = pixels[shown]
        stems = _stems([tags[index] for index in shown], anchors, self._offsets, sizes)
        labels: list[str] = []
        for index, text, (x, y) in zip(shown, details, (anchors + self._offsets).tolist(), strict=True):
            if x == x:  # not a number: there was no room
                tag = tags[index]
                before, after = _label(tag.name, text, tag.colour, tag.look, tag.selected)
                labels.append(f"{before}{x:.0f};--y:{y:.0f}{after}")
        box = f"0 0 {lens.width_px} {lens.height_px}"
        return f'<svg viewBox="{box}" preserveAspectRatio="none">{stems}</svg>{"".join(labels)}'

    def _settle(
        self, keys: Sequence[str], pixels: Array, sizes: Array, spans: Array, lens: Lens, *, rings: int
    ) -> None:
        """Choose anew where each tag stands; in between they go along with what they name."""
        before = np.array([self._stood.get(key, NO_ROOM) for key in keys]).reshape(-1, 2)
        corner = (lens.width_px - CORNER_PX[0], 0.0, float(lens.width_px), CORNER_PX[1])
        picture = (lens.width_px, lens.height_px)
        self._offsets = place(pixels, sizes, spans, picture, before, rings=rings, kept_free_px=[corner])
        self._stood = dict(zip(keys, self._offsets, strict=True))


@lru_cache(maxsize=4096)
def _label(name: str, details: str, colour: Rgb, look: str, selected: bool) -> tuple[str, str]:
    """A tag's HTML before and after the pixel where it stands, which alone changes all the time."""
    told = f"<span>{escape(details)}</span>" if details else ""
    look = f"{look} sel" if selected else look
    return f'<p class="tag {look}" style="--x:', f';--own:{css(colour)}"><b>{escape(name)}</b>{told}</p>'


def _stems(tags: Sequence[Tag], anchors: Array, offsets: Array, sizes: Array) -> str:
    """Stems of the tags that stand away from what they name, and rings around what is selected."""
    spans = np.array([tag.span_px for tag in tags])
    far = np.abs(offsets[:, 1]) > (spans + sizes[:, 1]) / 2 + 8.0
    marks: list[str] = []
    for index in np.flatnonzero(far | np.array([tag.selected for tag in tags], dtype=bool)).tolist():
        tag, (across, down) = tags[index], anchors[index].tolist()
        if tag.selected:
            marks.append(f'<circle cx="{across:.0f}" cy="{down:.0f}" r="{tag.span_px * 0.62:.0f}"/>')
        if far[index]:
            x, y = anchors[index] + offsets[index]
            edge = y - np.sign(offsets[index, 1]) * sizes[index, 1] / 2
            line = f'x1="{across:.0f}" y1="{down:.0f}" x2="{x:.0f}" y2="{edge:.0f}"'
            marks.append(f'<line {line} stroke="{css(tag.colour)}"/>')
    return "".join(marks)


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
    marks: list[str] = []
    for index, x, y, angle in zip(
        hidden, across / reach, down / reach, np.degrees(np.arctan2(down, across)), strict=True
    ):
        left, top = lens.width_px / 2 + x, lens.height_px / 2 + y
        place = f"--x:{left:.0f};--y:{top:.0f};color:{css(tags[index].colour)};--turn:{round(angle)}deg"
        marks.append(f'<i class="out" style="{place}" title="{escape(tags[index].name)}"></i>')
    return "".join(marks)


def _compass(lens: Lens) -> str:
    """North in the picture; the needle turns with the camera."""
    right, up, back = lens.axes
    forward = -back[:2] if abs(back[2]) < 0.99 else up[:2]
    angle = math.degrees(math.atan2(float(right[1]), float(forward[1])))
    return (
        f'<figure class="compass" title="north"><svg viewBox="-20 -20 40 40"><circle r="18"/>'
        f'<g transform="rotate({angle:.0f})"><path d="M0-13 4 0H-4Z"/><path class="south" d="M0 13 4 0H-4Z"/></g>'
        "</svg></figure>"
    )


def _bar(lens: Lens) -> str:
    """A scale bar; it holds at the distance of what the camera looks at."""
    metres = BAR_PX * float(lens.metres_per_pixel(lens.pose.look_at_m[None])[0])
    power = 10.0 ** math.floor(math.log10(metres))
    length_m = max(step * power for step in (1.0, 2.0, 5.0) if step * power <= metres)
    return f'<p class="scale" style="--long:{BAR_PX * length_m / metres:.0f}">{length_words(length_m)}</p>'


def length_words(length_m: float) -> str:
    """A length in the unit in which it is a small number."""
    for factor, unit in UNITS:
        if length_m >= factor:
            return f"{length_m / factor:g} {unit}"
    return f"{length_m * 1e3:g} mm"
