"""The mission protocol's server: PX4's rules for uploads and downloads, and nothing stored that cannot be flown."""

import itertools
import math

import pytest

from sitl.dialect import mavlink
from sitl.microservices.outbox import Link
from sitl.wire import LAYOUTS
from tests.unit.sitl.flown import NAN, Flown, parsed, place, waypoint

ACCEPTED, ERROR, UNSUPPORTED_FRAME, UNSUPPORTED, NO_SPACE = 0, 1, 2, 3, 4


def item_int(seq: int, item: tuple, kind: int = 0):
    frame, command, p1, p2, p3, p4, x, y, z = item
    return mavlink.MAVLink_mission_item_int_message(1, 1, seq, frame, command, 0, 1, p1, p2, p3, p4, x, y, z, kind)


def count(n: int, kind: int = 0):
    return mavlink.MAVLink_mission_count_message(1, 1, n, kind)


def square(n: int = 3) -> list[tuple]:
    return [waypoint(float(i), 2.0 * i, 5.0) for i in range(n)]


def requests(flown: Flown, link: Link = Link.GROUND) -> list:
    ids = {LAYOUTS[name].id_bytes for name in ("MISSION_REQUEST", "MISSION_REQUEST_INT")}
    return [parsed(frame) for frame in flown.heard(link) if frame[7:10] in ids]


# ---------------------------------------------------------------------- upload
def test_items_are_asked_for_one_by_one_in_the_kind_that_the_client_speaks():
    flown = Flown().boot()
    flown.send(count(3))
    for seq, item in enumerate(square()):
        assert requests(flown)[-1].seq == seq
        flown.send(item_int(seq, item))
    assert [m.get_type() for m in requests(flown)] == ["MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_REQUEST_INT"]
    assert flown.last("MISSION_ACK").type == ACCEPTED


def test_a_client_that_knows_no_old_items_is_asked_again():
    flown = Flown().boot()
    flown.send(count(1))
    flown.send(mavlink.MAVLink_mission_ack_message(1, 1, mavlink.MAV_MISSION_UNSUPPORTED, 0))
    assert [m.get_type() for m in requests(flown)] == ["MISSION_REQUEST", "MISSION_REQUEST_INT"]


def test_an_unanswered_request_is_repeated_and_given_up_after_five_seconds_with_the_old_plan_kept():
    flown = Flown().boot()
    flown.upload(square(2))
    flown.forget()
    flown.send(count(3))
    flown.run(4.9)
    assert 15 <= len(requests(flown)) <= 21
    flown.run(0.4)
    asked = len(requests(flown))
    assert "Operation timeout" in flown.texts
    assert flown.run(1.0).messages("MISSION_ACK") == []
    assert len(requests(flown)) == asked
    assert len(flown.autopilot.navigator.mission.plan.items) == 2


def test_with_a_speed_factor_the_timeout_stays_a_wall_clock_time():
    flown = Flown(speed=4.0).boot()
    flown.send(count(1))
    assert flown.until(lambda: "Operation timeout" in flown.texts, 30.0) == pytest.approx(20.0, abs=0.1)


def test_wrong_and_doubled_items_are_ignored_and_bursts_are_taken():
    flown = Flown().boot()
    items = square(4)
    flown.send(count(4))
    for seq in (2, 0, 0, 1, 3, 1, 2, 3):
        flown.send(item_int(seq, items[seq]))
    assert flown.last("MISSION_ACK").type == ACCEPTED
    assert [item.x for item in flown.autopilot.navigator.mission.plan.items] == [item[6] for item in items]


def test_a_count_starts_over_only_while_nothing_has_arrived():
    flown = Flown().boot()
    flown.send(count(3))
    flown.send(count(2))
    assert [m.seq for m in requests(flown)] == [0, 0]
    flown.send(item_int(0, square()[0]))
    flown.send(count(2))
    assert flown.last("MISSION_ACK").type == ERROR
    flown.send(item_int(1, square()[1]))
    assert flown.last("MISSION_ACK").type == ACCEPTED


@pytest.mark.parametrize("link", list(Link))
def test_one_upload_at_a_time_over_both_links(link):
    flown = Flown().boot()
    flown.send(count(3))
    flown.send(count(1), link=link, source=(200, 1))
    acks = flown.messages("MISSION_ACK", link=link)
    assert [(ack.type, ack.target_system) for ack in acks] == [(ERROR, 200)]
    flown.send(mavlink.MAVLink_mission_ack_message(1, 1, mavlink.MAV_MISSION_OPERATION_CANCELLED, 0))
    flown.send(count(1), link=link, source=(200, 1))
    assert requests(flown, link)[-1].target_system == 200


def test_answers_go_to_the_asking_link_only():
    flown = Flown().boot()
    flown.upload(square(), link=Link.ONBOARD)
    assert not requests(flown, Link.GROUND)
    assert not flown.messages("MISSION_ACK", link=Link.GROUND)


def test_an_item_out_of_the_blue_is_an_error():
    flown = Flown().boot()
    flown.send(item_int(0, square()[0]))
    assert flown.last("MISSION_ACK").type == ERROR


@pytest.mark.parametrize(
    ("n", "kind", "result"), [(65, 1, NO_SPACE), (33, 2, NO_SPACE), (65535, 0, NO_SPACE), (3, 7, ERROR)]
)
def test_too_many_items_and_unknown_plans_are_refused(n, kind, result):
    flown = Flown().boot()
    flown.send(count(n, kind))
    assert flown.last("MISSION_ACK").type == result


X, Y = place(5.0, 5.0)
BAD_ITEMS = [
    ((6, 31000, 0, 0, 0, 0, X, Y, 5.0), UNSUPPORTED),
    ((6, 178, 1, 2, 0, 0, X, Y, 5.0), UNSUPPORTED),  # a speed has no place
    ((2, 16, 0, 0, 0, NAN, X, Y, 5.0), UNSUPPORTED),  # a waypoint has one
    ((1, 16, 0, 0, 0, NAN, X, Y, 5.0), UNSUPPORTED_FRAME),
    ((10, 16, 0, 0, 0, NAN, X, Y, 5.0), UNSUPPORTED_FRAME),
    ((6, 16, math.inf, 0, 0, NAN, X, Y, 5.0), 6),
    ((6, 16, 0, 0, -math.inf, NAN, X, Y, 5.0), 8),
    ((2, 177, NAN, 1, 0, 0, 0, 0, 0.0), 6),
    ((6, 16, 0, 0, 0, NAN, 950_000_000, Y, 5.0), 10),
    ((6, 16, 0, 0, 0, NAN, 2**31 - 1, Y, 5.0), 10),
    ((6, 16, 0, 0, 0, NAN, X, -1_900_000_000, 5.0), 11),
    ((6, 16, 0, 0, 0, NAN, X, Y, NAN), 12),
    ((6, 16, 0, 0, 0, NAN, X, Y, math.inf), 12),
    ((6, 16, 0, 0, 0, NAN, X, Y, 1e9), 12),
]


@pytest.mark.parametrize(("item", "result"), BAD_ITEMS)
def test_items_that_cannot_be_flown_are_refused_with_their_reason_and_the_old_plan_stays(item, result):
    flown = Flown().boot()
    flown.upload(square(2))
    before = flown.autopilot.navigator.mission.plan
    assert flown.upload([square()[0], item]) == result
    assert "IGN MISSION_ITEM: Invalid item" in flown.texts
    assert flown.autopilot.navigator.mission.plan is before


def test_an_item_of_another_plan_is_an_error():
    flown = Flown().boot()
    flown.send(count(2))
    flown.send(item_int(0, square()[0], kind=1))
    assert flown.last("MISSION_ACK").type == ERROR


def test_old_float_items_are_taken_as_well():
    flown = Flown().boot()
    flown.send(count(1))
    item = mavlink.MAVLink_mission_item_message(1, 1, 0, 3, 16, 0, 1, 0, 0, 0, NAN, 47.5, 8.5, 5.0, 0)
    flown.send(item)
    (stored,) = flown.autopilot.navigator.mission.plan.items
    assert (stored.frame, stored.x, stored.y) == (6, 475_000_000, 85_000_000)


# -------------------------------------------------------------------- identity
def test_equal_plans_have_equal_ids_others_have_others_and_none_has_zero():
    flown = Flown().boot()
    ids = []
    for items in (square(2), square(3), square(2), []):
        flown.upload(items)
        ids.append(flown.run(0.1).last("MISSION_CURRENT").mission_id)
        assert flown.last("MISSION_ACK").opaque_id == ids[-1]
    assert ids[0] == ids[2] != ids[1]
    assert ids[3] == 0
    assert flown.last("MISSION_CURRENT").total == 65535


def test_fence_and_rally_have_ids_of_their_own():
    flown = Flown().boot()
    flown.upload([(5, 5003, 50.0, 0, 0, 0, *place(0, 0), 0.0)], kind=1)
    flown.upload([(6, 5100, 0, 0, 0, 0, *place(0, 0), 10.0)], kind=2)
    current = flown.run(0.1).last("MISSION_CURRENT")
    assert len({0, current.fence_id, current.rally_points_id}) == 3
    assert current.mission_id == 0


@pytest.mark.parametrize(("kind", "left"), [(0, (0, 1, 1)), (1, (1, 0, 1)), (2, (1, 1, 0)), (255, (0, 0, 0))])
def test_clearing_one_plan_or_all(kind, left):
    flown = Flown().boot()
    flown.upload(square(1))
    flown.upload([(5, 5003, 50.0, 0, 0, 0, *place(0, 0), 0.0)], kind=1)
    flown.upload([(6, 5100, 0, 0, 0, 0, *place(0, 0), 10.0)], kind=2)
    flown.send(mavlink.MAVLink_mission_clear_all_message(1, 1, kind))
    ack = flown.last("MISSION_ACK")
    assert (ack.type, ack.mission_type) == (ACCEPTED, kind)
    current = flown.run(0.1).last("MISSION_CURRENT")
    assert tuple(int(i != 0) for i in (current.mission_id, current.fence_id, current.rally_points_id)) == left


# -------------------------------------------------------------------- download
def download(flown: Flown, kind: int = 0, *, link: Link = Link.GROUND) -> list:
    flown.send(mavlink.MAVLink_mission_request_list_message(1, 1, kind), link=link)
    n = flown.last("MISSION_COUNT", link=link).count
    for seq in range(n):
        flown.send(mavlink.MAVLink_mission_request_int_message(1, 1, seq, kind), link=link)
    return flown.messages("MISSION_ITEM_INT", link=link)


def test_a_download_gives_back_what_was_uploaded():
    flown = Flown().boot()
    items = [*square(3), (2, 178, 1.0, 2.5, -1.0, 0.0, 0, 0, 0.0), (5, 16, 0.0, 0.3, 0.0, NAN, X, Y, 500.0)]
    flown.upload(items)
    stored = download(flown, link=Link.ONBOARD)
    assert [m.seq for m in stored] == list(range(5))
    assert [m.current for m in stored] == [1, 0, 0, 0, 0]
    for message, (frame, command, _, p2, _, _, x, y, z) in zip(stored, items, strict=True):
        assert (message.frame, message.command, message.x, message.y, message.z) == (frame, command, x, y, z)
        assert message.param2 == pytest.approx(p2)
    assert flown.last("MISSION_COUNT", link=Link.ONBOARD).opaque_id == flown.last("MISSION_CURRENT").mission_id


@pytest.mark.parametrize("frame", [0, 3, 5, 6])
def test_a_fence_comes_back_above_sea_level(frame):
    flown = Flown().boot()
    flown.upload([(frame, 5003, 50.0, 0, 0, 0, *place(0, 0), 10.0)], kind=1)
    (item,) = download(flown, 1)
    assert (item.frame, item.autocontinue, item.z) == (5, 0, 10.0)


def test_a_polygon_of_two_is_an_error_and_what_follows_belongs_to_nothing():
    flown = Flown().boot()
    flown.send(count(2, 1))
    for seq in range(2):
        flown.send(item_int(seq, (3, 5001, 2.0, 0, 0, 0, *place(0, 10.0 * seq), 0.0), 1))
    assert [ack.type for ack in flown.messages("MISSION_ACK")] == [ERROR, ERROR]
    assert flown.run(0.1).texts[-1] == "IGN MISSION_ITEM: No transfer"


@pytest.mark.parametrize(
    ("command", "result"), [(187, ACCEPTED), (211, ACCEPTED), (3000, ACCEPTED), (183, UNSUPPORTED), (531, UNSUPPORTED)]
)
def test_items_for_equipment_are_stored_as_far_as_a_px4_stores_them(command, result):
    flown = Flown().boot()
    flown.send(count(2))
    for seq, item in enumerate([*square(1), (2, command, 1.0, 1.0, 0.0, 0.0, 0, 0, 0.0)]):
        flown.send(item_int(seq, item))
    assert flown.last("MISSION_ACK").type == result


def test_old_requests_get_old_items():
    flown = Flown().boot()
    flown.upload(square(1))
    flown.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    flown.send(mavlink.MAVLink_mission_request_message(1, 1, 0, 0))
    item = flown.last("MISSION_ITEM")
    assert item.frame == 3
    assert item.x == pytest.approx(47.3977432, abs=1e-5)


def test_the_last_item_is_sent_again_and_a_jump_ahead_ends_the_download():
    flown = Flown().boot()
    flown.upload(square(5))
    flown.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    for seq in (0, 1, 1, 2):
        flown.send(mavlink.MAVLink_mission_request_int_message(1, 1, seq, 0))
    assert [m.seq for m in flown.messages("MISSION_ITEM_INT")] == [0, 1, 1, 2]
    flown.send(mavlink.MAVLink_mission_request_int_message(1, 1, 4, 0))
    assert flown.last("MISSION_ACK").type == ERROR
    flown.send(mavlink.MAVLink_mission_request_int_message(1, 1, 3, 0))
    assert len(flown.messages("MISSION_ITEM_INT")) == 4


def test_nothing_is_nothing():
    flown = Flown().boot()
    for kind in (0, 1, 2, 3, 255):
        flown.send(mavlink.MAVLink_mission_request_list_message(1, 1, kind))
        assert flown.last("MISSION_COUNT").count == 0
        flown.send(mavlink.MAVLink_mission_ack_message(1, 1, 0, kind))


def test_a_download_waits_for_an_upload_to_end():
    flown = Flown().boot()
    flown.send(count(2))
    flown.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    assert not flown.messages("MISSION_COUNT")
    assert "Mission download request ignored, already active" in flown.run(0.1).texts


def test_a_hundred_items_go_up_and_down_in_no_time():
    flown = Flown().boot()
    items = [waypoint(float(i % 10), float(i // 10), 5.0) for i in range(100)]
    assert flown.upload(items) == ACCEPTED
    assert [m.x for m in download(flown)] == [item[6] for item in items]
    assert all(after.seq == before.seq + 1 for before, after in itertools.pairwise(flown.messages("MISSION_ITEM_INT")))
