"""Plots over time: height, speed, clearance and link quality of a few vehicles."""

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import viser
from viser import uplot

from gcs.desk import Desk
from gcs.desk.histories import Quantity
from gcs.view.colours import css
from gcs.view.sightings import vehicle_colours, vehicle_names

MOST_VEHICLES = 6
INTERVAL_S = 2.0
HEIGHT_PX = 150
INK, LINE = "#8d9bb0", "#1e2838"
LEAST_SPAN = {Quantity.HEIGHT: 2.0, Quantity.SPEED: 1.0, Quantity.CLEARANCE: 2.0}
"""A range is at least so wide: what hardly changes shall look so."""
PER_CENT = (0.0, 105.0)
STEPS = 5
"""A range begins and ends at about so many steps of 1, 2 or 5, so that it seldom changes."""


class PlotsPanel:
    """The tab of plots.

    Args:
        gui: of the page.
        tab: the tab's container.
        desk: what is shown.
    """

    def __init__(self, gui: viser.GuiApi, tab: viser.GuiTabHandle, desk: Desk) -> None:
        self._gui, self._tab, self._desk = gui, tab, desk
        self._plots: dict[Quantity, viser.GuiUplotHandle] = {}
        self._drawn: list[int] | None = None
        self._next_s = -np.inf
        with tab:
            gui.add_html('<span class="gcs-columns-2"></span>')

    def update(self, picked_out: list[int], now_s: float) -> None:
        """Bring the plots up to date, if it is time to: of the vehicles that are picked out, or the first ones."""
        if now_s < self._next_s or len(self._desk.observations.histories.times_s) < 2:
            return
        self._next_s = now_s + INTERVAL_S
        shown = (picked_out or list(vehicle_names(self._desk)))[:MOST_VEHICLES]
        if not shown:
            return
        if shown != self._drawn:
            self._build(shown)
        for quantity, plot in self._plots.items():
            plot.data = self._desk.observations.histories.series(quantity, shown)
            plot.scales = _scales(quantity, plot.data[1:])

    def _build(self, shown: list[int]) -> None:
        for plot in self._plots.values():
            plot.remove()
        self._drawn, names = shown, vehicle_names(self._desk)
        colours = vehicle_colours(names)
        lines = tuple(
            uplot.Series(label=names[sysid], stroke=css(colours[sysid]), width=1.5, spanGaps=False) for sysid in shown
        )
        with self._tab:
            for quantity in Quantity:
                data = self._desk.observations.histories.series(quantity, shown)
                self._plots[quantity] = self._gui.add_uplot(
                    data=data,
                    series=(uplot.Series(label="s"), *lines),
                    title=f"{quantity.title} [{quantity.unit}]",
                    scales=_scales(quantity, data[1:]),
                    axes=(_axis(), _axis()),
                    legend=uplot.Legend(show=False),
                    height=HEIGHT_PX,
                )


def _axis() -> uplot.Axis:
    return uplot.Axis(stroke=INK, grid={"stroke": LINE, "width": 1}, ticks={"stroke": LINE, "width": 1})


def _scales(quantity: Quantity, lines: Sequence[npt.NDArray[np.float64]]) -> dict[str, uplot.Scale]:
    """The browser cannot find a range itself: one value that is missing, and it finds none."""
    bounds = PER_CENT if quantity is Quantity.LINK else value_range(np.concatenate(lines), LEAST_SPAN[quantity])
    return {"x": uplot.Scale(time=False), "y": uplot.Scale(range=bounds)}


def value_range(values: npt.NDArray[np.float64], least_span: float) -> tuple[float, float]:
    """Round bounds of (n,) values, some of which may be missing (NaN)."""
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 0.0)
    middle, half = (low + high) / 2, max(high - low, least_span) / 2
    power = 10.0 ** math.floor(math.log10(2 * half / STEPS))
    step = next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power * STEPS >= 2 * half)
    return step * math.floor((middle - half) / step), step * math.ceil((middle + half) / step)
