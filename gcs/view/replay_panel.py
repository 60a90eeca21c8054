"""A recording's controls: play and pause, the timeline, jumps, speed. All browsers share them."""

import asyncio
from collections.abc import Callable
from typing import Protocol

import viser

from gcs.view.colours import BRAND, QUIET, Rgb

TOP_PX, WIDTH_PX = 14, 470
SPEEDS = ("0.5×", "1×", "2×", "5×", "10×", "20×")
JUMP_S = 10.0
STEP_S = 0.1
HANDS_OFF_UPDATES = 5
"""So many updates after an operator has moved the timeline, it follows the recording again."""


class Plays(Protocol):
    """What the controls need of a player; `gcs.replay.player.Player` is one."""

    speed: float

    @property
    def duration_s(self) -> float: ...
    @property
    def position_s(self) -> float: ...
    @property
    def playing(self) -> bool: ...
    def play(self) -> None: ...
    def pause(self) -> None: ...
    def set_speed(self, speed: float) -> None: ...
    def seek(self, position_s: float) -> None: ...


class ReplayPanel:
    """The controls of one player. `update` comes on the event loop's thread, presses come in threads of viser.

    Args:
        gui: of the page.
        player: what is controlled.
    """

    def __init__(self, gui: viser.GuiApi, player: Plays) -> None:
        self._gui, self._player, self._loop = gui, player, asyncio.get_running_loop()
        self._wanted_s: float | None = None
        self._hands_off = 0
        panel = gui.add_panel()
        with panel.add_tab("Recording", viser.Icon.HISTORY):
            gui.add_html('<span class="gcs-columns-3"></span>')
            self._button("− 10 s", viser.Icon.REWIND_BACKWARD_10, lambda: self._jump(-JUMP_S), QUIET)
            self._play = self._button("Play", viser.Icon.PLAYER_PLAY, self._toggle, BRAND)
            self._button("+ 10 s", viser.Icon.REWIND_FORWARD_10, lambda: self._jump(JUMP_S), QUIET)
            end_s = max(STEP_S, round(player.duration_s / STEP_S) * STEP_S)
            self._line = gui.add_slider("Time [s]", 0.0, end_s, STEP_S, 0.0)
            self._speed = gui.add_button_group("Speed", SPEEDS)
            self._told = gui.add_html("")
        panel.float(x=TOP_PX, y=TOP_PX, width=WIDTH_PX)
        self._line.on_update(self._moved)
        self._speed.on_click(self._speed_chosen)

    @property
    def position_shown_s(self) -> float:
        """Where the timeline stands."""
        return float(self._line.value)

    def want(self, position_s: float) -> None:
        """Jump to a moment at the next update: whoever drags the timeline asks for many."""
        self._wanted_s = position_s

    def update(self) -> None:
        """Do what was asked for since the last call, and show where the recording is."""
        if self._wanted_s is not None:
            self._player.seek(self._wanted_s)
            self._wanted_s, self._hands_off = None, HANDS_OFF_UPDATES
        self._hands_off = max(0, self._hands_off - 1)
        if self._hands_off == 0:
            self._line.value = min(round(self._player.position_s / STEP_S) * STEP_S, self._line.max)
        self._play.label = "Pause" if self._player.playing else "Play"
        self._play.icon = viser.Icon.PLAYER_PAUSE if self._player.playing else viser.Icon.PLAYER_PLAY
        place = f"{clock_words(self._player.position_s)} of {clock_words(self._player.duration_s)}"
        self._told.content = f'<section class="gcs-replay"><b>{place}</b> at {self._player.speed:g}× time</section>'

    def _button(self, label: str, icon: viser.IconName, act: Callable[[], None], colour: Rgb) -> viser.GuiButtonHandle:
        button = self._gui.add_button(label, icon=icon, color=colour)
        button.on_click(lambda _: self._on_loop(act))
        return button

    def _on_loop(self, act: Callable[[], None]) -> None:
        self._loop.call_soon_threadsafe(act)

    def _toggle(self) -> None:
        if self._player.playing:
            self._player.pause()
        else:
            self._player.play()

    def _jump(self, by_s: float) -> None:
        self.want(self._player.position_s + by_s)

    def _moved(self, event: viser.GuiEvent[viser.GuiSliderHandle[float]]) -> None:
        if event.client is not None:  # not by `update`
            self._on_loop(lambda: self.want(self._line.value))

    def _speed_chosen(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        chosen = float(str(event.target.value).removesuffix("×"))
        self._on_loop(lambda: self._player.set_speed(chosen))


def clock_words(seconds: float) -> str:
    """A time as minutes and seconds."""
    minutes, rest = divmod(round(seconds, 1), 60)
    return f"{minutes:02.0f}:{rest:04.1f}"
