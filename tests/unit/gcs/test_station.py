"""The station between its connections and its microservices."""

import asyncio
import time

import pytest

from gcs.dialect import Mode, mavlink
from gcs.errors import AmbiguousVehicle, CommandRefused
from gcs.flight import actions
from gcs.link.codec import Codec
from gcs.microservices.command_client import CommandClient
from gcs.microservices.verified_upload import VerifiedUpload
from gcs.station import Station
from missions.mission_items import MissionItem
from missions.tunnel import CompanionState, CompanionStatus, PayloadType, Receipt, decode_receipt, encode_status
from tests.simulation import virtual_time
from tests.unit.gcs import messages as mav

SIMULATOR = ("127.0.0.1", 14580)


class Wire:
    """A connection that keeps what is sent."""

    peer = None
    budget_bytes_s: float | None = None

    def __init__(self) -> None:
        self.sent: list[bytes] = []

    def send(self, datagram: bytes, address: tuple[str, int]) -> None:
        self.sent.append(datagram)


def acknowledgement(target: tuple[int, int]) -> bytes:
    ack = mavlink.MAVLink_command_ack_message(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 0, 0, *target)
    return mav.frame_of(1, 1, ack)


async def arm_answered_for(target: tuple[int, int]) -> bool:
    """Whether an acknowledgement for somebody ends our own arming."""
    station, wire = Station(unix_us=lambda: 0), Wire()
    arming = asyncio.create_task(station.run(CommandClient(actions.arm(), (1, 1))))
    await asyncio.sleep(0.01)
    station.receive(wire, acknowledgement(target), SIMULATOR)
    await asyncio.sleep(0.01)
    done = arming.done()
    arming.cancel()
    return done


def test_an_answer_to_somebody_else_answers_nothing_of_ours():
    for target, ours in [((255, 190), True), ((0, 0), True), ((1, 191), False), ((255, 1), False), ((254, 190), False)]:
        assert virtual_time.run(arm_answered_for(target)) is ours


# ------------------------------------------------------------------ many links, and who is on them

RADIO, WIFI = ("127.0.0.1", 1001), ("127.0.0.1", 1002)
HEARTBEAT = mavlink.MAVLink_heartbeat_message(2, 12, 81, 0x03040000, 3, 3)


def position_at(boot_s: float) -> mavlink.MAVLink_global_position_int_message:
    return mavlink.MAVLink_global_position_int_message(round(boot_s * 1e3), 473977418, 85455939, 490000, 0, 0, 0, 0, 0)


class Rig:
    """A station with two connections, and what it has said."""

    def __init__(self) -> None:
        self.said: list[str] = []
        self.station = Station(unix_us=lambda: 0, say=self.said.append)
        self.wires = {RADIO: Wire(), WIFI: Wire()}
        self._seqs: dict[tuple, int] = {}

    def hear(self, address: tuple[str, int], message, source: tuple[int, int] = (1, 1), skip: int = 0) -> None:
        seq = self._seqs[address, source] = (self._seqs.get((address, source), 0) + 1 + skip) % 256
        self.station.receive(self.wires[address], mav.frame_of(*source, message, seq), address)

    def answer_pings(self) -> None:
        """As an autopilot behind each connection does."""
        for address, wire in self.wires.items():
            for ping in [m for frame in wire.sent for m in Codec().parse(frame) if m.get_type() == "TIMESYNC"]:
                self.hear(address, mavlink.MAVLink_timesync_message(1, ping.ts1))
            wire.sent.clear()

    def sent_over(self, address: tuple[str, int]) -> int:
        self.station.send(mavlink.MAVLink_mission_set_current_message(1, 1, 0), 1)
        return len(self.wires[address].sent)


def test_a_vehicle_on_two_links_is_one_vehicle_and_is_reached_when_one_of_them_fails():
    async def play() -> None:
        rig = Rig()
        for tick in range(20):
            for address in (RADIO, WIFI):
                rig.hear(address, HEARTBEAT)
                rig.hear(address, position_at(100.0 + 0.1 * tick))
            await asyncio.sleep(0.1)
        assert rig.sent_over(RADIO) == 1
        for tick in range(40):
            rig.hear(WIFI, position_at(102.0 + 0.1 * tick))
            await asyncio.sleep(0.1)
        assert rig.sent_over(WIFI) == 1
        assert list(rig.station.fleet.vehicles) == [1]
        assert any("is reached by 127.0.0.1:1002 now" in text for text in rig.said)
        assert not any("two vehicles" in text for text in rig.said)

    virtual_time.run(play())


def test_a_link_that_loses_much_more_gives_way_to_one_that_does_not():
    async def play() -> None:
        rig = Rig()
        rig.hear(RADIO, HEARTBEAT)
        beating = asyncio.create_task(rig.station.send_heartbeats())
        for tick in range(60):
            rig.hear(RADIO, position_at(0.1 * tick), skip=2)
            rig.hear(WIFI, position_at(0.1 * tick))
            await asyncio.sleep(0.1)
            rig.answer_pings()
        beating.cancel()
        assert rig.sent_over(WIFI) == 1
        qualities = rig.station.routes.qualities(1, rig.station.now_s)
        losses = {way[1]: round(quality.loss, 1) for way, quality in qualities.items()}
        assert losses[RADIO] >= 0.6
        assert losses[WIFI] == 0.0

    virtual_time.run(play())


def test_a_path_that_answers_nothing_takes_over_from_none_that_is_heard():
    async def play() -> None:
        rig = Rig()
        for tick in range(60):
            rig.hear(RADIO, position_at(0.1 * tick), skip=2)
            rig.hear(WIFI, position_at(0.1 * tick))  # a stranger's, or one that carries nothing back
            await asyncio.sleep(0.1)
        assert rig.sent_over(RADIO) == 1
        for tick in range(20):
            rig.hear(WIFI, position_at(6.0 + 0.1 * tick))
            await asyncio.sleep(0.1)
        assert rig.sent_over(WIFI) == 1  # better than none

    virtual_time.run(play())


async def two_vehicles_with_one_id() -> Rig:
    rig = Rig()
    for tick in range(10):
        rig.hear(RADIO, HEARTBEAT)
        rig.hear(RADIO, position_at(100.0 + 0.1 * tick))
        if tick > 3:
            rig.hear(WIFI, HEARTBEAT)
            rig.hear(WIFI, position_at(7.0 + 0.1 * tick))
        await asyncio.sleep(0.1)
    return rig


def test_two_vehicles_with_one_system_id_are_told_apart_and_said():
    async def play() -> None:
        rig = await two_vehicles_with_one_id()
        (text,) = (text for text in rig.said if "two vehicles" in text)
        assert "127.0.0.1:1001 and from 127.0.0.1:1002" in text
        assert 100.0 < rig.station.vehicle(1).boot_time_s < 102.0  # the second one's telemetry is not mixed in
        assert rig.station.routes.ignored > 5

    virtual_time.run(play())


def test_an_ambiguous_vehicle_gets_no_orders_but_those_that_make_safe():
    async def play() -> None:
        rig = await two_vehicles_with_one_id()
        with pytest.raises(AmbiguousVehicle, match="vehicle 1: more than one vehicle uses this system id"):
            await rig.station.run(CommandClient(actions.arm(), (1, 1)))
        assert sum(len(wire.sent) for wire in rig.wires.values()) == 0
        holding = asyncio.create_task(rig.station.run(CommandClient(actions.set_mode(Mode.HOLD), (1, 1))))
        await asyncio.sleep(0.01)
        assert (len(rig.wires[RADIO].sent), len(rig.wires[WIFI].sent)) == (1, 0)
        holding.cancel()

    virtual_time.run(play())


def test_who_is_heard_over_several_paths_is_asked_for_its_hardware_id():
    async def play() -> None:
        rig = Rig()
        for address in (RADIO, WIFI):
            rig.hear(address, HEARTBEAT)
        beating = asyncio.create_task(rig.station.send_heartbeats())
        await asyncio.sleep(0.01)
        for address, uid in ((RADIO, 11), (WIFI, 22)):
            asked = [m for f in rig.wires[address].sent for m in Codec().parse(f) if m.get_type() == "COMMAND_LONG"]
            assert [(m.command, m.param1) for m in asked] == [(mavlink.MAV_CMD_REQUEST_MESSAGE, 148.0)]
            version = mavlink.MAVLink_autopilot_version_message(0, 0, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, uid)
            rig.hear(address, version)
        assert len(rig.station.routes.rivals(1, rig.station.now_s)) == 1
        beating.cancel()

    virtual_time.run(play())


def test_another_ground_station_is_said_once():
    async def play() -> None:
        rig = Rig()
        for _ in range(3):
            rig.hear(WIFI, mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), (254, 190))
            rig.hear(RADIO, mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), (255, 190))
        assert [text.split("(")[0].strip() for text in rig.said] == [
            "another ground station, 254/190, is on the link",
            "somebody at 127.0.0.1:1001 uses this ground station's ids 255/190",
        ]

    virtual_time.run(play())


def test_round_trips_are_measured_and_answers_to_questions_that_were_not_asked_count_for_nothing():
    async def play() -> None:
        rig = Rig()
        rig.hear(RADIO, HEARTBEAT)
        beating = asyncio.create_task(rig.station.send_heartbeats())
        await asyncio.sleep(0.08)
        (question,) = [m for f in rig.wires[RADIO].sent for m in Codec().parse(f) if m.get_type() == "TIMESYNC"]
        rig.hear(RADIO, mavlink.MAVLink_timesync_message(1, question.ts1 + 5))
        assert (quality := rig.station.quality(1)) is not None
        assert quality.round_trip_s is None
        rig.hear(RADIO, mavlink.MAVLink_timesync_message(1, question.ts1))
        assert (quality := rig.station.quality(1)) is not None
        assert quality.round_trip_s == pytest.approx(0.08)
        beating.cancel()

    virtual_time.run(play())


def test_a_newer_order_ends_the_repetitions_of_the_older_one():
    async def play() -> None:
        rig = Rig()
        rig.hear(RADIO, HEARTBEAT)
        landing = asyncio.create_task(rig.station.run(CommandClient(actions.set_mode(Mode.LAND), (1, 1))))
        await asyncio.sleep(0.01)
        holding = asyncio.create_task(rig.station.run(CommandClient(actions.set_mode(Mode.HOLD), (1, 1))))
        await asyncio.sleep(2.0)
        with pytest.raises(CommandRefused, match="land: replaced by a newer order, hold"):
            await landing
        modes = [m.param3 for f in rig.wires[RADIO].sent for m in Codec().parse(f)]
        assert modes == [6.0] + [3.0] * (len(modes) - 1)
        holding.cancel()

    virtual_time.run(play())


def test_requests_whose_answers_look_alike_take_turns():
    async def play() -> None:
        rig = Rig()
        rig.hear(RADIO, HEARTBEAT)
        orders = [actions.set_message_interval(number, 5.0) for number in (33, 31)]
        tasks = [asyncio.create_task(rig.station.run(CommandClient(order, (1, 1)))) for order in orders]
        await asyncio.sleep(0.01)
        assert len(rig.wires[RADIO].sent) == 1
        for _ in range(2):
            rig.hear(RADIO, mavlink.MAVLink_command_ack_message(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 0))
            await asyncio.sleep(0.01)
        assert all(task.done() for task in tasks)
        assert len(rig.wires[RADIO].sent) == 2

    virtual_time.run(play())


def test_a_cancelled_upload_tells_the_vehicle():
    async def play() -> None:
        rig = Rig()
        rig.hear(RADIO, HEARTBEAT)
        upload = asyncio.create_task(rig.station.run(VerifiedUpload([MissionItem(command=16)], (1, 1))))
        await asyncio.sleep(0.01)
        upload.cancel()
        await asyncio.sleep(0.01)
        sent = [m for f in rig.wires[RADIO].sent for m in Codec().parse(f)]
        assert [m.get_type() for m in sent] == ["MISSION_COUNT", "MISSION_ACK"]
        assert sent[1].type == mavlink.MAV_MISSION_OPERATION_CANCELLED

    virtual_time.run(play())


def test_a_flood_of_answers_that_nobody_waits_for_leaves_nothing_behind():
    async def play() -> None:
        rig = Rig()
        for sysid in range(1, 255):
            rig.hear(WIFI, HEARTBEAT, (sysid, 1))
        for address in range(2000, 2100):
            frame = mav.frame_of(1, 1, mavlink.MAVLink_command_ack_message(400, 0))
            rig.station.receive(rig.wires[WIFI], frame, ("10.0.0.1", address))
        assert len(rig.station.fleet.vehicles) == 254
        assert len(rig.station.routes.qualities(1, rig.station.now_s)) <= 8

    virtual_time.run(play())


def test_too_many_sentences_about_links_are_counted():
    async def play() -> None:
        rig = Rig()
        for number in range(100):
            rig.station.tell(f"sentence {number}")
        assert rig.said == [f"sentence {number}" for number in range(20)]
        await asyncio.sleep(11.0)
        rig.station.tell("later")
        assert rig.said[20:] == ["80 more sentences about the links were left out", "later"]

    virtual_time.run(play())


def test_what_goes_over_a_narrow_link_keeps_within_its_budget():
    async def play() -> None:
        rig = Rig()
        rig.wires[RADIO].budget_bytes_s = 1000.0
        rig.hear(RADIO, HEARTBEAT)
        begun_s = rig.station.now_s
        for seq in range(60):
            rig.station.send(mavlink.MAVLink_mission_request_int_message(1, 1, seq, 0), 1)
        await asyncio.sleep(0.5)
        assert sum(map(len, rig.wires[RADIO].sent)) <= 1000.0 * (rig.station.now_s - begun_s) + 350
        await asyncio.sleep(1.5)
        assert len(rig.wires[RADIO].sent) == 60

    virtual_time.run(play())


def test_a_companion_is_told_how_much_of_what_it_saw_is_heard():
    async def play() -> list[tuple[int, int, int, Receipt]]:
        rig = Rig()
        rig.hear(RADIO, HEARTBEAT)
        status = encode_status(CompanionStatus(state=CompanionState.FLYING, time_boot_ms=4200))
        rig.hear(RADIO, tunnel_message(PayloadType.COMPANION_STATUS, status), (1, 191))
        for _ in range(3):
            rig.hear(RADIO, tunnel_message(PayloadType.OCCUPANCY, bytes(80)), (1, 191))
        await asyncio.sleep(0.25)
        rig.wires[RADIO].sent.clear()
        beating = asyncio.create_task(rig.station.send_heartbeats())
        await asyncio.sleep(0.1)
        beating.cancel()
        told = [m for frame in rig.wires[RADIO].sent for m in Codec().parse(frame) if m.get_type() == "TUNNEL"]
        return [
            (m.target_system, m.target_component, m.payload_type, decode_receipt(bytes(m.payload[: m.payload_length])))
            for m in told
        ]

    receipt = Receipt(heard=3, time_boot_ms=4200, age_s=0.25)
    assert virtual_time.run(play()) == [(1, 191, PayloadType.RECEIPT, receipt)]


def tunnel_message(kind: PayloadType, payload: bytes) -> mavlink.MAVLink_tunnel_message:
    return mavlink.MAVLink_tunnel_message(0, 0, kind, len(payload), list(payload.ljust(128, b"\0")))


async def arrives_after_standstill(stands_still_s: float, later_s: float) -> bool:
    """Whether what comes so much after the station itself stood still has come in time."""
    loop, arrived = asyncio.get_running_loop(), list[bool]()

    def stand_still() -> None:
        time.sleep(stands_still_s)
        loop.call_later(later_s, arrived.append, True)

    loop.call_later(0.05, stand_still)
    return await Station().holds_within(lambda: bool(arrived), 0.5)


def test_time_in_which_the_station_itself_stood_still_is_nobody_elses_delay():
    assert asyncio.run(arrives_after_standstill(1.5, later_s=0.1))
    assert not asyncio.run(arrives_after_standstill(1.5, later_s=2.0))
