"""Editing a mission and playing a recording, by their controls, on a real viser server without a browser."""

from collections.abc import Iterator

import numpy as np
import pytest
import viser

from gcs.view.editing_panel import EditingPanel
from gcs.view.replay_panel import ReplayPanel, clock_words
from gcs.view.server import close_server, open_server
from missions.editing import Kind, Part, moved, place_m
from missions.mission import Mission, load_mission
from tests.browser.loopback import HOST, free_port
from tests.browser.toy_player import ToyPlayer

TARGET = Part(Kind.TARGET, "north-east")


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    opened = open_server(HOST, free_port())
    yield opened
    close_server(opened)


class Editing:
    """A panel, and what it had drawn last."""

    def __init__(self, server: viser.ViserServer) -> None:
        self.server, self.drawn = server, load_mission("indoor")
        self.panel = EditingPanel(server, self.drawn, self._show, lambda draft, client: None)

    def _show(self, mission: Mission, on_pick: object) -> None:
        self.drawn = mission

    @property
    def gizmo_m(self) -> np.ndarray | None:
        handle = self.server.scene.get_handle_by_name("/editing/gizmo")
        return None if handle is None else handle.position


@pytest.fixture
async def shown(server: viser.ViserServer) -> Editing:
    return Editing(server)


async def test_a_part_that_was_picked_has_the_gizmo_on_it(shown: Editing):
    shown.panel.pick(TARGET)
    np.testing.assert_allclose(shown.gizmo_m, [19.0, 8.5, 1.5])
    shown.panel.pick(None)
    assert shown.gizmo_m is None


async def test_a_drag_moves_the_part_and_one_into_a_wall_puts_it_back(shown: Editing):
    shown.panel.pick(TARGET)
    shown.panel.change(moved(TARGET, (17.0, 9.0, 1.2)), TARGET)
    assert place_m(shown.drawn, TARGET) == (17.0, 9.0, 1.2)
    np.testing.assert_allclose(shown.gizmo_m, [17.0, 9.0, 1.2])
    shown.panel.change(moved(TARGET, (7.0, 7.0, 1.2)), TARGET)
    assert place_m(shown.drawn, TARGET) == (17.0, 9.0, 1.2)
    np.testing.assert_allclose(shown.gizmo_m, [17.0, 9.0, 1.2])


@pytest.mark.parametrize("kind", [Kind.BOX, Kind.CYLINDER, Kind.THREAT])
async def test_new_bodies_are_drawn_and_picked(shown: Editing, kind: Kind):
    before = shown.panel.draft
    shown.panel.add(kind)
    assert shown.drawn == shown.panel.draft != before
    assert shown.gizmo_m is not None


async def test_the_timeline_follows_the_recording_and_many_moves_are_one_jump(server: viser.ViserServer):
    player = ToyPlayer()
    panel = ReplayPanel(server.gui, player)
    player.position_s = 12.34
    panel.update()
    assert panel.position_shown_s == pytest.approx(12.3)
    for wanted_s in (20.0, 30.0, 40.0):
        panel.want(wanted_s)
    panel.update()
    assert player.sought == [40.0]
    player.position_s = 40.5
    panel.update()
    assert panel.position_shown_s == pytest.approx(12.3)  # the operator's hand may still be on it
    for _ in range(5):
        panel.update()
    assert panel.position_shown_s == pytest.approx(40.5)


def test_times_are_told_in_minutes():
    assert clock_words(75.25) == "01:15.2"
