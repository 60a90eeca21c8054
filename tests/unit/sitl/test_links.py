"""Forwarding, streams, clocks, and the faults of the ground link."""

from collections import Counter

import numpy as np
import pytest

from missions.mission import Blackout, LinkSettings
from sitl.dialect import mavlink
from sitl.link.faulty_link import Direction, FaultyLink
from sitl.microservices.outbox import Link
from sitl.wire import LAYOUTS
from tests.unit.sitl.flown import COMPANION, GCS, Flown, field

NAMES = {layout.id_bytes: name for name, layout in LAYOUTS.items()}
HEARTBEATS = {
    GCS: mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3),
    COMPANION: mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3),
}


def both_heard() -> Flown:
    """A vehicle that knows its ground station and its companion."""
    flown = Flown().boot()
    flown.send(HEARTBEATS[GCS])
    flown.send(HEARTBEATS[COMPANION], link=Link.ONBOARD)
    flown.forget()
    return flown


def tunnel(target: tuple[int, int]):
    return mavlink.MAVLink_tunnel_message(*target, 0x8051, 3, [1, 2, 3] + [0] * 125)


# ------------------------------------------------------------------ forwarding
@pytest.mark.parametrize(
    ("message", "forwarded"),
    [
        (HEARTBEATS[COMPANION], True),
        (mavlink.MAVLink_obstacle_distance_message(0, 0, [1] * 72, 5, 1, 100), True),
        (tunnel((0, 0)), True),
        (tunnel(GCS), True),
        (tunnel((255, 0)), True),
        (tunnel((255, 7)), False),
        (tunnel((77, 1)), False),
        (tunnel((1, 1)), False),
        (tunnel((1, 191)), False),  # heard on the sender's own link only
    ],
)
def test_what_goes_on_to_the_ground(message, forwarded):
    flown = both_heard()
    flown.send(message, link=Link.ONBOARD)
    there = [frame for frame in flown.heard(Link.GROUND) if frame[6] == 191]
    assert bool(there) == forwarded


def test_frames_are_forwarded_to_the_byte():
    flown = both_heard()
    codec = mavlink.MAVLink(None, 1, 191)
    codec.seq = 77
    frame = tunnel((0, 0)).pack(codec)
    flown.simulator.receive(1, Link.ONBOARD, frame)
    assert (1, Link.GROUND, frame) in flown.simulator.transmissions()


def test_a_command_reaches_the_companion_and_its_answer_comes_back():
    flown = both_heard()
    flown.send(mavlink.MAVLink_command_long_message(1, 191, 300, 0, *[0] * 7))
    assert flown.last("COMMAND_LONG", link=Link.ONBOARD).target_component == 191
    assert not flown.messages("COMMAND_ACK")
    flown.send(mavlink.MAVLink_command_ack_message(300, 0, 0, 0, *GCS), link=Link.ONBOARD)
    assert flown.last("COMMAND_ACK").get_srcComponent() == 191


def test_sticks_go_from_the_ground_to_the_companion_and_not_back():
    flown = Flown().boot()
    sticks = mavlink.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0)
    for link in Link:
        flown.send(HEARTBEATS[GCS if link is Link.GROUND else COMPANION], link=link)
    for link in Link:
        flown.send(sticks, link=link)
    assert len(flown.messages("MANUAL_CONTROL", link=Link.ONBOARD)) == 1
    assert not flown.messages("MANUAL_CONTROL", link=Link.GROUND)


def test_a_companion_that_has_not_been_heard_gets_nothing():
    flown = Flown().boot()
    flown.send(mavlink.MAVLink_command_long_message(1, 191, 300, 0, *[0] * 7))
    assert not flown.messages("COMMAND_LONG", link=Link.ONBOARD)


def test_nobody_speaks_in_the_autopilots_name():
    flown = both_heard()
    flown.send(HEARTBEATS[COMPANION], link=Link.ONBOARD, source=(1, 1))
    assert not [m for m in flown.messages("HEARTBEAT") if m.type == 18]


def test_broadcasts_to_the_vehicle_reach_the_companion_too():
    flown = both_heard()
    flown.send(mavlink.MAVLink_command_long_message(1, 0, 401, 0, *[0] * 7))
    flown.run(0.02)
    assert flown.messages("COMMAND_LONG", link=Link.ONBOARD)
    assert flown.last("COMMAND_ACK").result == 0


# --------------------------------------------------------------------- streams
def rates(flown: Flown, link: Link, duration_s: float = 20.0) -> Counter:
    flown.forget()
    flown.run(duration_s)
    kinds = Counter(frame[7:10] for frame in flown.heard(link))
    return Counter({NAMES[kind]: n / duration_s for kind, n in kinds.items()})


def test_default_streams_are_px4s_at_lower_rates():
    flown = Flown().take_off(3.0)
    ground, onboard = rates(flown, Link.GROUND), rates(flown, Link.ONBOARD)
    assert 50 < sum(ground.values()) < 70
    assert 180 < sum(onboard.values()) < 220
    assert ground["HEARTBEAT"] == onboard["HEARTBEAT"] == 1.0
    assert onboard["ODOMETRY"] == pytest.approx(30.0, abs=0.5)
    assert onboard["ATTITUDE"] == 50.0


def test_intervals_are_set_per_link_and_back_to_their_default():
    flown = Flown().boot()
    attitude = mavlink.MAVLINK_MSG_ID_ATTITUDE
    flown.command(511, attitude, 20_000)
    assert rates(flown, Link.GROUND, 4.0)["ATTITUDE"] == 50.0
    flown.command(511, attitude, -1)
    assert rates(flown, Link.GROUND, 4.0)["ATTITUDE"] == 0.0
    flown.command(511, attitude, 0)
    assert rates(flown, Link.GROUND, 4.0)["ATTITUDE"] == 10.0
    flown.command(511, attitude, 1)  # faster than there is anything new
    assert rates(flown, Link.GROUND, 4.0)["ATTITUDE"] == 50.0
    assert rates(flown, Link.ONBOARD, 4.0)["ATTITUDE"] == 50.0


def test_no_message_comes_twice_for_one_moment():
    flown = Flown().boot()
    flown.command(511, mavlink.MAVLINK_MSG_ID_ATTITUDE, 20_000)
    flown.run(1.0)
    times = [m.time_boot_ms for m in flown.messages("ATTITUDE")]
    assert len(times) == len(set(times))


@pytest.mark.parametrize(("interval_us", "shown"), [(200_000, 200_000), (-1, -1), (0, 1_000_000)])
def test_intervals_can_be_read(interval_us, shown):
    flown = Flown().boot()
    flown.command(511, 42, interval_us)
    flown.command(510, 42)
    assert flown.last("MESSAGE_INTERVAL").interval_us == shown


def test_odometry_is_px4s_local_frame_on_the_boot_clock():
    flown = Flown().take_off(3.0)
    odometry = flown.last("ODOMETRY", link=Link.ONBOARD)
    assert (odometry.frame_id, odometry.child_frame_id) == (1, 1)
    assert odometry.time_usec == pytest.approx(flown.time_s * 1e6, abs=40_000)
    assert odometry.z == pytest.approx(-flown.height, abs=0.05)


def test_utc_advances_with_simulated_time():
    flown = Flown(speed=5.0).run(3.0)
    first, *_, last = flown.messages("SYSTEM_TIME")
    assert (last.time_unix_usec - first.time_unix_usec) / 1e3 == last.time_boot_ms - first.time_boot_ms


def test_clock_requests_are_answered_at_once():
    flown = Flown().boot()
    flown.forget()
    flown.send(mavlink.MAVLink_timesync_message(0, 1234))
    answer = flown.last("TIMESYNC")
    assert (answer.ts1, answer.tc1) == (1234, round(flown.time_s * 1e9))
    flown.send(mavlink.MAVLink_ping_message(99, 7, 0, 0))
    ping = flown.last("PING")
    assert (ping.time_usec, ping.seq, ping.target_system, ping.target_component) == (99, 7, *GCS)


def test_home_is_known_after_boot_and_moves_with_arming():
    flown = Flown().run(2.5)
    assert flown.last("HOME_POSITION").altitude == pytest.approx(489_400, abs=1)


# ---------------------------------------------------------------- ground link
def sent(settings: LinkSettings, n: int = 2000, since_takeoff_s: float | None = None) -> tuple[FaultyLink, list[bytes]]:
    link = FaultyLink(settings, np.random.default_rng(1))
    for i in range(n):
        link.send(Direction.UP, i.to_bytes(2, "little"), 0.0, since_takeoff_s)
    return link, link.arrived(Direction.UP, 10.0)


def test_a_perfect_link_passes_everything_in_order():
    _, arrived = sent(LinkSettings())
    assert [int.from_bytes(d, "little") for d in arrived] == list(range(2000))


def test_losses_are_as_many_as_ordered_and_the_same_for_one_seed():
    link, arrived = sent(LinkSettings(loss=0.3))
    assert link.lost / link.sent == pytest.approx(0.3, abs=0.03)
    assert arrived == sent(LinkSettings(loss=0.3))[1]


def test_delays_hold_datagrams_back():
    link = FaultyLink(LinkSettings(delay_s=0.1, jitter_s=0.05), np.random.default_rng(1))
    for _ in range(100):
        link.send(Direction.DOWN, b"x", 1.0, None)
    assert link.arrived(Direction.DOWN, 1.099) == []
    assert 20 < len(link.arrived(Direction.DOWN, 1.125)) < 80
    assert link.arrived(Direction.UP, 2.0) == []
    link.arrived(Direction.DOWN, 1.151)
    assert link.arrived(Direction.DOWN, 9.9) == []


@pytest.mark.parametrize(
    ("since_takeoff_s", "passes"), [(None, True), (1.9, True), (2.0, False), (4.9, False), (5.0, True)]
)
def test_blackouts_count_from_the_first_take_off(since_takeoff_s, passes):
    settings = LinkSettings(blackouts=(Blackout(from_s=2.0, duration_s=3.0),))
    assert bool(sent(settings, 3, since_takeoff_s)[1]) == passes


def test_a_blackout_cuts_the_ground_but_not_the_companion():
    flown = Flown(field(ground_link=LinkSettings(blackouts=(Blackout(from_s=1.0, duration_s=8.0),)))).boot()
    flown.command(22, *[float("nan")] * 7)
    flown.command(400, 1)
    flown.until(lambda: flown.height > 0.05, 8.0)
    flown.run(2.0)
    flown.forget()
    flown.run(4.0)
    assert not flown.heard(Link.GROUND)
    assert flown.heard(Link.ONBOARD)
    assert flown.command(21) is None  # nothing goes up, either
    flown.run(4.0)
    assert flown.heard(Link.GROUND)


def test_on_a_bad_link_a_command_may_need_a_second_try():
    flown = Flown(field(ground_link=LinkSettings(loss=0.7, delay_s=0.05)), seed=7).boot()
    tries = 0
    while not flown.messages("COMMAND_ACK"):
        flown.command(401, confirmation=min(tries, 255))
        flown.run(0.3)
        tries += 1
    assert 1 < tries < 30
