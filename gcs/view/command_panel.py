"""The buttons: load, plan, and command vehicles. What cannot be done now is disabled, and says why."""

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import viser

from gcs.desk import Desk, Details, Intent
from gcs.desk.intents import NewMission
from gcs.settings import PlanningMode
from gcs.view import mission_card
from gcs.view.colours import BRAND, CAUTION, QUIET, Rgb
from gcs.view.confirmation import HoldToConfirm
from gcs.view.presses import Presses, tell
from missions.errors import MissionError
from missions.mission import Mission, load_mission, shipped_missions

GO: Rgb = (30, 150, 92)
DANGER: Rgb = (170, 40, 44)
HOLD_HZ = 10.0

LOOKS: dict[Intent, tuple[viser.IconName, Rgb]] = {
    Intent.WAIT: (viser.Icon.HAND_STOP, CAUTION),
    Intent.LOAD: (viser.Icon.FOLDER_OPEN, QUIET),
    Intent.PLAN: (viser.Icon.ROUTE, BRAND),
    Intent.COMPARE: (viser.Icon.SCALE, QUIET),
    Intent.CANCEL: (viser.Icon.X, QUIET),
    Intent.UPLOAD: (viser.Icon.UPLOAD, BRAND),
    Intent.FLY: (viser.Icon.PLANE_DEPARTURE, GO),
    Intent.ARM: (viser.Icon.POWER, CAUTION),
    Intent.TAKE_OFF: (viser.Icon.ARROW_BAR_TO_UP, GO),
    Intent.START: (viser.Icon.FLAG, GO),
    Intent.HOLD: (viser.Icon.PLAYER_PAUSE, CAUTION),
    Intent.RESUME: (viser.Icon.PLAYER_PLAY, GO),
    Intent.RTL: (viser.Icon.HOME_MOVE, QUIET),
    Intent.LAND: (viser.Icon.PLANE_ARRIVAL, QUIET),
    Intent.GO_TO: (viser.Icon.CURRENT_LOCATION, BRAND),
    Intent.REPLAN: (viser.Icon.REFRESH, QUIET),
    Intent.SPEED: (viser.Icon.GAUGE, QUIET),
    Intent.KILL: (viser.Icon.SKULL, DANGER),
}


class CommandPanel:
    """Everything that commands.

    Args:
        gui: of the page.
        desk: what is shown and commanded.
        presses: hands intents over.
        on_go_to: called in a thread of viser when a place for vehicles is to be pointed at.
    """

    def __init__(
        self,
        gui: viser.GuiApi,
        desk: Desk,
        presses: Presses,
        on_go_to: Callable[[viser.ClientHandle], None],
    ) -> None:
        self._gui, self._desk, self._presses = gui, desk, presses
        self._on_go_to = on_go_to
        self._buttons: dict[Intent, viser.GuiButtonHandle] = {}
        self._kill = HoldToConfirm()

    def suit(self, mission: Mission) -> None:
        """Offer the heights and speeds of another mission."""
        self.height_m.value, self._speed.value = mission.takeoff_height_m, mission.limits.cruise_speed_m_s

    def update(self, selected: list[int]) -> list[tuple[str, str]]:
        """Bring buttons up to date; (button, reason) of all that cannot be pressed."""
        refused: list[tuple[str, str]] = []
        for intent, button in self._buttons.items():
            why_not = self._desk.why_not(intent, selected)
            if button.disabled is not (why_not is not None):  # finding that a button stays as it is takes viser longer
                button.disabled = why_not is not None
            if why_not is not None and intent not in {Intent.WAIT, Intent.CANCEL}:
                refused.append((intent.value, why_not))
        if self._desk.flight is not None:
            self._show_planning(self._desk)
        return refused

    def add_flight(self) -> None:
        """Fill the container with what concerns the whole flight."""
        gui, desk = self._gui, self._desk
        self._mark("gcs-columns-3", "gcs-command")
        if desk.opener is not None:
            names = tuple(shipped_missions())
            self._missions = gui.add_dropdown("Mission", names, initial_value=self._mission_name(names))
            self._add(Intent.LOAD, lambda event: self._load(event.client))
            self._file = gui.add_upload_button("File", icon=viser.Icon.FILE_UPLOAD, mime_type=".yaml,.yml", color=QUIET)
            self._file.on_upload(self._load_file)
            modes = tuple(mode.value for mode in PlanningMode)
            assert desk.flight is not None
            self._mode = gui.add_dropdown("Planned by", modes, initial_value=desk.flight.mode.value)
            self._mode.on_update(self._choose_mode)
        if desk.planner is not None:
            self._algorithm = gui.add_dropdown(
                "Algorithm", desk.planner.algorithms, initial_value=desk.planner.algorithm
            )
            self._algorithm.on_update(self._choose_algorithm)
        for intent in (Intent.PLAN, Intent.COMPARE, Intent.CANCEL):
            if intent is not Intent.COMPARE or desk.planner is not None:
                self._add(intent)
        self._plan = gui.add_html("")
        self._progress = gui.add_progress_bar(0.0, animated=True, visible=False, color=BRAND)
        for intent in (Intent.UPLOAD, Intent.FLY, Intent.WAIT):
            self._add(intent)

    def add_vehicles(self) -> None:
        """Fill the container with what is ordered of vehicles; the selector stands above."""
        desk = self._desk
        planned = (Intent.ARM, Intent.TAKE_OFF, Intent.START, Intent.HOLD, Intent.RESUME, Intent.RTL, Intent.LAND)
        watched = (Intent.HOLD, Intent.RTL, Intent.LAND)
        for intent in planned if desk.flight is not None else watched:
            self._add(intent)
        self._add(Intent.GO_TO, lambda event: self._on_go_to(event.client) if event.client else None)
        if desk.flight is not None:
            self._add(Intent.REPLAN)
        self.height_m = self._gui.add_number(
            "Go to at", 5.0, min=0.5, max=1000.0, step=0.5, hint="height above the ground [m] of the place"
        )
        self._speed = self._gui.add_number(
            "Speed", 3.0, min=0.1, max=30.0, step=0.1, hint="of the autopilot's own flight [m/s]"
        )
        self._add(Intent.SPEED, lambda event: self._ask(Intent.SPEED, event, Details(speed_m_s=self._speed.value)))
        self._add_kill()

    def _add_kill(self) -> None:
        icon, colour = LOOKS[Intent.KILL]
        self._mark("gcs-kill")
        button = self._gui.add_button("Kill: hold 1.5 s", icon=icon, color=colour, disabled=True)

        def held(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            client = event.client
            self._presses.do(lambda: self._hold_kill(client))

        button.on_hold(held, callback_hz=HOLD_HZ)  # pyright: ignore[reportUnknownMemberType] - viser's coroutines
        self._buttons[Intent.KILL] = button

    def _hold_kill(self, client: viser.ClientHandle | None) -> None:
        if self._kill.held(self._desk.station.now_s):
            self._presses.ask(Intent.KILL, client)

    def _add(self, intent: Intent, act: Callable[[viser.GuiEvent[viser.GuiButtonHandle]], None] | None = None) -> None:
        icon, colour = LOOKS[intent]
        button = self._gui.add_button(intent.value, icon=icon, color=colour, disabled=True)
        button.on_click(act or (lambda event: self._ask(intent, event, Details())))
        self._buttons[intent] = button

    def _ask(self, intent: Intent, event: viser.GuiEvent[viser.GuiButtonHandle], details: Details) -> None:
        self._presses.ask(intent, event.client, details)

    def _mark(self, *classes: str) -> None:
        """Mark the container that is being filled: the style sheet lays out what is in it."""
        self._gui.add_html("".join(f'<span class="{name}"></span>' for name in classes))

    def _mission_name(self, names: tuple[str, ...]) -> str:
        name = self._desk.mission.name if self._desk.mission is not None else ""
        return name if name in names else names[0]

    def _load(self, client: viser.ClientHandle | None) -> None:
        name = self._missions.value
        self._presses.ask(Intent.LOAD, client, Details(new=NewMission(load_mission(name), name)))

    def _load_file(self, event: viser.GuiEvent[viser.GuiUploadButtonHandle]) -> None:
        uploaded, name = self._file.value, f"{Path(self._file.value.name).stem or 'mission'}.yaml"
        with TemporaryDirectory() as folder:
            path = Path(folder) / name
            try:
                path.write_bytes(uploaded.content)
                mission = load_mission(path)
            except (MissionError, OSError) as problem:
                if event.client is not None:
                    tell(event.client, f"{name} was not loaded", str(problem).replace(f"{path}", name))
                return
        self._presses.ask(Intent.LOAD, event.client, Details(new=NewMission(mission, name, uploaded.content)))

    async def _choose_mode(self, event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
        """Ask for the mode that was chosen; the page's own updates of the dropdown have no client.

        As a coroutine it is called at once. One of viser's other threads may be late: `_correct` would have been there.
        """
        assert self._desk.flight is not None
        mode = PlanningMode(self._mode.value)
        if event.client is not None and mode is not self._desk.flight.mode:
            self._presses.ask(Intent.MODE, event.client, Details(mode=mode))

    async def _choose_algorithm(self, event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
        """See `_choose_mode`."""
        assert self._desk.planner is not None
        algorithm = self._algorithm.value
        if event.client is not None and algorithm != self._desk.planner.algorithm:
            self._presses.ask(Intent.ALGORITHM, event.client, Details(algorithm=algorithm))

    def _show_planning(self, desk: Desk) -> None:
        assert desk.flight is not None
        planning = mission_card.planning(desk)
        self._progress.visible = planning
        if planning:
            self._progress.value = round(100.0 * min(desk.plan_progress[-1].share_done, 1.0))
        self._plan.content = mission_card.render_plan(None if planning else desk.flight.plan, desk.plan_progress)
        self._buttons[Intent.WAIT].visible = desk.begins_s is not None
        if desk.opener is not None:
            locked = desk.why_not(Intent.MODE) is not None
            self._mode.disabled = locked
            self._missions.disabled = self._file.disabled = desk.why_not(Intent.LOAD) is not None
            self._correct(desk)

    def _correct(self, desk: Desk) -> None:
        """Dropdowns show what is, once nothing is under way: also when a choice was refused."""
        assert desk.flight is not None
        if desk.running is None and self._mode.value != desk.flight.mode.value:
            self._mode.value = desk.flight.mode.value
        if desk.planner is not None:
            self._algorithm.disabled = desk.why_not(Intent.ALGORITHM) is not None
            if desk.running is None and self._algorithm.value != desk.planner.algorithm:
                self._algorithm.value = desk.planner.algorithm
