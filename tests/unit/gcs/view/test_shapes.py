"""Meshes are closed and face outwards, lines lie where they should."""

import numpy as np
import pytest

from gcs.view import shapes
from gcs.view.ground_text import letters, written
from missions.mission import load_mission
from missions.obstacles import pack, terrain_height
from missions.world import Box, Cylinder

BOX = Box(name="crate", centre_m=(7.0, 7.0, 2.0), half_m=(0.75, 1.5, 2.0))
CYLINDER = Cylinder(name="column", centre_m=(13.0, 8.0), radius_m=1.0, top_m=3.0)
TERRAIN = load_mission("terrain-1-5uav").world


def volume(mesh: shapes.Mesh) -> float:
    """Of the body inside a closed mesh; negative if its faces look inwards."""
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def is_closed(mesh: shapes.Mesh) -> bool:
    """Every edge belongs to two faces, which run along it in opposite directions."""
    edges = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])
    there = {tuple(edge) for edge in edges.tolist()}
    return len(there) == len(edges) and all((end, start) in there for start, end in there)


def test_boxes_and_cylinders_enclose_their_volume():
    box, cylinder = shapes.box_mesh(BOX), shapes.cylinder_mesh(CYLINDER, segments=256)
    assert is_closed(box)
    assert is_closed(cylinder)
    assert volume(box) == pytest.approx(1.5 * 3.0 * 4.0)
    assert volume(cylinder) == pytest.approx(np.pi * 3.0, rel=1e-3)


def test_a_target_marker_is_a_closed_body_of_its_size():
    mesh = shapes.diamond(0.4)
    assert is_closed(mesh)
    assert volume(mesh) > 0.0
    assert np.ptp(mesh.vertices[:, 2]) == pytest.approx(0.4)


def test_a_small_quadrotor_looks_alike_in_a_tenth_of_the_triangles():
    small, large = shapes.small_quadrotor(), shapes.merged(shapes.quadrotor())
    assert len(small.faces) < len(large.faces) / 10
    np.testing.assert_allclose(np.ptp(small.vertices[:, :2], axis=0), np.ptp(large.vertices[:, :2], axis=0), rtol=0.03)
    assert small.vertices[:, 0].max() == pytest.approx(large.vertices[:, 0].max(), rel=0.03)


def test_a_quadrotor_measures_one_from_rotor_tip_to_rotor_tip_and_points_forward():
    quadrotor = shapes.quadrotor()
    tips = np.linalg.norm(quadrotor.rotors.vertices[:, :2], axis=1)
    assert 2.0 * tips.max() == pytest.approx(1.0, abs=0.01)
    assert all(volume(part) > 0.0 for part in quadrotor)
    hull = quadrotor.hull.vertices
    assert hull[:, 0].max() > -hull[:, 0].min()
    assert hull[:, 1].max() == pytest.approx(-hull[:, 1].min())
    assert quadrotor.rotors.vertices[:, 2].min() > 0.0 > quadrotor.airframe.vertices[:, 2].min()


def test_a_threat_is_half_a_sphere_seen_from_outside():
    mesh = shapes.hemisphere(400.0, rings=64, segments=128)
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 400.0)
    assert mesh.vertices[:, 2].min() == pytest.approx(0.0)
    assert volume(mesh) == pytest.approx(2.0 / 3.0 * np.pi * 400.0**3, rel=2e-3)


def test_the_ground_and_its_grid_follow_the_mountains():
    peaks = pack(TERRAIN)
    mesh = shapes.terrain(TERRAIN.bounds, peaks, cells=40)
    np.testing.assert_allclose(mesh.vertices[:, 2], terrain_height(mesh.vertices, peaks))
    normals = np.cross(*(mesh.vertices[mesh.faces[:, corner]] - mesh.vertices[mesh.faces[:, 0]] for corner in (1, 2)))
    assert np.all(normals[:, 2] > 0.0)
    lines = shapes.draped(TERRAIN.bounds, peaks, 100.0, samples=100).reshape(-1, 3)
    above_m = lines[:, 2] - terrain_height(lines, peaks)
    assert np.all(above_m > 0.0)
    assert np.all(above_m < 5.0)
    assert lines[:, 0].min() == TERRAIN.bounds.east_m[0]


@pytest.mark.parametrize("thing", [BOX, CYLINDER])
def test_hatching_lies_on_the_walls_and_slants(thing: Box | Cylinder):
    lines = shapes.hatching(thing, 0.5)
    points = lines.reshape(-1, 3)
    assert len(lines) > 10
    if isinstance(thing, Cylinder):
        radii = np.linalg.norm(points[:, :2] - np.array(thing.centre_m), axis=1)
        np.testing.assert_allclose(radii, thing.radius_m, atol=0.01)  # on the chords of a 24-gon
        low, high = thing.base_m, thing.top_m
    else:
        off = np.abs(points - np.array(thing.centre_m)) - np.array(thing.half_m)
        np.testing.assert_allclose(off[:, :2].max(axis=1), 0.0, atol=1e-9)
        low, high = 0.0, 4.0
    assert points[:, 2].min() >= low - 1e-9
    assert points[:, 2].max() <= high + 1e-9
    climb, along = lines[:, 1, 2] - lines[:, 0, 2], np.linalg.norm(lines[:, 1, :2] - lines[:, 0, :2], axis=1)
    assert np.all(climb > 0.0)
    assert np.all(along > 0.0)


def test_edges_join_the_corners_of_a_box():
    edges = shapes.box_edges(np.zeros(3), np.array([2.0, 3.0, 4.0]))
    lengths = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
    assert sorted(lengths.tolist()) == [2.0] * 4 + [3.0] * 4 + [4.0] * 4


def test_writing_is_centred_on_its_place_and_faces_up():
    mesh = written("20 m", 0.5, np.array([10.0, -1.0, 0.1]))
    middle = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    np.testing.assert_allclose(middle, [10.0, -1.0, 0.1])
    assert 0.3 < np.ptp(mesh.vertices[:, 1]) < 0.6
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    assert np.all(np.cross(b - a, c - a)[:, 2] > 0.0)


def test_letters_have_holes():
    def area(text: str) -> float:
        a, b, c = (letters(text).vertices[letters(text).faces[:, corner]] for corner in range(3))
        return float(np.cross(b - a, c - a)[:, 2].sum() / 2)

    assert area("O") < 0.75 * area("l") * np.ptp(letters("O").vertices[:, 0]) / np.ptp(letters("l").vertices[:, 0])
