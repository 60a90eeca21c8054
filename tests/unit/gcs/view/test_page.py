"""What stands in the scene, on a real viser server without a browser."""

from collections.abc import AsyncIterator, Iterator

import numpy as np
import pytest
import viser

from gcs.desk import Desk
from gcs.dialect import Mode
from gcs.flight.events import EventLog, Severity
from gcs.flight.trails import Trails
from gcs.station import Station
from gcs.view import page as page_module
from gcs.view.lines import AHEAD, CHUNK
from gcs.view.page import Page
from gcs.view.server import close_server, open_server
from gcs.view.vehicle_scene import MANY
from gcs.view.wakening import SharedEvent
from missions.tunnel import CompanionState
from tests.benchmarks.view.circling_fleet import CirclingFleet
from tests.browser.loopback import HOST, free_port
from tests.browser.raw_client import raw_client
from tests.browser.scripted_desk import ScriptedDesk
from tests.browser.watching import until


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    opened = open_server(HOST, free_port())
    yield opened
    close_server(opened)


def names(server: viser.ViserServer) -> set[str]:
    """Of everything in the scene."""
    return set(server.scene._handle_from_node_name)


def node(server: viser.ViserServer | viser.ClientHandle, name: str):
    handle = server.scene.get_handle_by_name(name)
    assert handle is not None, f"{name} is not in the scene"
    return handle


class Shown:
    """A page, and a clock that the test turns."""

    def __init__(self, server: viser.ViserServer, scripted: ScriptedDesk) -> None:
        self.scripted, self.page, self.now_s = scripted, Page(server, scripted.desk), 0.0

    def fly(self, seconds: float, interval_s: float = 0.1) -> None:
        for _ in range(round(seconds / interval_s)):
            for vehicle in self.scripted.vehicles:
                vehicle.fly_on(interval_s)
            self.scripted.say()
            self.scripted.sample()
            self.now_s += interval_s
            self.page.update(self.now_s)


@pytest.fixture
async def browser(server: viser.ViserServer) -> AsyncIterator[viser.ClientHandle]:
    """A browser's handle; it has told where its camera is."""
    async with raw_client(server.get_port()):
        await until(lambda: len(server.get_clients()) == 1, "the page knows of the browser")
        yield next(iter(server.get_clients().values()))


@pytest.fixture
async def indoor() -> ScriptedDesk:
    scripted = ScriptedDesk("indoor")
    await scripted.begin(at_s=[2.0, 2.0])
    return scripted


async def test_vehicles_are_drawn_where_they_are(
    server: viser.ViserServer, browser: viser.ClientHandle, indoor: ScriptedDesk
):
    shown = Shown(server, indoor)
    shown.fly(0.5)
    drawn = node(browser, "/fleet/hull").batched_positions
    np.testing.assert_allclose(drawn, [vehicle.position_m for vehicle in indoor.vehicles], atol=0.02)
    before = drawn.copy()
    shown.fly(0.5)
    moved = np.linalg.norm(node(browser, "/fleet/hull").batched_positions - before, axis=1)
    np.testing.assert_allclose(moved, 1.5, atol=0.1)  # 3 m/s


async def test_who_comes_is_shown_the_vehicles_before_the_next_update(server: viser.ViserServer, indoor: ScriptedDesk):
    Shown(server, indoor).fly(0.5)
    async with raw_client(server.get_port()):
        await until(lambda: len(server.get_clients()) == 1, "the page knows of the browser")
        (newcomer,) = server.get_clients().values()
        await until(lambda: newcomer.scene.get_handle_by_name("/fleet/hull") is not None, "it is shown the vehicles")


@pytest.mark.parametrize(("count", "drawn_as"), [(MANY, viser.LineSegmentsHandle), (MANY + 1, viser.GlbHandle)])
async def test_what_a_large_fleet_has_flown_is_drawn_as_plain_lines(server: viser.ViserServer, count, drawn_as):
    fleet = CirclingFleet(count)
    fleet.have_flown(120.0, 0.2)
    page = Page(server, fleet.desk)
    for now_s in (0.0, 0.1):
        page.update(now_s)
    sealed = [node(server, name) for name in names(server) if name.startswith("/trails/") and "newest" not in name]
    assert sealed
    assert {type(line) for line in sealed} == {drawn_as}


async def test_a_trail_grows_behind_and_a_trajectory_lies_ahead(server: viser.ViserServer, indoor: ScriptedDesk):
    shown = Shown(server, indoor)
    shown.fly(2.5)
    vehicle_m = indoor.vehicles[0].position_m
    tail, ahead = (node(server, f"/fleet/{name}").points for name in ("tails", "ahead"))
    assert tail.shape == (2 * CHUNK, 2, 3)
    assert ahead.shape == (2 * AHEAD, 2, 3)
    np.testing.assert_allclose(tail[CHUNK - 1, 1], vehicle_m, atol=0.02)
    np.testing.assert_allclose(ahead[0, 0], vehicle_m, atol=0.02)
    assert ahead[AHEAD - 1, 1, 0] > vehicle_m[0] + 1.0
    assert node(server, "/trails/newest").visible


async def test_a_companion_that_was_stopped_has_nothing_ahead(server: viser.ViserServer, indoor: ScriptedDesk):
    shown = Shown(server, indoor)
    indoor.vehicles[0].companion = CompanionState.RELEASED
    shown.fly(0.5)
    ahead = node(server, "/fleet/ahead").points
    assert np.ptp(ahead[:AHEAD].reshape(-1, 3), axis=0).max() == 0.0
    assert np.ptp(ahead[AHEAD:].reshape(-1, 3), axis=0).max() > 1.0


async def test_the_plan_appears_when_it_is_made(server: viser.ViserServer):
    scripted = ScriptedDesk("indoor")
    shown = Shown(server, scripted)
    shown.fly(0.5)
    assert "/plan/curves" not in names(server)
    await scripted.begin(at_s=[0.0, 0.0])
    shown.fly(0.5)
    curves = node(server, "/plan/curves").points
    np.testing.assert_allclose(curves[0, 0], [1.0, 6.5, 1.5])
    np.testing.assert_allclose(node(server, "/plan/track points").points[-1], [19.0, 6.5, 1.5])


async def test_vehicles_that_are_heard_later_join(server: viser.ViserServer, browser: viser.ClientHandle):
    scripted = ScriptedDesk("fleet-10")
    later = scripted.vehicles[1:]
    del scripted.vehicles[1:]
    shown = Shown(server, scripted)
    shown.fly(0.3)
    assert len(node(browser, "/fleet/hull").batched_positions) == 1
    scripted.vehicles.extend(later)
    shown.fly(0.3)
    assert len(node(browser, "/fleet/hull").batched_positions) == 10


async def test_what_no_planner_is_told_of_is_drawn_in_simulation_alone(server: viser.ViserServer):
    scripted = ScriptedDesk("indoor-unmapped")
    Page(server, scripted.desk)
    assert "/world/pillar/hatching" in names(server)
    server.scene.reset()
    scripted.desk.simulated = False
    Page(server, scripted.desk)
    assert "/world/column" in names(server)
    assert not any("pillar" in name for name in names(server))


async def test_mountains_and_threats_are_drawn(server: viser.ViserServer):
    Page(server, ScriptedDesk("terrain-1-5uav").desk)
    contours = node(server, "/world/contours").points
    assert 400.0 < contours[..., 2].max() < 510.0
    assert node(server, "/world/ground").glb_data.startswith(b"glTF")
    assert np.linalg.norm(node(server, "/world/threat-1").vertices - [1000.0, 1000.0, 0.0], axis=1) == (
        pytest.approx(400.0, rel=1e-4)
    )


async def test_without_a_mission_vehicles_are_drawn_once_there_is_a_frame(
    server: viser.ViserServer, browser: viser.ClientHandle
):
    scripted = ScriptedDesk(None, watched=2)
    trails, scripted.desk.trails = scripted.desk.trails, None
    shown = Shown(server, scripted)
    scripted.say()
    shown.page.update(0.1)
    assert browser.scene.get_handle_by_name("/fleet/hull") is None
    scripted.desk.trails = trails
    shown.fly(0.5)
    assert len(node(browser, "/fleet/hull").batched_positions) == 2


async def test_a_page_waits_for_the_first_vehicle(server: viser.ViserServer):
    desk = Desk(Station(), EventLog(lambda: 0.0))
    for now_s in (0.0, 1.0, 2.0):
        desk.observations.histories.record(now_s, {})
    Page(server, desk).update(3.0)


async def test_a_moved_origin_begins_the_trails_anew(server: viser.ViserServer, indoor: ScriptedDesk):
    shown = Shown(server, indoor)
    shown.fly(3.0)
    assert node(server, "/trails/newest").visible
    indoor.desk.trails = Trails(indoor.mission.frame)
    shown.fly(0.2)
    assert not node(server, "/trails/newest").visible


async def test_a_long_flight_does_not_swell_what_a_browser_has_to_be_sent(
    server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch
):
    scripted = ScriptedDesk("indoor")
    shown = Shown(server, scripted)
    monkeypatch.setattr(Station, "now_s", property(lambda _: shown.now_s))
    await scripted.begin(at_s=[2.0, 2.0])
    shown.fly(5.0)  # the plots come with their second observation
    buffered = len(server._websock_server._broadcast_buffer.message_from_id)
    for vehicle in scripted.vehicles:
        vehicle.mode = Mode.HOLD
    shown.fly(60.0)
    assert len(server._websock_server._broadcast_buffer.message_from_id) <= buffered + 5


async def test_what_autopilots_say_is_taken_into_the_log_once(server: viser.ViserServer, indoor: ScriptedDesk):
    shown = Shown(server, indoor)
    indoor.air.say(indoor.vehicles[1].text("Low battery", severity=4))
    indoor.air.say(indoor.vehicles[1].text("Failsafe activated", severity=2))
    for _ in range(3):
        shown.fly(page_module.TELL_INTERVAL_S, page_module.TELL_INTERVAL_S)
    said = [event for event in indoor.events.events if event.kind == "said"]
    assert [(event.vehicle, event.text, event.severity) for event in said] == [
        ("bravo", "Low battery", Severity.WARNING),
        ("bravo", "Failsafe activated", Severity.ERROR),
    ]


async def test_whoever_waits_for_messages_is_woken_by_visers_own_thread(
    server: viser.ViserServer, browser: viser.ClientHandle
):
    for handler in (server._websock_server, browser._websock_connection):
        assert isinstance(handler.get_message_buffer().message_event, SharedEvent)
