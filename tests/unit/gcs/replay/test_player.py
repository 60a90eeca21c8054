"""Playing: at any speed, paused, and from any moment on, the state is that of the flight at that moment."""

import numpy as np
import pytest

from gcs.errors import UsageError
from gcs.fleet.fleet import Fleet
from gcs.replay import player as module
from gcs.replay.player import Player
from missions.tunnel import CompanionState
from tests.unit.gcs.replay.flights import flight, parsed

RECORDING = parsed(flight(60.0))


def shown(fleet: Fleet) -> dict[int, tuple]:
    """What a page shows of each vehicle."""
    return {
        sysid: (
            state.armed, state.mode, state.place, state.place_s, state.heard_s, state.telemetry_s, state.boot_time_s,
            tuple(state.velocity_enu_m_s), state.companion.status, state.companion.heard_s,
            tuple(said.text for said in state.texts),
        )
        for sysid, state in fleet.vehicles.items()
    }  # fmt: skip


def played_to(position_s: float) -> Player:
    player = Player(RECORDING)
    player.play()
    for step in range(round(position_s / 0.05) + 1):
        player.advance(1000.0 + step * 0.05)
    return player


def test_a_player_stands_at_the_beginning():
    player = Player(RECORDING)
    assert (player.position_s, player.duration_s, player.playing, player.fleet.vehicles.keys()) == (
        0,
        60,
        False,
        {1, 2},
    )
    player.advance(1.0)
    player.advance(100.0)
    assert player.position_s == 0.0


@pytest.mark.parametrize("position_s", [0.0, 5.0, 12.35, 33.3, 59.95])
def test_seeking_leads_to_the_same_state_as_playing(position_s: float):
    played, sought = played_to(position_s), Player(RECORDING)
    sought.seek(played.position_s)
    assert played.position_s == pytest.approx(position_s, abs=0.06)
    assert shown(sought.fleet) == shown(played.fleet)
    state = sought.fleet.vehicles[2]
    assert state.armed == (position_s >= 10.0)
    assert state.companion.status is not None
    assert (state.companion.status.state is CompanionState.FLYING) == (position_s >= 20.0)


def test_seeking_back_brings_the_past_back():
    player = played_to(40.0)
    player.seek(3.0)
    assert not player.fleet.vehicles[1].armed
    assert shown(player.fleet) == shown(played_to(3.0).fleet)


def test_after_a_jump_playing_goes_on_from_there():
    player = Player(RECORDING)
    player.seek(30.0)
    player.play()
    for step in range(101):
        player.advance(step * 0.05)
    assert player.position_s == pytest.approx(35.0)
    sought = Player(RECORDING)
    sought.seek(player.position_s)
    assert shown(player.fleet) == shown(sought.fleet)


@pytest.mark.parametrize("speed", [0.1, 0.5, 2.0, 10.0])
def test_speed_is_recorded_seconds_per_second(speed: float):
    player = Player(RECORDING)
    player.set_speed(speed)
    player.play()
    for step in range(101):
        player.advance(step * 0.05)
    assert player.position_s == pytest.approx(5.0 * speed)


def test_a_pause_takes_no_recorded_time():
    player = played_to(10.0)
    player.pause()
    player.advance(1020.0)
    player.play()
    player.advance(1050.0)
    player.advance(1051.0)
    assert player.position_s == pytest.approx(11.0, abs=0.06)


def test_at_its_end_it_stops_and_play_begins_anew():
    player = Player(RECORDING)
    player.seek(59.0)
    player.play()
    player.advance(0.0)
    player.advance(10.0)
    assert (player.position_s, player.playing, player.at_end) == (60.0, False, True)
    player.play()
    assert (player.position_s, player.playing) == (0.0, True)


def test_positions_outside_are_moved_into_the_recording():
    player = Player(RECORDING)
    player.seek(1e9)
    assert player.position_s == 60.0
    player.seek(-5.0)
    assert player.position_s == 0.0


@pytest.mark.parametrize("speed", [0.0, -1.0, 0.05, 101.0, float("nan"), float("inf")])
def test_a_speed_that_is_none_is_refused(speed: float):
    with pytest.raises(UsageError, match="expected 0.1 to 100"):
        Player(RECORDING).set_speed(speed)


def test_large_steps_are_sought_not_played(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(module, "MOST_MESSAGES_AT_ONCE", 50)
    player = Player(RECORDING)
    player.set_speed(100.0)
    player.play()
    for step in range(5):
        player.advance(step * 0.1)
    assert shown(player.fleet) == shown(played_to(player.position_s).fleet)


def test_listeners_hear_of_jumps_alone():
    heard: list[float] = []
    player = Player(RECORDING)
    player.on_seek.append(lambda: heard.append(player.position_s))
    player.play()
    for step in range(20):
        player.advance(step * 0.05)
    player.seek(30.0)
    assert heard == [30.0]


def test_a_seek_in_a_long_recording_is_fast():
    """Judged by what it decodes, not by the clock: a second's worth of messages, and one of each kind."""
    recording = parsed(flight(1200.0, vehicles=3))
    for position_s in np.linspace(1.0, 1200.0, 7):
        assert len(recording.state_at(position_s)) <= 3 * (14 + 50 + 8)
