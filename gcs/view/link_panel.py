"""How well the vehicles are heard, and in the simulator, link loss to rehearse with."""

from collections.abc import Callable

import viser

from gcs.desk import Desk, Details, Intent
from gcs.view import link_table
from gcs.view.colours import CAUTION, QUIET
from gcs.view.presses import Presses
from missions.faults import LinkFault, SimulatedLink

MOST_DELAY_S = 2.0


class LinkPanel:
    """The tab of links.

    Args:
        gui: of the page, with the tab's container open.
        desk: what is shown and commanded.
        presses: hands intents over.
    """

    def __init__(self, gui: viser.GuiApi, desk: Desk, presses: Presses) -> None:
        self._desk, self._presses = desk, presses
        self._table = gui.add_html("")
        if desk.simulator is not None:
            self._add_rehearsal(gui)

    def update(self, now_s: float) -> None:
        """Bring the table up to date."""
        self._table.content = link_table.render(self._desk, now_s)

    def _add_rehearsal(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Rehearse a bad link, of the vehicles that orders go to"):
            gui.add_html('<span class="gcs-columns-3"></span><span class="gcs-command"></span>')
            self._link = gui.add_dropdown("Link", tuple(link.value for link in SimulatedLink))
            self._loss = gui.add_slider("Loss %", 0, 100, 5, 30)
            self._delay = gui.add_slider("Delay ms", 0, int(MOST_DELAY_S * 1000), 50, 100)
            self._blackout = gui.add_number("Blackout s", 10.0, min=1.0, max=600.0, step=1.0)
            self._add(gui, "Make bad", viser.Icon.ANTENNA_BARS_2, self._bad)
            self._add(gui, "Black out", viser.Icon.ANTENNA_BARS_OFF, self._dark)
            self._add(gui, "Make whole", viser.Icon.ANTENNA_BARS_5, self._whole)

    def _add(self, gui: viser.GuiApi, name: str, icon: viser.IconName, fault: Callable[[], LinkFault]) -> None:
        colour = QUIET if fault == self._whole else CAUTION
        button = gui.add_button(name, icon=icon, color=colour)
        button.on_click(lambda event: self._presses.ask(Intent.LINK, event.client, Details(fault=fault())))

    def _bad(self) -> LinkFault:
        return LinkFault(link=self._chosen, loss=self._loss.value / 100.0, delay_s=self._delay.value / 1000.0)

    def _dark(self) -> LinkFault:
        return LinkFault(link=self._chosen, blackout_s=self._blackout.value)

    def _whole(self) -> LinkFault:
        return LinkFault(link=self._chosen)

    @property
    def _chosen(self) -> SimulatedLink:
        return SimulatedLink(self._link.value)
