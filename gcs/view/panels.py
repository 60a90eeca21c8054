"""The page's panels: what the operator reads and presses. Presses become intents on the event loop's thread."""

from collections.abc import Callable
from importlib.resources import files

import viser

from gcs.desk import Desk, Intent
from gcs.view import event_list, fleet_table, mission_card
from gcs.view.colours import BRAND, CAUTION, QUIET, Rgb
from gcs.view.sightings import Sighting, vehicle_colours, vehicle_names

PANEL_PX, FLEET_PX, EDGE_PX = 330, 860, 14

Press = Callable[[viser.GuiEvent], None]

LOOKS: dict[Intent, tuple[viser.IconName, Rgb]] = {
    Intent.PLAN: (viser.Icon.ROUTE, BRAND),
    Intent.UPLOAD: (viser.Icon.UPLOAD, BRAND),
    Intent.FLY: (viser.Icon.PLANE_DEPARTURE, (30, 150, 92)),
    Intent.HOLD: (viser.Icon.PLAYER_PAUSE, CAUTION),
    Intent.RESUME: (viser.Icon.PLAYER_PLAY, (30, 150, 92)),
    Intent.RTL: (viser.Icon.HOME_MOVE, QUIET),
    Intent.LAND: (viser.Icon.PLANE_ARRIVAL, QUIET),
}


class Panels:
    """Buttons, selector, progress, fleet table and event log.

    Args:
        server: of the page.
        desk: what is shown and commanded.
        on_press: called with an intent, in a thread of viser.
        views: name and action of each camera button, called in a thread of viser.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        desk: Desk,
        on_press: Callable[[Intent], None],
        views: dict[str, tuple[viser.IconName, Press]],
    ) -> None:
        self._desk, self._on_press = desk, on_press
        self._gui = gui = server.gui
        self._buttons: dict[Intent, viser.GuiButtonHandle] = {}
        self._choices: dict[str, list[int]] = {"All (0)": []}
        gui.main_panel.dock_left()
        gui.main_panel.set_width(PANEL_PX)
        self._style()
        self._head = gui.add_html("")
        if desk.flight is not None:
            self._add_flight()
        self._add_vehicles()
        self._add_views(views)
        self._events = self._add_events()
        self._fleet = self._add_fleet()

    @property
    def selected(self) -> set[int]:
        """System ids of the vehicles that the operator's orders concern."""
        return set(self._choices.get(self._selector.value, []))

    @property
    def picked_out(self) -> set[int]:
        """The selected vehicle, if it is one and not all."""
        return set() if self._selector.value == next(iter(self._choices)) else self.selected

    def pick(self, sysid: int, joins: bool) -> None:
        """Address orders to a vehicle that was clicked."""
        for name, chosen in self._choices.items():
            if chosen == [sysid] and len(self._choices) > 2:
                self._selector.value = name

    def update(self, seen: list[Sighting], now_s: float) -> None:
        """Bring everything up to date; viser sends only what has changed."""
        desk = self._desk
        self._offer_vehicles()
        self._head.content = mission_card.render_head(desk)
        refused = [(intent.value, why) for intent in self._buttons if (why := self._allow(intent)) is not None]
        self._reasons.content = mission_card.render_reasons(refused)
        if desk.flight is not None:
            self._show_plan(desk)
        self._fleet.content = fleet_table.render(fleet_table.rows(desk, seen, self.picked_out, now_s))
        names = vehicle_names(desk)
        by_name = {names[sysid]: colour for sysid, colour in vehicle_colours(names).items()}
        self._events.content = event_list.render(desk.events.events, by_name)

    def _allow(self, intent: Intent) -> str | None:
        why = self._desk.why_not(intent, sorted(self.selected))
        self._buttons[intent].disabled = why is not None
        return why

    def _show_plan(self, desk: Desk) -> None:
        assert desk.flight is not None
        planning = mission_card.planning(desk)
        self._progress.visible = planning
        if planning:
            self._progress.value = round(100.0 * min(desk.plan_progress[-1].share_done, 1.0))
        plan = None if planning else desk.flight.plan
        self._plan.content = mission_card.render_plan(plan, desk.plan_progress)

    def _offer_vehicles(self) -> None:
        names = vehicle_names(self._desk)
        choices = {f"All ({len(names)})": list(names)} | {name: [sysid] for sysid, name in names.items()}
        if choices == self._choices:
            return
        all_before = self._selector.value == next(iter(self._choices))
        self._choices = choices
        self._selector.options = tuple(choices)
        if all_before:
            self._selector.value = next(iter(choices))

    def _add_flight(self) -> None:
        with self._gui.add_folder("Mission"):
            self._columns(3)
            for intent in (Intent.PLAN, Intent.UPLOAD, Intent.FLY):
                self._add_button(intent)
            self._plan = self._gui.add_html("")
            self._progress = self._gui.add_progress_bar(0.0, animated=True, visible=False, color=BRAND)

    def _add_vehicles(self) -> None:
        with self._gui.add_folder("Vehicles"):
            self._columns(2)
            self._selector = self._gui.add_dropdown("Orders to", tuple(self._choices))
            for intent in (Intent.HOLD, Intent.RESUME, Intent.RTL, Intent.LAND):
                if intent is not Intent.RESUME or self._desk.flight is not None:
                    self._add_button(intent)
        self._reasons = self._gui.add_html("")

    def _add_views(self, views: dict[str, tuple[viser.IconName, Press]]) -> None:
        with self._gui.add_folder("View"):
            self._columns(3)
            for name, (icon, act) in views.items():
                self._gui.add_button(name, icon=icon, color=QUIET).on_click(act)

    def _add_events(self) -> viser.GuiHtmlHandle:
        panel = self._gui.add_panel()
        with panel.add_tab("Events", viser.Icon.LIST):
            self._style()
            events = self._gui.add_html("")
        panel.dock_below(self._gui.main_panel)
        return events

    def _add_fleet(self) -> viser.GuiHtmlHandle:
        panel = self._gui.add_panel()
        with panel.add_tab("Fleet", viser.Icon.DRONE):
            self._style()
            table = self._gui.add_html("")
        panel.float(x=EDGE_PX, y=-EDGE_PX, width=FLEET_PX)
        return table

    def _add_button(self, intent: Intent) -> None:
        icon, colour = LOOKS[intent]
        button = self._gui.add_button(intent.value, icon=icon, color=colour, disabled=True)
        button.on_click(lambda _: self._on_press(intent))
        self._buttons[intent] = button

    def _style(self) -> None:
        """The style sheet: it has to be in every panel, since a minimised panel's content is not on the page."""
        self._gui.add_html(f"<style>{files('gcs.view').joinpath('page.css').read_text()}</style>")

    def _columns(self, count: int) -> None:
        """Mark the container that is being filled: the style sheet lays its buttons out in columns."""
        self._gui.add_html(f'<span class="gcs-columns-{count}"></span>')
