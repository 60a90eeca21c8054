"""`python -m sitl.step_responses`: fly the steps that a real PX4 was measured with, and print ours beside its figures.

The figures are those of PX4's simulation in hardware (SIH, quadrotor, main of February 2025), read off its estimates,
GNSS noise included, in one to six flights each; ours fly the same body, and without noise where they do not hover. Ends
with code 1 if a figure is off by more than a quarter.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto

from sitl.dynamics.airframe import SIH, Airframe
from sitl.step_flights import brake, hover, land, position_step, reposition, takeoff, velocity_step, yaw_step

TOLERANCE = 0.25


class Judged(Enum):
    """How a figure is held against PX4's."""

    ABOUT = auto()
    """Within a quarter of what PX4 did in one of its flights, or between two of them."""
    MOST = auto()
    """No more than in PX4's best flight, by as much as its figure is rounded."""


@dataclass(frozen=True)
class Px4:
    """What a real PX4 did: the lowest and the highest figure of its flights."""

    lowest: float
    highest: float
    judged: Judged = Judged.ABOUT
    rounding: float = 0.0


@dataclass(frozen=True)
class Figure:
    """One number of one test."""

    test: str
    name: str
    px4: Px4
    ours: float

    @property
    def holds(self) -> bool:
        if self.px4.judged is Judged.MOST:
            return self.ours <= self.px4.lowest + self.px4.rounding
        return self.px4.lowest * (1.0 - TOLERANCE) <= self.ours <= self.px4.highest * (1.0 + TOLERANCE)

    @property
    def reference(self) -> str:
        """PX4's figures, as the table shows them."""
        low, high = self.px4.lowest, self.px4.highest
        return f"{low:.2f}" if low == high else f"{low:.2f} .. {high:.2f}"


def about(lowest: float, highest: float | None = None) -> Px4:
    return Px4(lowest, lowest if highest is None else highest)


def most(lowest: float, highest: float | None = None, *, rounding: float = 0.5) -> Px4:
    return Px4(lowest, lowest if highest is None else highest, Judged.MOST, rounding)


Test = tuple[str, Callable[[Airframe], dict[str, float]], dict[str, Px4]]

MEASURED: tuple[Test, ...] = (
    (
        "takeoff to 20 m",
        takeoff,
        {
            "t 0.3 m": about(3.2, 5.0),
            "t 5 m": about(8.6),
            "t 15 m": about(14.2),
            "t 19.3 m": about(18.0, 20.0),
            "peak m/s": about(2.9),
        },
    ),
    (
        "hover in Hold",
        lambda a: hover(a, offboard=False),
        {
            "across m": about(0.19, 0.23),
            "height m": about(0.10, 0.18),
            "across m/s": about(0.19, 0.22),
            "climb m/s": about(0.21, 0.23),
            "peak tilt deg": about(5.4),
        },
    ),
    (
        "hover in Offboard",
        lambda a: hover(a, offboard=True),
        {"across m": about(0.21, 0.30), "height m": about(0.08, 0.17)},
    ),
    (
        "position 5 m",
        lambda a: position_step(a, 0, 5.0),
        {
            "t10 s": about(0.5, 0.7),
            "t63 s": about(1.7, 1.72),
            "t90 s": about(2.46, 2.64),
            "overshoot %": most(7.0, 9.0),
            "peak m/s": about(2.6),
            "peak tilt deg": about(41.0),
        },
    ),
    ("position 1 m", lambda a: position_step(a, 0, 1.0), {"t90 s": about(2.4, 3.1)}),
    (
        "position 50 m",
        lambda a: position_step(a, 0, 50.0),
        {
            "t90 s": about(6.0),
            "overshoot %": most(4.0),
            "peak m/s": about(9.7),
            "peak tilt deg": about(48.0),
        },
    ),
    (
        "position 5 m up",
        lambda a: position_step(a, 2, -5.0),
        {"t90 s": about(2.3, 2.4), "overshoot %": most(4.0), "peak m/s": about(2.7)},
    ),
    (
        "position 5 m down",
        lambda a: position_step(a, 2, 5.0),
        {"t90 s": about(3.56, 3.8), "overshoot %": most(3.0), "peak m/s": about(1.5)},
    ),
    (
        "velocity 1 m/s",
        lambda a: velocity_step(a, 0, 1.0, 11.0),
        {
            "t63 s": about(0.88, 1.58),
            "t90 s": about(5.0, 7.9),
            "value m/s": about(0.9, 1.0),
            "overshoot %": most(0.0),
            "peak tilt deg": about(11.0),
        },
    ),
    (
        "velocity 3 m/s",
        lambda a: velocity_step(a, 0, 3.0, 11.0),
        {
            "t63 s": about(0.94, 1.06),
            "t90 s": about(6.54, 9.98),
            "value m/s": about(2.6, 2.85),
            "overshoot %": most(0.0),
            "peak tilt deg": about(28.0),
        },
    ),
    (
        "velocity 12 m/s",
        lambda a: velocity_step(a, 0, 12.0, 11.0),
        {
            "t63 s": about(1.7),
            "value m/s": about(9.9),
            "overshoot %": most(0.0),
            "peak tilt deg": about(48.0),
        },
    ),
    ("velocity 20 m/s", lambda a: velocity_step(a, 0, 20.0, 11.0), {"value m/s": about(10.0)}),
    (
        "velocity 2 m/s up",
        lambda a: velocity_step(a, 2, -2.0, 8.0),
        {"t63 s": about(0.30, 0.42), "t90 s": about(0.62, 0.88), "value m/s": about(1.98)},
    ),
    (
        "velocity 5 m/s down",
        lambda a: velocity_step(a, 2, 5.0, 6.0, reached_m_s=1.5),
        {"value m/s": about(1.55)},
    ),
    ("velocity 1 m/s down", lambda a: velocity_step(a, 2, 1.0, 6.0), {"t63 s": about(0.28, 0.54)}),
    (
        "velocity 6 m/s up",
        lambda a: velocity_step(a, 2, -6.0, 8.0, reached_m_s=-3.0),
        {"value m/s": about(2.87)},
    ),
    (
        "brake from 3 m/s",
        lambda a: brake(a, 3.0),
        {
            "t63 s": about(0.8, 0.94),
            "t90 s": about(5.0, 7.43),
            "distance m": about(3.0, 6.07),
            "peak tilt deg": about(16.0),
        },
    ),
    (
        "brake from 12 m/s",
        lambda a: brake(a, 12.0),
        {"t63 s": about(0.9), "t90 s": about(5.0), "distance m": about(14.5), "peak tilt deg": about(45.0)},
    ),
    (
        "yaw 90 deg",
        yaw_step,
        {"t90 s": about(0.96), "overshoot %": most(17.0), "peak deg/s": about(141.0)},
    ),
    (
        "Hold, 50 m away",
        reposition,
        {
            "t90 s": about(12.17, 12.9),
            "cruise m/s": about(4.25, 4.6),
            "overshoot %": most(0.9, 3.5, rounding=0.05),
            "peak tilt deg": about(29.0),
        },
    ),
    (
        "land from 20 m",
        land,
        {
            "high m/s": about(1.58),
            "7.5 m m/s": about(1.0),
            "low m/s": about(0.65),
            "disarmed s": about(28.0),
        },
    ),
)
"""Test, how it is flown, PX4's figures and how they are judged."""


def figures(airframe: Airframe = SIH) -> list[Figure]:
    """Fly everything."""
    out: list[Figure] = []
    for test, flown, expected in MEASURED:
        ours = flown(airframe)
        out += [Figure(test, name, px4, ours[name]) for name, px4 in expected.items()]
    return out


def main() -> int:
    """Print the table; returns the exit code."""
    print(f"{'test':<20} {'figure':<14} {'PX4':>14} {'ours':>8}")
    table = figures()
    for figure in table:
        mark = "" if figure.holds else "  off"
        print(f"{figure.test:<20} {figure.name:<14} {figure.reference:>14} {figure.ours:>8.2f}{mark}")
    return 0 if all(figure.holds for figure in table) else 1


if __name__ == "__main__":
    sys.exit(main())
