"""Frames: the mission's ENU, the earth, and each autopilot's own NED."""

import numpy as np
import pymap3d
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymap3d.vincenty import vdist
from scipy.spatial.transform import Rotation

from missions.frames import (
    PX4_EARTH_RADIUS_M,
    AutopilotFrame,
    GeodeticPoint,
    LocalFrame,
    quaternion_enu_from_flu,
    swap_enu_ned,
)

ORIGIN = GeodeticPoint(latitude_deg=47.3977432, longitude_deg=8.5455942, altitude_amsl_m=489.4)

metres = st.floats(-2500.0, 2500.0)
points = st.tuples(metres, metres, st.floats(-100.0, 1000.0))


def on_px4s_sphere(latitude_deg: float, longitude_deg: float, origin: GeodeticPoint) -> tuple[float, float]:
    """(north, east) [m] by distance and bearing on a great circle: PX4's azimuthal equidistant projection."""
    sphere = pymap3d.Ellipsoid(PX4_EARTH_RADIUS_M, PX4_EARTH_RADIUS_M)
    away_m, azimuth_deg = vdist(origin.latitude_deg, origin.longitude_deg, latitude_deg, longitude_deg, ell=sphere)
    return away_m * np.cos(np.radians(azimuth_deg)), away_m * np.sin(np.radians(azimuth_deg))


@given(point=points)
def test_enu_to_earth_and_back_is_the_same_point(point: tuple[float, float, float]):
    frame = LocalFrame(ORIGIN)
    back = frame.enu(*frame.geodetic_arrays(np.array(point)))
    np.testing.assert_allclose(back, point, atol=1e-6)


@given(point=points, north=st.floats(-50, 50), east=st.floats(-50, 50), offset=st.floats(-1, 1))
def test_enu_to_an_autopilots_ned_and_back_is_the_same_point(
    point: tuple[float, float, float], north: float, east: float, offset: float
):
    mission = LocalFrame(ORIGIN)
    frame = AutopilotFrame(mission.geodetic(np.array([east, north, 0.3])), mission, offset)
    np.testing.assert_allclose(frame.enu(frame.ned(np.array(point))), point, atol=1e-4)


def test_an_autopilots_ned_is_px4s_own_projection():
    mission = LocalFrame(ORIGIN)
    vehicle_origin = GeodeticPoint(latitude_deg=47.3978, longitude_deg=8.5456, altitude_amsl_m=490.2)
    place = mission.geodetic(np.array([1500.0, -900.0, 120.0]))
    ned = AutopilotFrame(vehicle_origin, mission).ned(np.array([1500.0, -900.0, 120.0]))
    expected = on_px4s_sphere(place.latitude_deg, place.longitude_deg, vehicle_origin)
    np.testing.assert_allclose(ned[:2], expected, atol=1e-3)
    assert ned[2] == pytest.approx(490.2 - place.altitude_amsl_m, abs=1e-6)


def test_two_vehicles_with_different_origins_disagree_on_ned_but_not_on_enu():
    mission = LocalFrame(ORIGIN)
    one = AutopilotFrame(mission.geodetic(np.array([1.0, 6.5, 0.0])), mission)
    other = AutopilotFrame(mission.geodetic(np.array([1.0, 8.5, 0.4])), mission)
    point = np.array([10.0, 7.0, 1.5])
    assert np.linalg.norm(one.ned(point) - other.ned(point)) > 1.9
    np.testing.assert_allclose(one.enu(one.ned(point)), other.enu(other.ned(point)), atol=1e-6)


def test_a_ground_offset_is_what_the_altitude_reads_too_high():
    mission = LocalFrame(ORIGIN)
    on_the_pad = AutopilotFrame(ORIGIN, mission, ground_offset_m=0.8)
    reading_ned = np.array([0.0, 0.0, -0.8])  # it says 0.8 m up and stands on the ground
    np.testing.assert_allclose(on_the_pad.enu(reading_ned), [0.0, 0.0, 0.0], atol=1e-6)


def test_the_swap_of_axes_is_its_own_inverse_and_turns_east_into_the_second_axis():
    np.testing.assert_array_equal(swap_enu_ned(np.array([1.0, 0.0, 0.0])), [0.0, 1.0, 0.0])
    vectors = np.arange(12.0).reshape(4, 3)
    np.testing.assert_array_equal(swap_enu_ned(swap_enu_ned(vectors)), vectors)


def axes_of(quaternion_ned_frd: np.ndarray) -> np.ndarray:
    """(3, 3) the body's nose, left side and top in ENU, as columns, by the quaternion for drawing."""
    w, x, y, z = quaternion_enu_from_flu(quaternion_ned_frd)
    return Rotation.from_quat([x, y, z, w]).as_matrix()


def test_a_level_body_heading_east_points_its_nose_east_and_its_left_side_north():
    yaw_east = np.array([np.cos(np.pi / 4), 0.0, 0.0, np.sin(np.pi / 4)])
    np.testing.assert_allclose(axes_of(yaw_east), np.eye(3), atol=1e-12)


def test_a_body_that_pitches_up_lifts_its_nose():
    pitch_up = np.array([np.cos(0.1), 0.0, np.sin(0.1), 0.0])  # 0.2 rad about the right-hand axis
    assert axes_of(pitch_up)[2, 0] == pytest.approx(np.sin(0.2))


def test_the_quaternion_for_drawing_is_the_rotation_from_the_body_to_enu():
    for w, x, y, z in np.random.default_rng(1).normal(size=(20, 4)):
        ned_from_frd = Rotation.from_quat([x, y, z, w]).as_matrix()
        enu_from_flu = swap_enu_ned((ned_from_frd * np.array([1.0, -1.0, -1.0])).T).T
        np.testing.assert_allclose(axes_of(np.array([w, x, y, z])), enu_from_flu, atol=1e-12)
