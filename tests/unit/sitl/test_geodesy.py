"""Compiled places on earth equal those of `missions.frames`, from a metre to kilometres away."""

import math

import numpy as np
import pytest

from missions.frames import AutopilotFrame, GeodeticPoint, LocalFrame, swap_enu_ned
from sitl import geodesy
from sitl.autopilot.places import GlobalPoint, LocalPoint, OwnFrame

ZURICH = GeodeticPoint(latitude_deg=47.3977432, longitude_deg=8.5455942, altitude_amsl_m=489.4)
QUITO = GeodeticPoint(latitude_deg=-0.18, longitude_deg=-78.47, altitude_amsl_m=2850.0)


def points(span_m: float) -> np.ndarray:
    return np.random.default_rng(1).uniform(-span_m, span_m, size=(40, 3))


@pytest.mark.parametrize("origin", [ZURICH, QUITO])
@pytest.mark.parametrize("span_m", [10.0, 5000.0])
def test_geodetic_places_equal_pymap3ds(origin, span_m):
    frame, plane = LocalFrame(origin), geodesy.mission_origin(origin)
    for enu in points(span_m):
        latitude, longitude, altitude = geodesy.geodetic(swap_enu_ned(enu), plane)
        expected = frame.geodetic_arrays(enu)
        assert math.degrees(latitude) == pytest.approx(float(expected[0]), abs=1e-11)
        assert math.degrees(longitude) == pytest.approx(float(expected[1]), abs=1e-11)
        assert altitude == pytest.approx(float(expected[2]), abs=1e-6)


@pytest.mark.parametrize("span_m", [10.0, 2000.0])
def test_an_autopilots_frame_is_the_one_that_companions_convert_with(span_m):
    frame = LocalFrame(ZURICH)
    here = frame.geodetic(np.array([40.0, -30.0, 0.5]))
    theirs = AutopilotFrame(here, frame, ground_offset_m=0.7)
    plane = geodesy.mission_origin(ZURICH)
    origin = math.radians(here.latitude_deg), math.radians(here.longitude_deg)
    for enu in points(span_m):
        latitude, longitude, altitude = geodesy.geodetic(swap_enu_ned(enu), plane)
        north, east = geodesy.project(latitude, longitude, *origin)
        ours = (north, east, here.altitude_amsl_m - altitude - 0.7)
        assert np.allclose(ours, theirs.ned(enu), atol=1e-3)


def test_reprojecting_undoes_projecting():
    origin = math.radians(47.4), math.radians(8.5)
    for north, east, _ in points(3000.0):
        place = geodesy.reproject(north, east, *origin)
        assert np.allclose(geodesy.project(*place, *origin), (north, east), atol=1e-6)
    assert geodesy.reproject(0.0, 0.0, *origin) == origin


def test_an_own_frame_goes_there_and_back():
    frame = OwnFrame(GlobalPoint(47.4, 8.5, 400.0))
    point = LocalPoint(12.0, -7.0, -30.0)
    place = frame.on_earth(point)
    assert place.altitude_m == 430.0
    assert np.allclose(frame.local(*place), point, atol=1e-6)
