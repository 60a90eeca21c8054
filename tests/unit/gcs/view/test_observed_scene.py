"""What the vehicles have seen, in the scene."""

from collections.abc import Iterator

import numpy as np
import pytest
import viser

from gcs.mapping.observed_map import ObservedMap
from gcs.view import observed_scene
from gcs.view.observed_scene import INTERVAL_S, ObservedScene
from gcs.view.server import close_server, open_server
from gcs.view.theme import LIGHT
from missions.occupancy import OccupancyBlock
from tests.browser.loopback import HOST, free_port


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    opened = open_server(HOST, free_port())
    yield opened
    close_server(opened)


def block(revision: int, *voxels: tuple[int, int, int]) -> OccupancyBlock:
    occupied = np.zeros((8, 8, 8), dtype=bool)
    for voxel in voxels:
        occupied[voxel] = True
    return OccupancyBlock((0, 0, 0), 0.2, revision, occupied)


def drawn_m(server: viser.ViserServer) -> np.ndarray | None:
    cloud = server.scene.get_handle_by_name("/observed")
    return None if cloud is None else cloud.points


def test_what_was_seen_is_drawn_and_grows(server: viser.ViserServer):
    scene, observed = ObservedScene(server.scene), ObservedMap()
    scene.update(observed, 0.0)
    assert drawn_m(server) is None
    observed.fold(1, block(1, (0, 0, 0)))
    scene.update(observed, 1.0)
    np.testing.assert_allclose(drawn_m(server), [[0.1, 0.1, 0.1]])
    observed.fold(2, block(1, (0, 0, 0), (1, 0, 0)))
    scene.update(observed, 2.0)
    np.testing.assert_allclose(drawn_m(server), [[0.1, 0.1, 0.1], [0.3, 0.1, 0.1]])
    observed.forget(1)
    observed.forget(2)
    scene.update(observed, 3.0)
    assert drawn_m(server) is None


def test_it_is_drawn_when_the_map_changes_alone_and_not_too_often(server: viser.ViserServer):
    scene, observed = ObservedScene(server.scene), ObservedMap()
    observed.fold(1, block(1, (0, 0, 0)))
    assert scene.update(observed, 10.0)
    assert not scene.update(observed, 20.0)
    observed.fold(1, block(2, (0, 0, 0), (0, 0, 1)))
    assert not scene.update(observed, 10.0 + INTERVAL_S / 2)
    assert scene.update(observed, 10.0 + INTERVAL_S)


def test_another_map_replaces_it_and_another_theme_colours_it(server: viser.ViserServer):
    scene, first, other = ObservedScene(server.scene), ObservedMap(), ObservedMap()
    first.fold(1, block(1, (0, 0, 0)))
    other.fold(1, block(1, (3, 0, 0)))
    scene.update(first, 0.0)
    scene.update(other, 1.0)
    np.testing.assert_allclose(drawn_m(server), [[0.7, 0.1, 0.1]])
    scene.use(LIGHT)
    scene.update(other, 2.0)
    cloud = server.scene.get_handle_by_name("/observed")
    assert cloud is not None
    np.testing.assert_array_equal(cloud.colors, LIGHT.observed)


def test_of_a_map_that_is_too_large_a_part_is_drawn(server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(observed_scene, "MOST_VOXELS", 3)
    scene, observed = ObservedScene(server.scene), ObservedMap()
    observed.fold(1, block(1, *((index, 0, 0) for index in range(8))))
    scene.update(observed, 0.0)
    shown = drawn_m(server)
    assert shown is not None
    assert 2 <= len(shown) <= 3
