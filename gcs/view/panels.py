"""The page's panels: what the operator reads and presses, and where it stands."""

import math
from collections.abc import Callable
from importlib.resources import files

import viser

from gcs.desk import Desk
from gcs.errors import UsageError
from gcs.view import alert_list, event_list, fleet_table, mission_card, order_list, plan_table, readiness_list
from gcs.view.choosing import choose
from gcs.view.colours import CAUTION, QUIET
from gcs.view.command_panel import CommandPanel
from gcs.view.link_panel import LinkPanel
from gcs.view.plots_panel import PlotsPanel
from gcs.view.presses import Presses, visitor_key
from gcs.view.sightings import Sightings, vehicle_colours, vehicle_names
from gcs.view.vehicle_scene import MANY
from missions.mission import Mission

PANEL_PX, FLEET_PX, EDGE_PX = 330, 1000, 14
SEVERAL = "Several ..."
LOOKED_UP_INTERVAL_S = 1.0
"""What stands behind other tabs takes a while for a large fleet."""

Press = Callable[[viser.GuiEvent[viser.GuiButtonHandle]], None]


class Panels:
    """Buttons, selector, alerts, and the tabs of fleet, links, plots, plans, events, orders and readiness.

    Args:
        server: of the page.
        desk: what is shown and commanded.
        on_go_to: called in a thread of viser when a place for the selected vehicles is to be pointed at.
        views: name and action of each camera button, called in a thread of viser.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        desk: Desk,
        on_go_to: Callable[[viser.ClientHandle], None],
        views: dict[str, tuple[viser.IconName, Press]],
    ) -> None:
        self._desk, self._gui = desk, server.gui
        self.presses = Presses(desk, lambda: self.selected)
        self._commands = CommandPanel(server.gui, desk, self.presses, on_go_to)
        self._choices: dict[str, list[int]] = {"All (0)": []}
        self._looked_up_s = self._table_s = -math.inf
        self._table_picked: set[int] = set()
        server.gui.main_panel.dock_left()
        server.gui.main_panel.set_width(PANEL_PX)
        self._style()
        self._add_head()
        self._add_commands()
        self._add_views(views)
        self._add_log()
        self._add_fleet()

    @property
    def selected(self) -> set[int]:
        """System ids of the vehicles that the operator's orders concern."""
        if self._selector.value == SEVERAL:
            return self._several()
        return set(self._choices.get(self._selector.value, []))

    @property
    def picked_out(self) -> set[int]:
        """The selected vehicles, if they are not all."""
        return set() if self._selector.value == next(iter(self._choices)) else self.selected

    def pick(self, sysid: int, joins: bool) -> None:
        """Address orders to a vehicle that was clicked, or to it beside those that were."""
        names = vehicle_names(self._desk)
        chosen = sorted((self.picked_out if joins else set[int]()) | {sysid})
        if len(chosen) > 1 and SEVERAL in self._choices:
            self._names.value, self._selector.value = ", ".join(names[one] for one in chosen), SEVERAL
        elif len(names) > 1:
            self._selector.value = next(name for name, own in self._choices.items() if own == [sysid])

    @property
    def go_to_height_m(self) -> float:
        """Above the ground of the place that vehicles are sent to."""
        return self._commands.height_m.value

    def suit(self, mission: Mission) -> None:
        """Suit another mission."""
        self._commands.suit(mission)

    @property
    def parts(self) -> tuple[Callable[[Sightings, float], None], ...]:
        """What brings each part up to date; viser sends only what has changed."""
        return (self._show_commands, self._show_log, self._show_table, self._look_up)

    def _show_commands(self, _: Sightings, now_s: float) -> None:
        """Head, alerts and buttons."""
        desk = self._desk
        self._offer_vehicles()
        self._head.content = mission_card.render_head(desk, now_s)
        self._alerts.content = alert_list.render(desk.observations.alerts)
        self._take_command.visible = len(desk.seat.present) > 1 or desk.seat.holder is None
        self._reasons.content = mission_card.render_reasons(self._commands.update(sorted(self.selected)))

    def _show_log(self, _: Sightings, now_s: float) -> None:
        """Plots, events and orders."""
        desk = self._desk
        self._plots.update(sorted(self.picked_out), now_s)
        names = vehicle_names(desk)
        by_name = {names[sysid]: colour for sysid, colour in vehicle_colours(names).items()}
        self._events.content = event_list.render(desk.events.events, by_name)
        self._orders.content = order_list.render(desk.orders.orders)

    def _show_table(self, seen: Sightings, now_s: float) -> None:
        """The fleet table: a large one once a second, but at once when others are selected."""
        picked_out, aged_s = self.picked_out, abs(now_s - self._table_s)
        if len(seen) > MANY and picked_out == self._table_picked and aged_s < LOOKED_UP_INTERVAL_S:
            return
        self._table_s, self._table_picked = now_s, picked_out
        self._fleet.content = fleet_table.render(fleet_table.rows(self._desk, seen, picked_out, now_s))

    def _look_up(self, seen: Sightings, now_s: float) -> None:
        """What is behind other tabs, a large fleet's half as often."""
        desk = self._desk
        if abs(now_s - self._looked_up_s) < LOOKED_UP_INTERVAL_S * (2 if len(seen) > MANY else 1):
            return
        self._looked_up_s = now_s
        self._links.update(now_s)
        self._readiness.content = readiness_list.render(desk, now_s)
        if desk.flight is not None:
            self._plans.content = plan_table.render(desk.flight.candidates, desk.flight.plan)

    def _several(self) -> set[int]:
        try:
            return set(choose(self._names.value, vehicle_names(self._desk)))
        except UsageError:
            return set()

    def _offer_vehicles(self) -> None:
        names = vehicle_names(self._desk)
        choices = {f"All ({len(names)})": list(names)} | {name: [sysid] for sysid, name in names.items()}
        if len(names) > 2:
            choices[SEVERAL] = []
        self._names.visible = self._selector.value == SEVERAL
        if choices == self._choices:
            return
        all_before = self._selector.value == next(iter(self._choices))
        self._choices = choices
        self._selector.options = tuple(choices)
        if all_before:
            self._selector.value = next(iter(choices))

    def _add_head(self) -> None:
        self._gui.add_html('<span class="gcs-top"></span>')
        self._head = self._gui.add_html("")
        self._alerts = self._gui.add_html("")
        self._take_command = self._gui.add_button(
            "Take command", icon=viser.Icon.STEERING_WHEEL, color=CAUTION, visible=False
        )

        def take(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            client = event.client
            if client is not None:
                self.presses.do(lambda: self._desk.seat.take(visitor_key(client)))

        self._take_command.on_click(take)

    def _add_commands(self) -> None:
        if self._desk.flight is not None:
            with self._gui.add_folder("Mission"):
                self._commands.add_flight()
        with self._gui.add_folder("Vehicles"):
            self._gui.add_html('<span class="gcs-columns-3"></span><span class="gcs-command"></span>')
            self._selector = self._gui.add_dropdown("Orders to", tuple(self._choices))
            self._names = self._gui.add_text(
                "Vehicles", "", visible=False, hint="names, system ids, ranges: alpha, 3, 5-9"
            )
            self._commands.add_vehicles()
        self._reasons = self._gui.add_html("")

    def _add_views(self, views: dict[str, tuple[viser.IconName, Press]]) -> None:
        with self._gui.add_folder("View"):
            self._gui.add_html('<span class="gcs-columns-3"></span>')
            for name, (icon, act) in views.items():
                self._gui.add_button(name, icon=icon, color=QUIET).on_click(act)

    def _add_log(self) -> None:
        panel = self._gui.add_panel()
        with panel.add_tab("Events", viser.Icon.LIST):
            self._style()
            self._events = self._gui.add_html("")
        with panel.add_tab("Orders", viser.Icon.CHECKLIST):
            self._orders = self._gui.add_html("")
        with panel.add_tab("Ready", viser.Icon.CLIPBOARD_CHECK):
            self._readiness = self._gui.add_html("")
        panel.dock_below(self._gui.main_panel)

    def _add_fleet(self) -> None:
        panel = self._gui.add_panel()
        with panel.add_tab("Fleet", viser.Icon.DRONE):
            self._style()
            self._fleet = self._gui.add_html("")
        with panel.add_tab("Links", viser.Icon.ANTENNA_BARS_5):
            self._links = LinkPanel(self._gui, self._desk, self.presses)
        plots = panel.add_tab("Plots", viser.Icon.CHART_LINE)
        self._plots = PlotsPanel(self._gui, plots, self._desk)
        if self._desk.flight is not None:
            with panel.add_tab("Plans", viser.Icon.ROUTE):
                self._plans = self._gui.add_html("")
        panel.float(x=EDGE_PX, y=-EDGE_PX, width=FLEET_PX)

    def _style(self) -> None:
        """The style sheet: it has to be in every panel, since a minimised panel's content is not on the page."""
        self._gui.add_html(f"<style>{files('gcs.view').joinpath('page.css').read_text()}</style>")
