"""Alerts: told once when they come and once when they go."""

from gcs.desk.alerts import CALM_S, Alarm, AlertBoard
from gcs.dialect import Mode
from tests.unit.gcs.view.desks import make_desk


def texts(board: AlertBoard) -> list[str]:
    return [f"{change.vehicle}: {change.text}" for change in board.changes]


def test_what_trembles_around_a_threshold_is_one_alert():
    board, told = AlertBoard(), []
    for step in range(40):
        board.update([(Alarm.LINK_POOR, "alpha")] if step % 2 else [], 0.5 * step)
        told += texts(board)
    assert told == ["alpha: poor link"]


def test_an_alert_ends_when_all_has_been_well_for_a_while():
    board = AlertBoard()
    board.update([(Alarm.LINK_LOST, "alpha")], 0.0)
    board.update([], CALM_S)
    assert board.alerts
    board.update([], CALM_S + 0.1)
    assert not board.alerts
    assert texts(board) == ["alpha: over: link lost"]


def test_the_worst_stands_first_and_vehicles_stand_together():
    board = AlertBoard()
    board.update([(Alarm.LINK_POOR, "alpha"), (Alarm.FAILSAFE, "charlie"), (Alarm.LINK_POOR, "bravo")], 0.0)
    shown = [(alarm, [alert.vehicle for alert in alerts]) for alarm, alerts in board.by_alarm()]
    assert shown == [(Alarm.FAILSAFE, ["charlie"]), (Alarm.LINK_POOR, ["alpha", "bravo"])]


async def test_a_fleets_state_raises_its_alarms():
    desk = await make_desk()
    alpha, bravo = desk.vehicles[1], desk.vehicles[2]
    alpha.battery_percent, alpha.failsafe, alpha.mode = 12.0, True, Mode.LAND
    bravo.heard_s = desk.station.now_s - 10.0
    desk.observe(desk.station.now_s)
    assert set(desk.observations.alerts.alerts) == {
        (Alarm.BATTERY_EMPTY, "alpha"),
        (Alarm.FAILSAFE, "alpha"),
        (Alarm.LINK_LOST, "bravo"),
    }
    assert [event.text for event in desk.events.events if event.kind == "alert"]
