"""`python -m sitl.step_responses`: fly the steps that a real PX4 was measured with, and print ours beside its figures.

The figures are those of PX4's simulation in hardware (SIH, quadrotor, main of February 2025), read off its estimates,
GNSS noise included; ours fly the same body without noise. Ends with code 1 if a figure is off by more than a quarter.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass

from sitl.dynamics.airframe import SIH, Airframe
from sitl.step_flights import brake, land, position_step, reposition, takeoff, velocity_step, yaw_step

TOLERANCE = 0.25


@dataclass(frozen=True)
class Figure:
    """One number of one test."""

    test: str
    name: str
    px4: float
    ours: float
    limit: str = "about"
    """`about`: within the tolerance; `most`: no more than PX4's, tolerance included."""

    @property
    def holds(self) -> bool:
        if self.limit == "most":
            return self.ours <= self.px4 * (1.0 + TOLERANCE)
        return abs(self.ours - self.px4) <= TOLERANCE * abs(self.px4)


MEASURED: tuple[tuple[str, Callable[[Airframe], dict[str, float]], dict[str, tuple[float, str]]], ...] = (
    (
        "takeoff to 20 m",
        takeoff,
        {
            "t 0.3 m": (4.1, "about"),
            "t 5 m": (8.6, "about"),
            "t 15 m": (14.2, "about"),
            "t 19.3 m": (19.0, "about"),
            "peak m/s": (2.9, "most"),
        },
    ),
    (
        "position 5 m",
        lambda a: position_step(a, 0, 5.0),
        {
            "t10 s": (0.6, "about"),
            "t63 s": (1.7, "about"),
            "t90 s": (2.6, "about"),
            "overshoot %": (8.0, "most"),
            "peak m/s": (2.6, "about"),
            "peak tilt deg": (41.0, "about"),
        },
    ),
    ("position 1 m", lambda a: position_step(a, 0, 1.0), {"t90 s": (3.1, "about")}),
    (
        "position 50 m",
        lambda a: position_step(a, 0, 50.0),
        {
            "t90 s": (6.0, "about"),
            "overshoot %": (4.0, "most"),
            "peak m/s": (9.7, "about"),
            "peak tilt deg": (48.0, "about"),
        },
    ),
    (
        "position 5 m up",
        lambda a: position_step(a, 2, -5.0),
        {"t90 s": (2.3, "about"), "overshoot %": (4.0, "most"), "peak m/s": (2.7, "about")},
    ),
    (
        "position 5 m down",
        lambda a: position_step(a, 2, 5.0),
        {"t90 s": (3.6, "about"), "overshoot %": (3.0, "most"), "peak m/s": (1.5, "about")},
    ),
    (
        "velocity 1 m/s",
        lambda a: velocity_step(a, 0, 1.0, 11.0),
        {"t63 s": (1.0, "about"), "value m/s": (0.9, "about"), "peak tilt deg": (11.0, "about")},
    ),
    (
        "velocity 3 m/s",
        lambda a: velocity_step(a, 0, 3.0, 11.0),
        {
            "t63 s": (1.0, "about"),
            "t90 s": (7.7, "about"),
            "value m/s": (2.6, "about"),
            "peak tilt deg": (28.0, "about"),
        },
    ),
    (
        "velocity 12 m/s",
        lambda a: velocity_step(a, 0, 12.0, 11.0),
        {"t63 s": (1.7, "about"), "value m/s": (9.9, "about"), "peak tilt deg": (48.0, "about")},
    ),
    (
        "velocity 2 m/s up",
        lambda a: velocity_step(a, 2, -2.0, 8.0),
        {"t63 s": (0.30, "about"), "t90 s": (0.78, "about"), "value m/s": (1.98, "about")},
    ),
    (
        "velocity 5 m/s down",
        lambda a: velocity_step(a, 2, 5.0, 6.0, reached_m_s=1.5),
        {"value m/s": (1.55, "about")},
    ),
    ("velocity 1 m/s down", lambda a: velocity_step(a, 2, 1.0, 6.0), {"t63 s": (0.43, "about")}),
    (
        "velocity 6 m/s up",
        lambda a: velocity_step(a, 2, -6.0, 8.0, reached_m_s=-3.0),
        {"value m/s": (2.87, "about")},
    ),
    (
        "brake from 3 m/s",
        lambda a: brake(a, 3.0),
        {"t63 s": (0.8, "about"), "distance m": (4.0, "about"), "peak tilt deg": (16.0, "about")},
    ),
    (
        "brake from 12 m/s",
        lambda a: brake(a, 12.0),
        {"t63 s": (0.9, "about"), "distance m": (14.5, "about"), "peak tilt deg": (45.0, "about")},
    ),
    (
        "yaw 90 deg",
        yaw_step,
        {"t90 s": (0.96, "about"), "overshoot %": (17.0, "most"), "peak deg/s": (141.0, "about")},
    ),
    (
        "Hold, 50 m away",
        reposition,
        {
            "t90 s": (12.4, "about"),
            "cruise m/s": (4.6, "about"),
            "overshoot %": (0.9, "most"),
            "peak tilt deg": (29.0, "about"),
        },
    ),
    (
        "land from 20 m",
        land,
        {
            "high m/s": (1.58, "about"),
            "7.5 m m/s": (1.0, "about"),
            "low m/s": (0.65, "about"),
            "disarmed s": (28.0, "about"),
        },
    ),
)
"""Test, how it is flown, PX4's figures and how they are judged."""


def figures(airframe: Airframe = SIH) -> list[Figure]:
    """Fly everything."""
    out: list[Figure] = []
    for test, flown, expected in MEASURED:
        ours = flown(airframe)
        out += [Figure(test, name, px4, ours[name], limit) for name, (px4, limit) in expected.items()]
    return out


def main() -> int:
    """Print the table; returns the exit code."""
    print(f"{'test':<20} {'figure':<14} {'PX4':>8} {'ours':>8}")
    table = figures()
    for figure in table:
        mark = "" if figure.holds else "  off"
        print(f"{figure.test:<20} {figure.name:<14} {figure.px4:>8.2f} {figure.ours:>8.2f}{mark}")
    return 0 if all(figure.holds for figure in table) else 1


if __name__ == "__main__":
    sys.exit(main())
