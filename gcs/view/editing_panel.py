"""Editing a mission in the scene: a gizmo on what was picked, buttons for what is added, and saving as a file.

What is edited is a draft. Nobody flies it before it is loaded, or saved by the browser as a mission file and loaded
later.
"""

import asyncio
from collections.abc import Callable
from html import escape

import numpy as np
import viser

from gcs.view.colours import BRAND, QUIET, Rgb
from missions import editing
from missions.editing import Change, Draft, Kind, Part
from missions.errors import MissionError
from missions.mission import Mission
from missions.mission_file import to_yaml
from missions.world import Box, Cylinder, Threat

GIZMO_SHARE = 0.06
"""Size of the gizmo, of the flight range's diagonal."""
NEW_SHARE = 0.05
"""Size of a new body, likewise."""

ANYWHERE = (-1e5, 1e5)
NOTHING = "–"

LoadDraft = Callable[[Mission, viser.ClientHandle], None]
"""Asks for a draft to be loaded, in the name of a browser; called in a thread of viser."""
Show = Callable[[Mission, Callable[[Part], None] | None], None]
"""Draws a mission; with a function that is told what was clicked, in a thread of viser."""


class EditingPanel:
    """The folder of editing, and the gizmo. All but presses comes on the event loop's thread.

    Args:
        server: of the page.
        mission: as it was loaded.
        show: see `Show`.
        load: see `LoadDraft`.
    """

    def __init__(self, server: viser.ViserServer, mission: Mission, show: Show, load: LoadDraft) -> None:
        self._server, self._show, self._loaded, self._load = server, show, mission, load
        self._draft, self._loop = Draft(mission), asyncio.get_running_loop()
        self._size_m = float(np.linalg.norm(mission.world.bounds.high_enu_m - mission.world.bounds.low_enu_m))
        self._picked: Part | None = None
        self._gizmo: viser.TransformControlsHandle | None = None
        gui = server.gui
        with gui.add_folder("Edit mission", expand_by_default=False):
            self._on = gui.add_checkbox("Edit in the scene", False)
            self._choice = gui.add_dropdown("Part", options=tuple(_words(mission)), disabled=True)
            self._extent = gui.add_vector3("Size [m]", (1.0, 1.0, 1.0), step=0.1, visible=False)
            self._add_buttons()
            self._told = gui.add_html("")
        self._on.on_update(lambda event: self._on_loop(self._switch) if event.client is not None else None)
        self._choice.on_update(lambda event: self._on_loop(self._chosen) if event.client is not None else None)
        self._extent.on_update(lambda event: self._on_loop(self._resize) if event.client is not None else None)
        self._tell("")

    @property
    def draft(self) -> Mission:
        """The mission as it is now."""
        return self._draft.mission

    def take(self, mission: Mission) -> None:
        """Another mission has been loaded: the draft begins anew with it."""
        self._gizmo, self._picked, self._on.value = None, None, False
        self._loaded, self._draft = mission, Draft(mission)
        self._size_m = float(np.linalg.norm(mission.world.bounds.high_enu_m - mission.world.bounds.low_enu_m))
        self._offer()
        self._tell("")

    def pick(self, part: Part | None) -> None:
        """Put the gizmo on a part, or take it away."""
        self._picked = part
        if self._gizmo is not None:
            self._gizmo.remove()
            self._gizmo = None
        if part is not None:
            self._gizmo = self._server.scene.add_transform_controls(
                "/editing/gizmo",
                scale=GIZMO_SHARE * self._size_m,
                line_width=4.0,
                active_axes=(True, True, part.kind is not Kind.THREAT),
                disable_rotations=True,
                depth_test=False,
                translation_limits=(ANYWHERE, ANYWHERE, ANYWHERE),
                position=editing.place_m(self.draft, part),
            )
            self._gizmo.on_update(self._dragged)
        self._offer()

    def change(self, change: Change, picked: Part | None = None) -> None:
        """Make a change, or say why it cannot be made; then pick a part."""
        try:
            self._draft.apply(change)
        except MissionError as problem:
            self._tell(str(problem))
        else:
            self._tell("")
        self._redraw(picked if picked in editing.parts(self.draft) else None)

    def add(self, kind: Kind) -> None:
        """A new body in the middle of the flight range, picked."""
        bounds, half_m = self._loaded.world.bounds, NEW_SHARE * self._size_m / 2
        east, north, _ = ((bounds.low_enu_m + bounds.high_enu_m) / 2).tolist()
        up = min(2 * half_m, bounds.up_m[1])
        name = editing.free_name(self.draft.world, kind.value)
        things: dict[Kind, Box | Cylinder | Threat] = {
            Kind.BOX: Box(name=name, centre_m=(east, north, up / 2), half_m=(half_m, half_m, up / 2)),
            Kind.CYLINDER: Cylinder(name=name, centre_m=(east, north), radius_m=half_m, top_m=up),
            Kind.THREAT: Threat(name=name, centre_m=(east, north), radius_m=half_m),
        }
        self.change(editing.added(things[kind]), Part(kind, name))

    def _add_buttons(self) -> None:
        gui = self._server.gui
        gui.add_html('<span class="gcs-columns-3"></span>')
        for label, icon, kind in (
            ("Box", viser.Icon.CUBE_PLUS, Kind.BOX),
            ("Cylinder", viser.Icon.CYLINDER_PLUS, Kind.CYLINDER),
            ("No-fly", viser.Icon.BAN, Kind.THREAT),
        ):
            self._button(label, icon, QUIET, lambda kind=kind: self.add(kind))
        self._remove = self._button("Remove", viser.Icon.TRASH, QUIET, self._remove_picked)
        self._undo = self._button("Undo", viser.Icon.ARROW_BACK_UP, QUIET, lambda: self._step(self._draft.undo))
        self._redo = self._button("Redo", viser.Icon.ARROW_FORWARD_UP, QUIET, lambda: self._step(self._draft.redo))
        self._save = gui.add_button("Save", icon=viser.Icon.DEVICE_FLOPPY, color=BRAND, hint="as a mission file")
        self._save.on_click(self._download)
        loading = gui.add_button("Load draft", icon=viser.Icon.FOLDER_OPEN, color=BRAND, hint="to plan and fly it")
        loading.on_click(lambda event: self._load(self.draft, event.client) if event.client is not None else None)

    def _button(self, label: str, icon: viser.IconName, colour: Rgb, act: Callable[[], None]) -> viser.GuiButtonHandle:
        button = self._server.gui.add_button(label, icon=icon, color=colour)
        button.on_click(lambda _: self._on_loop(self._while_editing, act))
        return button

    def _on_loop(self, act: Callable[..., None], *arguments: object) -> None:
        self._loop.call_soon_threadsafe(act, *arguments)

    def _while_editing(self, act: Callable[[], None]) -> None:
        if not self._on.value:
            self._on.value = True
            self._switch()
        act()

    def _switch(self) -> None:
        """Editing begins or ends: the draft is shown while it lasts, and the mission as it was loaded afterwards."""
        if self._on.value:
            self._redraw(None)
        else:
            self.pick(None)
            self._show(self._loaded, None)

    def _redraw(self, picked: Part | None) -> None:
        self._show(self.draft, lambda part: self._on_loop(self.pick, part))
        self.pick(picked)

    def _offer(self) -> None:
        """Bring dropdown, size and buttons up to date."""
        self._choice.options = tuple(_words(self.draft))
        self._choice.value = _word(self._picked) if self._picked is not None else NOTHING
        self._choice.disabled = not self._on.value
        extent_m = editing.size_m(self.draft, self._picked) if self._picked is not None else None
        self._extent.visible = extent_m is not None
        if extent_m is not None:
            self._extent.value = extent_m
        self._remove.disabled = extent_m is None
        self._undo.disabled, self._redo.disabled = not self._draft.can_undo, not self._draft.can_redo

    def _chosen(self) -> None:
        by_word = {_word(part): part for part in editing.parts(self.draft)}
        self.pick(by_word.get(self._choice.value))

    def _dragged(self, event: viser.TransformControlsEvent) -> None:
        """Called in a thread of viser, at every move of the gizmo: what counts is where it is let go."""
        if event.phase == "end":
            self._on_loop(self._dropped, event.target.position.copy())

    def _dropped(self, place_m: np.ndarray) -> None:
        if self._picked is not None:
            east, north, up = place_m.tolist()
            self.change(editing.moved(self._picked, (east, north, up)), self._picked)

    def _resize(self) -> None:
        if self._picked is not None:
            self.change(editing.resized(self._picked, self._extent.value), self._picked)

    def _remove_picked(self) -> None:
        if self._picked is not None:
            self.change(editing.removed(self._picked))

    def _step(self, step: Callable[[], None]) -> None:
        step()
        self._tell("")
        self._redraw(self._picked if self._picked in editing.parts(self.draft) else None)

    def _download(self, event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
        mission = self.draft
        if event.client is not None:
            event.client.send_file_download(f"{mission.name}.yaml", to_yaml(mission).encode(), save_immediately=True)

    def _tell(self, problem: str) -> None:
        changed = "changed, not flown by anybody" if self.draft != self._loaded else "as it was loaded"
        refused = f'<p class="bad">{escape(problem)}</p>' if problem else ""
        self._told.content = f'<section class="gcs-editing">{refused}<p>The mission is {changed}.</p></section>'


def _words(mission: Mission) -> list[str]:
    return [NOTHING, *(_word(part) for part in editing.parts(mission))]


def _word(part: Part) -> str:
    return f"{part.kind.value} {part.name}"
