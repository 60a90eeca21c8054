"""Plots over time: height, speed, clearance and link quality of a few vehicles."""

import numpy as np
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
                self._plots[quantity] = self._gui.add_uplot(
                    data=self._desk.observations.histories.series(quantity, shown),
                    series=(uplot.Series(label="s"), *lines),
                    title=f"{quantity.title} [{quantity.unit}]",
                    scales={"x": uplot.Scale(time=False)},
                    axes=(_axis(), _axis()),
                    legend=uplot.Legend(show=False),
                    height=HEIGHT_PX,
                )


def _axis() -> uplot.Axis:
    return uplot.Axis(stroke=INK, grid={"stroke": LINE, "width": 1}, ticks={"stroke": LINE, "width": 1})
