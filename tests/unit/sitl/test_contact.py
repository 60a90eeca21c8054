"""What vehicles touch: landings are gentle, collisions are recorded, and whoever collides falls."""

import numpy as np
import pytest

from missions.world import Bounds, Box, Cylinder, Mover, Peak, Threat, World
from sitl.dynamics.state import Crash
from tests.unit.sitl.flown import Flown, field

BOUNDS = Bounds(east_m=(-500, 500), north_m=(-500, 500), up_m=(0, 400))


def world(**things) -> World:
    return World(bounds=BOUNDS, **things)


def flown_north(things: dict, speed_m_s: float = 2.0, duration_s: float = 6.0, height_m: float = 3.0) -> Flown:
    """A vehicle that hovers at the origin and then flies north without looking."""
    flown = Flown(field(world=world(**things))).take_off(height_m)
    flown.stream(velocity=(speed_m_s, 0.0, 0.0)).offboard()
    return flown.run(duration_s)


def test_a_box_in_the_way_is_hit_at_its_face_by_the_body():
    flown = flown_north({"boxes": (Box(name="wall", centre_m=(0, 8, 5), half_m=(5, 1, 5)),)})
    (collision,) = flown.simulator.collisions
    assert (collision.what, collision.sysid) == (Crash.OBSTACLE, 1)
    assert collision.position_enu_m[1] == pytest.approx(
        8.0 - 1.0 - 0.2, abs=0.02
    )  # half a metre of wall, a body radius
    assert flown.simulator.truth.crashed.tolist() == [True]


def test_an_unknown_obstacle_is_as_hard_as_a_known_one():
    flown = flown_north({"cylinders": (Cylinder(name="pole", centre_m=(0, 5), radius_m=0.5, top_m=9, known=False),)})
    assert [collision.what for collision in flown.simulator.collisions] == [Crash.OBSTACLE]


def test_a_vehicle_that_has_collided_falls_to_the_ground_and_is_disarmed():
    flown = flown_north({"boxes": (Box(name="wall", centre_m=(0, 8, 5), half_m=(5, 1, 5)),)}, duration_s=8.0)
    assert flown.height == pytest.approx(0.0, abs=0.01)
    assert not flown.armed
    assert "Collision: rotors lost" in flown.texts
    assert flown.messages("STATUSTEXT")[-1].severity in (2, 6)
    assert flown.command(400, 1) == 1  # and does not arm again
    assert len(flown.simulator.collisions) == 1


def test_it_comes_to_rest_on_top_of_what_it_falls_onto():
    table = Box(name="table", centre_m=(0, 10, 0.5), half_m=(5, 5, 0.5))
    mast = Cylinder(name="mast", centre_m=(0, 9), radius_m=0.5, top_m=9.0)
    flown = flown_north({"boxes": (table,), "cylinders": (mast,)}, duration_s=10.0)
    assert 0.9 < flown.height < 1.1


def test_threats_are_felt_by_nobody():
    flown = flown_north({"threats": (Threat(name="radar", centre_m=(0, 5), radius_m=4.0),)})
    assert flown.simulator.collisions == []


def test_a_ball_that_moves_hits_whoever_hovers_in_its_way():
    ball = Mover(name="ball", from_m=(0, 30, 3), to_m=(0, -30, 3), radius_m=0.5, speed_m_s=1.5)
    flown = Flown(field(world=world(movers=(ball,)))).take_off(3.0)
    flown.until(lambda: bool(flown.simulator.collisions), 60.0)
    (collision,) = flown.simulator.collisions
    assert (collision.what, collision.other) == (Crash.MOVER, "ball")


def test_two_vehicles_that_meet_both_fall():
    flown = Flown(field(2)).take_off(3.0)
    flown.take_off(3.0, sysid=2)
    flown.stream(velocity=(0.0, 1.5, 0.0), yaw=0.0).offboard()
    flown.run(4.0)
    assert {(c.sysid, c.what, c.other) for c in flown.simulator.collisions} == {
        (1, Crash.VEHICLE, "2"),
        (2, Crash.VEHICLE, "1"),
    }


def test_a_gentle_landing_is_no_collision():
    flown = Flown().take_off(3.0)
    flown.command(21)
    flown.until(lambda: not flown.armed, 40.0)
    assert flown.simulator.collisions == []
    assert abs(flown.height) < 0.01


def test_motors_stopped_in_the_air_end_in_a_hard_landing_after_which_it_flies_again():
    flown = Flown().take_off(8.0)
    assert flown.command(400, 0, 21196) == 0
    flown.until(lambda: bool(flown.simulator.collisions), 5.0)
    assert flown.simulator.collisions[0].what is Crash.GROUND
    assert "Hard landing" in flown.run(1.0).texts
    assert flown.take_off(3.0).height > 2.0


def test_a_mountain_is_ground_that_can_be_landed_on_and_flown_into():
    hill = Peak(name="hill", centre_m=(0, 60), radius_m=60, height_m=30)
    hit = flown_north({"peaks": (hill,)}, speed_m_s=6.0, duration_s=20.0)
    assert [collision.what for collision in hit.simulator.collisions] == [Crash.TERRAIN]
    landed = Flown(field(world=world(peaks=(hill,)))).take_off(20.0)
    landed.stream(position=(25.0, 0.0, -20.0)).offboard()
    landed.run(15.0).go_silent()
    landed.command(21)
    landed.until(lambda: not landed.armed, 60.0)
    assert landed.simulator.collisions == []
    assert landed.height > 1.0


def test_the_truth_stays_finite_through_a_crash():
    flown = flown_north(
        {"boxes": (Box(name="wall", centre_m=(0, 8, 5), half_m=(5, 1, 5)),)}, speed_m_s=5.0, duration_s=9.0
    )
    truth = flown.simulator.truth
    assert np.isfinite(truth.position_enu_m).all()
    assert np.isfinite(truth.attitude_ned_frd).all()
