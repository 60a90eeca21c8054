"""The page's HTML: what it says, and that nothing from outside becomes markup."""

import math
from html.parser import HTMLParser

import pytest

from gcs.desk import Intent
from gcs.dialect import Mode
from gcs.fleet.vehicle_state import VehicleState
from gcs.flight.events import Event, Severity
from gcs.flight.monitor import Phase
from gcs.link.paths import SystemPaths
from gcs.security.signing import VehicleKey
from gcs.view import event_list, fleet_table, link_table, mission_card, words
from gcs.view.colours import Tone
from gcs.view.sightings import sightings
from missions.tunnel import CompanionState, CompanionStatus, Reason
from tests.browser.scripted_plan import scripted_progress
from tests.unit.gcs import messages as mav
from tests.unit.gcs.view.desks import make_desk

NASTY = "<img src=x onerror=alert(1)> & \"quoted\" 'too'"


class Outline(HTMLParser):
    """The tags of a text in order, and its words."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.words: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)

    def handle_data(self, data: str) -> None:
        self.words.append(data.strip())

    @property
    def text(self) -> str:
        return " ".join(word for word in self.words if word)


def event(text: str, *, vehicle: str | None = None, severity: Severity = Severity.INFO, t_s: float = 0.0) -> Event:
    return Event(t_s=t_s, vehicle=vehicle, kind="said", text=text, severity=severity)


# ---------------------------------------------------------------- events


def test_events_from_outside_are_shown_as_text():
    outline = Outline(event_list.render([event(NASTY, vehicle=NASTY)], {}))
    assert "img" not in outline.tags
    assert outline.words.count(NASTY) == 2


def test_the_newest_event_stands_first_and_old_ones_are_left_out():
    outline = Outline(event_list.render([event(f"event {i}", t_s=float(i)) for i in range(100)], {}))
    assert outline.tags.count("li") == event_list.SHOWN
    assert outline.text.startswith("01:39.0 event 99 01:38.0 event 98")
    assert "event 69" not in outline.words


def test_severities_have_their_classes_and_vehicles_their_colours():
    html = event_list.render([event("late", vehicle="alpha", severity=Severity.WARNING)], {"alpha": (255, 0, 1)})
    assert '<li class="warn">' in html
    assert '<b style="color:#ff0001">alpha</b>' in html


def test_times_never_show_sixty_seconds():
    assert "02:00.0" in event_list.render([event("round", t_s=119.96)], {})


def test_an_empty_log_says_so():
    assert Outline(event_list.render([], {})).text == "nothing has happened yet"


# ---------------------------------------------------------------- fleet


async def table_of(desk, selected: frozenset[int] = frozenset()) -> list[fleet_table.Row]:
    return fleet_table.rows(desk, sightings(desk), set(selected), desk.station.now_s)


async def test_the_table_has_a_row_for_every_vehicle_also_for_those_not_heard():
    rows = await table_of(await make_desk(heard=(2,)))
    assert [row.name for row in rows] == ["alpha", "bravo"]
    assert rows[0].mode == ("not heard", Tone.QUIET)
    text = Outline(fleet_table.render(rows)).text
    assert text.startswith(" ".join(fleet_table.HEADINGS))
    assert "nan" not in text
    assert "inf" not in text


async def test_a_row_tells_mode_phase_numbers_and_companion():
    desk = await make_desk()
    state, now_s = desk.vehicles[1], desk.station.now_s
    state.armed, state.mode, state.battery_percent = True, Mode.OFFBOARD, 71.0
    state.velocity_enu_m_s[:] = (3.0, 0.0, 4.0)
    state.companion.heard_s = now_s
    state.companion.status = CompanionStatus(state=CompanionState.FLYING, replans=3, replan_p50_ms=1.44)
    assert desk.flight is not None
    desk.flight.vehicles[1].monitor.start(state, now_s)
    desk.observe(now_s)
    row = (await table_of(desk, frozenset({1})))[0]
    assert (row.mode, row.phase) == (("Offboard", Tone.GOOD), ("flying", Tone.GOOD))
    assert (row.battery_percent, row.speed_m_s, row.replan_ms) == (71.0, 5.0, 1.44)
    assert row.to_target_m == pytest.approx(math.dist((1.0, 6.5, 0.0), (19.0, 8.5, 1.5)), abs=1e-2)
    assert row.companion == ("flying", Tone.GOOD)
    text = Outline(fleet_table.render([row])).text
    assert "alpha Offboard flying 71 % 0.0 m 5.0 m/s – 18.2 m 0 % 0:06 flying 1.4 ms live – no" in text
    assert 'tr class="selected"' in fleet_table.render([row])


async def test_a_vehicle_that_is_not_ready_says_why_in_its_autopilots_words():
    desk = await make_desk()
    desk.vehicles[1].fold(mav.system_status(ready=False), desk.station.now_s)
    desk.vehicles[1].fold(mav.status_text("Preflight Fail: ekf2 missing data", severity=3), desk.station.now_s)
    unready, ready = await table_of(desk)
    assert (unready.phase, unready.reason) == (("not ready", Tone.WARN), "Preflight Fail: ekf2 missing data")
    assert ready.phase[0] == "waiting"
    desk.vehicles[1].fold(mav.system_status(ready=True), desk.station.now_s)
    assert (await table_of(desk))[0].phase[0] == "waiting"


async def test_a_row_tells_whether_its_vehicle_signs():
    desk = await make_desk()
    assert [row.trust for row in await table_of(desk)] == [("no", Tone.WARN)] * 2
    desk.station.codec.signing.vehicles[1] = VehicleKey(next_key=bytes(32))
    alpha, bravo = await table_of(desk)
    assert (alpha.trust, bravo.trust) == (("key pending", Tone.WARN), ("no", Tone.WARN))


def test_a_large_fleet_stands_closer():
    row = fleet_table.Row("alpha", (1, 2, 3), selected=False)
    assert "many" not in fleet_table.render([row] * fleet_table.FEW)
    assert "many" in fleet_table.render([row] * (fleet_table.FEW + 1))


def test_names_and_reasons_are_escaped_in_the_table():
    row = fleet_table.Row(NASTY, (0, 0, 0), selected=False, phase=(NASTY, Tone.WARN), reason=NASTY)
    outline = Outline(fleet_table.render([row]))
    assert "img" not in outline.tags
    assert outline.words.count(NASTY) == 2


# ---------------------------------------------------------------- words


@pytest.mark.parametrize(
    ("armed", "mode", "failsafe", "heard_s", "expected"),
    [
        (False, Mode.HOLD, False, 99.0, ("Hold", Tone.QUIET)),
        (True, Mode.OFFBOARD, False, 99.0, ("Offboard", Tone.GOOD)),
        (True, Mode.HOLD, False, 99.0, ("Hold", Tone.WARN)),
        (True, Mode.RTL, False, 99.0, ("RTL", Tone.WARN)),
        (True, Mode.PRECISION_LAND, False, 99.0, ("Precision land", Tone.WARN)),
        (True, Mode.LAND, True, 99.0, ("Land (failsafe)", Tone.BAD)),
        (True, Mode.OFFBOARD, False, 90.0, ("Lost", Tone.BAD)),
    ],
)
def test_modes_in_words(armed: bool, mode: Mode, failsafe: bool, heard_s: float, expected: tuple[str, Tone]):
    state = VehicleState(1, heard_s=heard_s, armed=armed, mode=mode, failsafe=failsafe)
    assert words.mode_words(state, 100.0) == expected


def test_a_companion_that_holds_at_the_target_is_fine_and_one_that_holds_elsewhere_is_not():
    state = VehicleState(1)
    assert words.companion_words(state, 0.0) == (words.NOTHING, Tone.QUIET)
    state.companion.heard_s = 100.0
    for reason, tone in ((Reason.TARGET_REACHED, Tone.GOOD), (Reason.NO_PATH, Tone.WARN)):
        state.companion.status = CompanionStatus(state=CompanionState.HOLDING, reason=reason)
        assert words.companion_words(state, 100.0) == ("holding", tone)
    assert words.companion_words(state, 110.0) == ("silent", Tone.BAD)


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.04, "0.0"), (-0.04, "0.0"), (-1.26, "-1.3"), (99.96, "100"), (1234.5, "1234"), (math.inf, "–")],
)
def test_numbers_are_short(value: float, text: str):
    assert words.number_words(value) == text


def test_a_live_link_stands_still_and_an_old_one_warns():
    assert words.age_words(0.2) == words.age_words(0.9) == ("live", Tone.GOOD)
    assert words.age_words(2.0) == ("2 s", Tone.WARN)
    assert words.age_words(12.0) == ("12 s", Tone.BAD)
    assert words.age_words(math.inf) == (words.NOTHING, Tone.QUIET)


async def test_the_table_of_links_tells_how_a_vehicle_is_reached():
    desk = await make_desk(heard=(1,))
    text = Outline(link_table.render(desk, desk.station.now_s)).text
    assert text == f"{' '.join(link_table.HEADINGS)} alpha live – – – unsigned 0 0 0 bravo – – – – – – – –"
    paths: SystemPaths = desk.station.routes._systems.setdefault(1, SystemPaths())
    path = paths.path(("a link", ("127.0.0.1", 1)))
    path.hear(1, desk.station.now_s)
    path.round_trip_s = 0.0843
    paths.choose(desk.station.now_s)
    text = Outline(link_table.render(desk, desk.station.now_s)).text
    assert "alpha live – 84 ms 1 unsigned" in text


# ---------------------------------------------------------------- mission


async def test_the_head_names_mission_and_phase():
    desk = await make_desk(planned=False)
    assert Outline(mission_card.render_head(desk, 0.0)).text == (
        "indoor The paper's indoor flight, two drones to crossed targets around a crate and a column"
        " Ready to plan end-cloud"
    )
    desk = await make_desk(None)
    assert "Watching" in Outline(mission_card.render_head(desk, 0.0)).words


@pytest.mark.parametrize(
    ("phases", "expected"),
    [
        ((Phase.WAITING, Phase.WAITING), "Planned"),
        ((Phase.PREPARED, Phase.PREPARED), "Ready to fly"),
        ((Phase.TAKING_OFF, Phase.PREPARED), "Taking off"),
        ((Phase.HOVERING, Phase.HOVERING), "Hovering"),
        ((Phase.FLYING, Phase.DONE), "Flying"),
        ((Phase.FLYING, Phase.INTERRUPTED), "Interrupted"),
        ((Phase.DONE, Phase.COMING_DOWN), "Coming down"),
        ((Phase.DONE, Phase.DONE), "Ended"),
    ],
)
async def test_the_flights_phase_is_that_of_the_vehicle_that_matters_most(phases: tuple[Phase, Phase], expected: str):
    desk = await make_desk()
    assert desk.flight is not None
    for part, phase in zip(desk.flight.vehicles.values(), phases, strict=True):
        part.monitor.phase = phase
    assert mission_card.flight_phase(desk)[0] == expected


async def test_a_mission_is_accomplished_when_all_have_reached_their_targets():
    desk = await make_desk()
    assert desk.flight is not None
    for part in desk.flight.vehicles.values():
        part.monitor.phase, part.monitor.reached = Phase.DONE, True
    assert mission_card.flight_phase(desk) == ("Mission accomplished", Tone.GOOD)


async def test_planning_shows_its_progress_and_then_the_plan():
    desk = await make_desk(planned=False)
    assert desk.flight is not None
    assert not mission_card.planning(desk)
    desk.running = Intent.FLY
    desk.plan_progress = list(scripted_progress(20))[:5]
    assert mission_card.planning(desk)
    assert mission_card.flight_phase(desk)[0] == "Planning"
    underway = Outline(mission_card.render_plan(None, desk.plan_progress))
    assert "not feasible yet 750 evaluations" in underway.text
    assert "polyline" in underway.tags
    await desk.flight.make_plan()
    assert not mission_card.planning(desk)
    assert "feasible 3\u202f000 evaluations in 0.42 s" in Outline(mission_card.render_plan(desk.flight.plan, [])).text


def test_a_chart_falls_from_left_to_right_as_its_values_do():
    points = mission_card.chart([4.0, 2.0, 1.0]).split('<polyline points="')[1].split('"')[0].split()
    places = [tuple(float(part) for part in point.split(",")) for point in points]
    assert [x for x, _ in places] == [0.0, 150.0, 300.0]
    assert [y for _, y in places] == sorted(y for _, y in places)
    assert mission_card.chart([1.0]) == ""


def test_buttons_with_the_same_reason_are_named_together():
    reasons = [("Hold", "not in flight"), ("Fly", "no link"), ("Land", "not in flight")]
    assert Outline(mission_card.render_reasons(reasons)).text == "Hold, Land not in flight Fly no link"
    assert "img" not in Outline(mission_card.render_reasons([("Hold", NASTY)])).tags
