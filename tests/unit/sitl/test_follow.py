"""Follow: a vehicle stays on its side of somebody who walks, at its distance and height, and looks there."""

import math

import numpy as np
import pytest

from sitl.dialect import mavlink
from sitl.microservices.outbox import Link
from tests.unit.sitl.flown import NAN, Flown, place

WALK_M_S = 2.0


def follow_target(north_m: float, east_m: float, velocity: tuple[float, float, float], up_m: float = 0.0):
    x, y = place(north_m, east_m)
    attitude, zeros = [1.0, 0.0, 0.0, 0.0], [0.0] * 3
    return mavlink.MAVLink_follow_target_message(0, 3, x, y, 489.4 + up_m, velocity, zeros, attitude, zeros, zeros, 0)


def walk(flown: Flown, duration_s: int, *, begin_m: float = 0.0, heard_as: Link = Link.ONBOARD) -> float:
    """Somebody walks north and says so once a second; how far north it is in the end."""
    for second in range(duration_s):
        flown.send(follow_target(begin_m + WALK_M_S * second, 10.0, (WALK_M_S, 0.0, 0.0)), link=heard_as)
        flown.run(1.0)
    return begin_m + WALK_M_S * duration_s


def following(parameters: dict[str, float] | None = None) -> Flown:
    flown = Flown().take_off(4.0)
    for name, value in (parameters or {}).items():
        flown.set_parameter(name, value)
    assert flown.command(176, 1, 4, 8) == 0
    return flown


@pytest.mark.parametrize(("angle_deg", "away"), [(180.0, (0.0, -8.0)), (90.0, (8.0, 0.0))])
def test_it_stays_on_its_side_at_its_distance_and_looks_at_the_target(angle_deg, away):
    flown = following({"FLW_TGT_FA": angle_deg})
    target = np.array([10.0, walk(flown, 20)])
    assert np.allclose(flown.position[:2], target + away, atol=0.8)
    assert flown.velocity[1] == pytest.approx(WALK_M_S, abs=0.3)
    assert flown.height == pytest.approx(8.0, abs=0.3)
    east, north = target - flown.position[:2]
    assert abs(math.remainder(flown.autopilot.snapshot.yaw_rad - math.atan2(east, north), 2 * math.pi)) < 0.2
    flown.run(0.5)
    heartbeat = flown.last("HEARTBEAT")
    assert (heartbeat.custom_mode, heartbeat.base_mode) == (0x08040000, 17 | 128)


def test_a_target_that_falls_silent_is_waited_for():
    flown = following()
    walk(flown, 10)
    flown.run(12.0)
    assert np.linalg.norm(flown.velocity) < 0.2
    assert flown.mode == "FOLLOW"


def test_height_can_be_kept_above_the_target():
    flown = following({"FLW_TGT_ALT_M": 2, "FLW_TGT_HT": 3.0})
    for _ in range(10):
        flown.send(follow_target(5.0, 0.0, (NAN, NAN, NAN), up_m=6.0))
        flown.run(1.0)
    assert flown.height == pytest.approx(9.0, abs=0.3)
    assert np.hypot(flown.position[0], flown.position[1] - 5.0) == pytest.approx(8.0, abs=0.4)


def test_places_that_are_none_are_not_followed():
    flown = following()
    before = flown.position.copy()
    flown.send(follow_target(0.0, 0.0, (0.0, 0.0, 0.0), up_m=NAN))
    flown.run(3.0)
    assert np.allclose(flown.position, before, atol=0.3)
