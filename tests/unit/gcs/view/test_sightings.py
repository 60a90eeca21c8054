"""Where the vehicles are drawn."""

import numpy as np

from gcs.flight.trails import Trails
from gcs.view.colours import PALETTE
from gcs.view.sightings import sightings, vehicle_names
from missions.frames import GeodeticPoint, LocalFrame
from tests.unit.gcs.view.desks import make_desk


async def test_vehicles_are_seen_where_they_say_they_are_less_their_ground_offset():
    desk = await make_desk()
    assert desk.flight is not None
    desk.flight.vehicles[2].monitor.ground_offset_m = 0.5
    alpha, bravo = sightings(desk)
    assert (alpha.name, bravo.name) == ("alpha", "bravo")
    assert (alpha.colour, bravo.colour) == PALETTE[:2]
    np.testing.assert_allclose(alpha.position_m, [1.0, 6.5, 0.0], atol=1e-3)
    np.testing.assert_allclose(bravo.position_m, [1.0, 8.5, -0.5], atol=1e-3)


async def test_a_vehicle_without_a_place_is_not_drawn_and_keeps_its_name_and_colour():
    desk = await make_desk()
    desk.vehicles[1].place = None
    (bravo,) = sightings(desk)
    assert (bravo.name, bravo.colour) == ("bravo", PALETTE[1])


async def test_vehicles_that_are_not_of_the_mission_come_after_those_that_are():
    desk = await make_desk(heard=(1,))
    desk.vehicles[9] = desk.vehicles[1]
    assert list(vehicle_names(desk).items()) == [(1, "alpha"), (2, "bravo"), (9, "vehicle 9")]


async def test_without_a_mission_nothing_is_drawn_before_there_is_a_frame():
    desk = await make_desk(None, heard=(4,))
    home = GeodeticPoint(latitude_deg=47.0, longitude_deg=8.0, altitude_amsl_m=400.0)
    desk.vehicles[4].place = home
    assert len(sightings(desk)) == 0
    desk.trails = Trails(LocalFrame(home))
    (vehicle,) = sightings(desk)
    assert vehicle.name == "vehicle 4"
    np.testing.assert_allclose(vehicle.position_m, np.zeros(3), atol=1e-6)


async def test_a_moved_mission_is_drawn_in_its_new_frame():
    desk = await make_desk(heard=(1,))
    place = desk.vehicles[1].place
    assert place is not None
    desk.trails = Trails(LocalFrame(place))
    np.testing.assert_allclose(sightings(desk)[0].position_m, np.zeros(3), atol=1e-6)
