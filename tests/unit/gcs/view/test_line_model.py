"""Lines as a model, read back by another library."""

import io

import numpy as np
import trimesh

from gcs.view.line_model import line_model


def test_the_model_has_the_segments_and_their_colours():
    rng = np.random.default_rng(1)
    segments_m = rng.uniform(-50.0, 50.0, (7, 2, 3))
    colours = rng.integers(0, 256, (7, 2, 3), dtype=np.uint8)
    scene = trimesh.load_scene(io.BytesIO(line_model(segments_m, colours)), file_type="glb")
    (path,) = scene.geometry.values()
    assert isinstance(path, trimesh.path.Path3D)
    ends_m = np.concatenate([path.vertices[entity.points] for entity in path.entities]).reshape(-1, 2, 3)
    np.testing.assert_allclose(ends_m, segments_m, atol=1e-5)


def test_its_parts_have_the_lengths_that_it_says():
    model = line_model(np.zeros((3, 2, 3)), np.zeros((3, 2, 3), dtype=np.uint8))
    assert int.from_bytes(model[8:12], "little") == len(model)
    about = int.from_bytes(model[12:16], "little")
    binary = int.from_bytes(model[20 + about : 24 + about], "little")
    assert (about % 4, binary) == (0, 6 * (12 + 4))
    assert 28 + about + binary == len(model)
    assert model[-24:] == b"\0\0\0\xff" * 6
