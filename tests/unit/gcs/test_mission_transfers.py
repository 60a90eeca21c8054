"""Missions up and down, message by message, and against the simulator's server over links that lose and go down."""

import msgspec
import numpy as np
import pytest

from gcs.dialect import mavlink
from gcs.errors import LinkLost, MissionTransferError
from gcs.microservices.current_item import CurrentItem
from gcs.microservices.mission_download import MissionDownload
from gcs.microservices.mission_messages import MOST_IN_FLIGHT, LinkEstimate, item_message
from gcs.microservices.mission_upload import MissionUpload
from gcs.microservices.verified_upload import Stage, VerifiedUpload
from sitl.autopilot.plan import Plan
from sitl.microservices.mission_transfer_server import MissionType
from tests.benchmarks.link.conditions import waypoints
from tests.benchmarks.link.conversation import Conversation, LinkModel
from tests.unit.gcs.messages import from_autopilot

PEER = (1, 1)
ITEMS = waypoints(40, np.random.default_rng(0))


def sent(messages: list) -> list[str]:
    return [message.get_type() for message in messages]


def request(seq: int, *, legacy: bool = False):
    kind = mavlink.MAVLink_mission_request_message if legacy else mavlink.MAVLink_mission_request_int_message
    return from_autopilot(kind(255, 190, seq, 0))


def mission_ack(result: int = 0):
    return from_autopilot(mavlink.MAVLink_mission_ack_message(255, 190, result, 0))


def count(n: int):
    return from_autopilot(mavlink.MAVLink_mission_count_message(255, 190, n, 0))


def item(seq: int):
    return from_autopilot(item_message(ITEMS[seq], seq, (255, 190), 0))


def time_out(service, until_s: float) -> None:
    while service.deadline_s < until_s and not service.done:
        service.handle_timeout(service.deadline_s)


def begun_upload(n: int = 40) -> tuple[MissionUpload, list[int]]:
    """An upload whose first request has come after 0.1 s, and what it has sent then."""
    upload = MissionUpload(ITEMS[:n], PEER)
    upload.start(0.0)
    return upload, [message.seq for message in upload.receive(request(0), 0.1)]


# ------------------------------------------------------------------ upload, message by message


@pytest.mark.parametrize("legacy", [True, False])
def test_an_upload_answers_requests_of_both_kinds_with_int_items(legacy: bool):
    upload = MissionUpload(ITEMS[:3], PEER)
    assert sent(upload.start(0.0)) == ["MISSION_COUNT"]
    messages = upload.receive(request(0, legacy=legacy), 0.1)
    assert sent(messages) == ["MISSION_ITEM_INT"] * 3
    assert [(message.seq, message.x, message.current) for message in messages] == [
        (seq, ITEMS[seq].x, int(seq == 0)) for seq in range(3)
    ]


def test_items_go_ahead_of_the_requests_but_only_so_many():
    upload, seqs = begun_upload()
    assert seqs == list(range(MOST_IN_FLIGHT))
    assert [message.seq for message in upload.receive(request(3), 0.2)] == [16, 17, 18]


def test_no_item_goes_out_before_the_vehicle_has_asked():
    upload = MissionUpload(ITEMS, PEER)
    assert sent(upload.start(0.0) + upload.handle_timeout(upload.deadline_s)) == ["MISSION_COUNT"] * 2


def test_a_lost_item_and_all_behind_it_go_out_again_when_its_answer_is_late():
    upload, _ = begun_upload()
    upload.receive(request(5), 0.2)
    again = upload.handle_timeout(upload.deadline_s)
    assert [message.seq for message in again][:2] == [5, 6]


def test_the_window_shrinks_with_the_loss():
    upload, _ = begun_upload()
    for base in range(1, 13):
        now_s = upload.deadline_s
        upload.handle_timeout(now_s)
        upload.receive(request(base), now_s + 0.1)
    assert len(upload.handle_timeout(upload.deadline_s)) <= MOST_IN_FLIGHT
    assert upload.learned.loss > 0.2


def test_the_end_is_acknowledged_or_left_to_reading_back():
    upload, _ = begun_upload(3)
    upload.receive(mission_ack(), 0.2)
    assert (upload.done, upload.acknowledged) == (True, True)
    upload, _ = begun_upload(3)
    time_out(upload, 20.0)
    assert (upload.done, upload.acknowledged, upload.all_sent) == (True, False, True)


def test_errors_after_the_last_item_end_the_upload_without_a_verdict():
    upload, _ = begun_upload(3)
    upload.receive(mission_ack(mavlink.MAV_MISSION_ERROR), 0.2)
    assert not upload.done
    upload.receive(mission_ack(mavlink.MAV_MISSION_ERROR), 0.2)
    assert (upload.done, upload.acknowledged) == (True, False)


def test_an_old_acceptance_does_not_end_a_new_upload():
    upload = MissionUpload(ITEMS, PEER)
    upload.start(0.0)
    upload.receive(mission_ack(), 0.1)
    assert not upload.done
    upload.receive(request(0), 0.2)
    upload.receive(mission_ack(), 0.3)
    assert not upload.done


def test_a_busy_vehicle_is_freed_of_our_own_transfer_and_asked_again():
    upload = MissionUpload(ITEMS, PEER)
    upload.start(0.0)
    (cancel,) = upload.receive(mission_ack(mavlink.MAV_MISSION_ERROR), 0.1)
    assert cancel.type == mavlink.MAV_MISSION_OPERATION_CANCELLED
    assert sent(upload.handle_timeout(upload.deadline_s)) == ["MISSION_COUNT"]
    with pytest.raises(MissionTransferError, match="refused: MAV_MISSION_NO_SPACE"):
        upload.receive(mission_ack(mavlink.MAV_MISSION_NO_SPACE), 2.0)


def test_requests_beyond_what_can_be_wanted_are_ignored():
    upload, _ = begun_upload()
    assert upload.receive(request(39), 0.2) == []
    assert upload.receive(request(4000), 0.2) == []
    assert upload.taken == 0


def test_a_silent_vehicle_ends_the_upload_with_how_far_it_got():
    upload, _ = begun_upload()
    upload.receive(request(2), 0.2)
    with pytest.raises(MissionTransferError, match="no answer after 0 of 40 items"):
        time_out(upload, 100.0)


# ------------------------------------------------------------------ download, message by message


def test_requests_run_ahead_in_order():
    download = MissionDownload(PEER)
    assert sent(download.start(0.0)) == ["MISSION_REQUEST_LIST"]
    assert [message.seq for message in download.receive(count(40), 0.1)] == list(range(32))


def test_on_a_lossy_link_requests_go_out_in_copies_and_still_in_order():
    download = MissionDownload(PEER, link=LinkEstimate(0.1, 0.3))
    download.start(0.0)
    seqs = [message.seq for message in download.receive(count(40), 0.1)]
    assert seqs == sorted(seqs)
    assert seqs.count(0) > 2


def test_what_was_lost_is_asked_for_in_a_second_pass():
    download = MissionDownload(PEER)
    download.start(0.0)
    download.receive(count(3), 0.1)
    for seq in (0, 2):
        download.receive(item(seq), 0.2)
    asked: list = []
    while "MISSION_REQUEST_LIST" not in sent(asked):
        asked = download.handle_timeout(download.deadline_s)
    assert [message.seq for message in download.receive(count(3), 3.0)][:1] == [0]
    for seq in (0, 1):
        answer = download.receive(item(seq), 3.1)
    assert sent(answer) == ["MISSION_ACK"]
    assert [found.x for found in download.items] == [wanted.x for wanted in ITEMS[:3]]


def test_a_plan_that_changes_between_passes_is_not_mixed_with_the_old_one():
    download = MissionDownload(PEER)
    download.start(0.0)
    download.receive(count(3), 0.1)
    download.receive(item(0), 0.2)
    while "MISSION_REQUEST_LIST" not in sent(download.handle_timeout(download.deadline_s)):
        pass
    changed = from_autopilot(mavlink.MAVLink_mission_count_message(255, 190, 3, 0, 77))
    download.receive(changed, 9.0)
    for seq in (1, 2):
        download.receive(item(seq), 9.1)
    assert not download.done


def test_an_empty_vehicle_downloads_as_empty_and_an_absurd_count_is_refused():
    download = MissionDownload(PEER)
    download.start(0.0)
    download.receive(count(0), 0.1)
    assert (download.done, download.items) == (True, [])
    download = MissionDownload(PEER)
    download.start(0.0)
    with pytest.raises(MissionTransferError, match="65535 items"):
        download.receive(count(65535), 0.1)


def test_items_that_nobody_asked_for_change_nothing():
    download = MissionDownload(PEER)
    download.start(0.0)
    download.receive(item(0), 0.05)
    download.receive(count(3), 0.1)
    download.receive(from_autopilot(item_message(ITEMS[0], 17, (255, 190), 0)), 0.2)
    assert not download.done
    assert download.items == []


# ------------------------------------------------------------------ verified, against the simulator's server


def conversation(link: LinkModel, seed: int = 0) -> Conversation:
    talk = Conversation(link, np.random.default_rng(seed))
    talk.shelf.plans[MissionType.MISSION] = Plan(tuple(OLD))
    return talk


OLD = waypoints(5, np.random.default_rng(99))


def stored(talk: Conversation) -> list:
    return list(talk.shelf.plans[MissionType.MISSION].items)


@pytest.mark.parametrize("loss", [0.0, 0.1, 0.3, 0.5])
@pytest.mark.parametrize("n", [0, 1, 2, 17, 40])
def test_what_is_called_stored_is_stored(n: int, loss: float):
    talk = conversation(LinkModel(loss, jitter_s=0.03), seed=n)
    upload = VerifiedUpload(ITEMS[:n], PEER)
    talk.run(upload)
    assert upload.stage is Stage.STORED
    assert stored(talk) == ITEMS[:n]
    assert upload.stored_id == talk.shelf.plan(MissionType.MISSION).plan_id


def test_a_window_costs_one_round_trip_for_sixteen_items():
    talk = conversation(LinkModel())
    upload = VerifiedUpload(ITEMS, PEER)
    talk.run(upload)
    assert upload.accepted_s < 0.5
    assert upload.items_sent == len(ITEMS)


@pytest.mark.parametrize("outage_s", [(0.25, 3.0), (0.25, 12.0), (0.45, 30.0), (0.55, 8.0)])
def test_an_outage_is_waited_out(outage_s: tuple[float, float]):
    talk = conversation(LinkModel(0.1, outages_s=(outage_s,)))
    talk.run(VerifiedUpload(ITEMS, PEER))
    assert stored(talk) == ITEMS
    assert talk.now_s < outage_s[1] + 12.0


def test_a_link_that_stays_away_leaves_the_old_plan_or_the_whole_new_one_and_says_that_it_does_not_know():
    for begins_s in np.arange(0.0, 0.55, 0.05):
        talk = conversation(LinkModel(outages_s=((float(begins_s), 1e9),)))
        with pytest.raises(MissionTransferError, match="what is stored is not known"):
            talk.run(VerifiedUpload(ITEMS, PEER))
        assert stored(talk) in (OLD, ITEMS)


def test_a_refusal_keeps_the_old_plan_and_says_so():
    refused = [*ITEMS[:3], msgspec.structs.replace(ITEMS[3], command=31000)]
    talk = conversation(LinkModel())
    with pytest.raises(MissionTransferError, match=r"refused: MAV_MISSION_UNSUPPORTED; stored is something else: 5"):
        talk.run(VerifiedUpload(refused, PEER))
    assert stored(talk) == OLD


def test_a_forged_refusal_or_acceptance_is_found_out():
    for forged in (mavlink.MAV_MISSION_DENIED, mavlink.MAV_MISSION_ACCEPTED, mavlink.MAV_MISSION_ERROR):
        talk = conversation(LinkModel(0.05), seed=forged)
        upload = VerifiedUpload(ITEMS, PEER)
        upload.start(0.0)
        upload.receive(mission_ack(forged), 0.01)
        talk.run(upload)
        assert stored(talk) == ITEMS


def test_a_vehicle_that_stores_something_else_is_never_called_stored():
    talk = conversation(LinkModel())
    store = talk.shelf.store
    talk.shelf.store = lambda kind, items: store(kind, (*items[:-1], msgspec.structs.replace(items[-1], z=1.0)))
    with pytest.raises(MissionTransferError, match="after 4 uploads; stored is something else: item 39: z 1.0"):
        talk.run(VerifiedUpload(ITEMS, PEER))


def test_an_abandoned_upload_does_not_block_the_next_one():
    talk = conversation(LinkModel())
    begun = MissionUpload(ITEMS, PEER)
    talk._send(begun.start(0.0))
    talk.run(VerifiedUpload(ITEMS[:7], PEER))
    assert stored(talk) == ITEMS[:7]


# ------------------------------------------------------------------ the current item


def current(seq: int, mission_id: int = 0):
    return from_autopilot(mavlink.MAVLink_mission_current_message(seq, 5, 0, 0, mission_id))


def test_the_current_item_is_set_until_the_vehicle_says_so():
    service = CurrentItem(PEER, 0, mission_id=7)
    assert sent(service.start(0.0) + service.handle_timeout(service.deadline_s)) == ["MISSION_SET_CURRENT"] * 2
    service.receive(current(0, mission_id=3), 1.0)  # still the old mission
    assert not service.done
    service.receive(current(1, mission_id=7), 1.1)
    assert service.done


def test_a_vehicle_that_keeps_its_old_item_is_an_error():
    service = CurrentItem(PEER, 2)
    service.start(0.0)
    service.receive(current(1), 0.1)
    with pytest.raises(LinkLost, match="does not say that item 2 is its current one"):
        time_out(service, 60.0)
