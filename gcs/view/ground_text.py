"""Writing on the ground: names and lengths as meshes, read from the south; pure."""

from functools import lru_cache, reduce

import numpy as np
import numpy.typing as npt
import shapely
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextPath

from gcs.view.shapes import Mesh

Array = npt.NDArray[np.float64]

FONT = FontProperties(family="DejaVu Sans", weight="bold")
"""Comes with matplotlib, so it is the same everywhere."""


@lru_cache(maxsize=256)
def letters(text: str) -> Mesh:
    """`text` in the plane z = 0, one unit high per line, centred on the origin; counter-clockwise from above."""
    path = TextPath((0, 0), text, size=1, prop=FONT)
    outlines = [shapely.Polygon(np.asarray(outline)) for outline in path.to_polygons()]
    solid = reduce(shapely.symmetric_difference, [shapely.make_valid(outline) for outline in outlines])
    pieces = shapely.get_parts(shapely.constrained_delaunay_triangles(solid))
    corners = np.array([shapely.get_coordinates(shapely.orient_polygons(piece))[:3] for piece in pieces])
    flat = corners.reshape(-1, 2)
    centred = flat - (flat.min(axis=0) + flat.max(axis=0)) / 2
    faces = np.arange(len(flat), dtype=np.uint32).reshape(-1, 3)
    return Mesh(np.column_stack((centred, np.zeros(len(flat)))), faces)


def written(text: str, height_m: float, centre_m: Array) -> Mesh:
    """`text` lying around a (3,) place, its lines `height_m` high."""
    mesh = letters(text)
    return Mesh(mesh.vertices * height_m + centre_m, mesh.faces)
