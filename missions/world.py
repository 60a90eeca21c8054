"""The world that is flown in: flight range, mountains, threats, obstacles, in the mission's ENU frame.

Everything may be marked `known: false`: the simulator then has it, and no planner is told.
"""

from typing import Annotated, Literal

import msgspec
import numpy as np

Positive = Annotated[float, msgspec.Meta(gt=0.0)]
NotNegative = Annotated[float, msgspec.Meta(ge=0.0)]
Name = Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z0-9][A-Za-z0-9 _.-]{0,39}$")]
Point2 = tuple[float, float]
Point3 = tuple[float, float, float]

BASE_HEIGHT_SHARE = 0.01
"""A peak's foot is the circle where it is this share of its height (design: slope = r / sqrt(ln 100))."""


class Bounds(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The flight range: an upright box that no vehicle may leave."""

    east_m: Point2
    north_m: Point2
    up_m: Point2

    def __post_init__(self) -> None:
        for name in ("east_m", "north_m", "up_m"):
            low, high = getattr(self, name)
            if not low < high:
                raise ValueError(f"expected {name} as [low, high] with low < high, found [{low:g}, {high:g}]")

    @property
    def low_enu_m(self) -> np.ndarray:
        """(3,) lowest corner, ENU [m]."""
        return np.array([self.east_m[0], self.north_m[0], self.up_m[0]])

    @property
    def high_enu_m(self) -> np.ndarray:
        """(3,) highest corner, ENU [m]."""
        return np.array([self.east_m[1], self.north_m[1], self.up_m[1]])

    def contains(self, point_enu_m: Point3) -> bool:
        return bool(np.all(self.low_enu_m <= point_enu_m) and np.all(point_enu_m <= self.high_enu_m))


class Peak(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A mountain as a Gaussian of the ground's height (eq. 23, its swapped indices put right).

    The paper gives centre and bottom radius only; the height is 2.5 times the radius unless it is named.
    """

    name: Name
    centre_m: Point2
    radius_m: Positive
    height_m: Positive | None = None
    known: bool = True

    @property
    def top_m(self) -> float:
        return 2.5 * self.radius_m if self.height_m is None else self.height_m

    @property
    def slope_m(self) -> float:
        """The Gaussian's x_s = y_s of eq. 23: 1 % of the height is left at the bottom radius."""
        return self.radius_m / float(np.sqrt(-np.log(BASE_HEIGHT_SHARE)))


class Threat(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A hemisphere on the ground that no vehicle may enter: jamming, detection (eq. 22). No sensor sees it."""

    name: Name
    centre_m: Point2
    radius_m: Positive
    known: bool = True


class Box(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A box with edges along the axes."""

    name: Name
    centre_m: Point3
    half_m: tuple[Positive, Positive, Positive]
    known: bool = True


class Cylinder(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An upright cylinder from `base_m` to `top_m`."""

    name: Name
    centre_m: Point2
    radius_m: Positive
    top_m: float
    base_m: float = 0.0
    known: bool = True

    def __post_init__(self) -> None:
        if not self.base_m < self.top_m:
            raise ValueError(f"expected base_m < top_m, found {self.base_m:g} and {self.top_m:g}")


class Mover(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A ball that shuttles between two points. Only the simulator and the sensors know of it."""

    name: Name
    from_m: Point3
    to_m: Point3
    radius_m: Positive
    speed_m_s: Positive
    known: Literal[False] = False

    def position(self, time_s: float) -> np.ndarray:
        """(3,) centre [m] at `time_s` of simulated time: there and back along a straight line."""
        start, end = np.array(self.from_m), np.array(self.to_m)
        length = float(np.linalg.norm(end - start))
        if length == 0.0:
            return start
        travelled = (time_s * self.speed_m_s) % (2.0 * length)
        share = travelled / length if travelled <= length else 2.0 - travelled / length
        return start + share * (end - start)


class World(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Everything that stands in the flight range."""

    bounds: Bounds
    peaks: tuple[Peak, ...] = ()
    threats: tuple[Threat, ...] = ()
    boxes: tuple[Box, ...] = ()
    cylinders: tuple[Cylinder, ...] = ()
    movers: tuple[Mover, ...] = ()

    def as_known(self) -> "World":
        """This world as the planners are told of it: without what is marked `known: false`."""
        return msgspec.structs.replace(
            self,
            peaks=tuple(peak for peak in self.peaks if peak.known),
            threats=tuple(threat for threat in self.threats if threat.known),
            boxes=tuple(box for box in self.boxes if box.known),
            cylinders=tuple(cylinder for cylinder in self.cylinders if cylinder.known),
            movers=(),
        )
