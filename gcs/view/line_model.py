"""Lines as a model in binary glTF, which browsers draw as plain lines of one pixel; pure.

viser's own lines are ribbons, six triangles for each segment: right for a few vehicles, and most of what a machine
without a graphics card has to draw for a hundred. trimesh could write the model, but takes 59 ms for 2560 segments,
in which nothing else of the ground station has its turn; this is 0.4 ms.
"""

import json
import struct
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

MAGIC, VERSION, JSON_CHUNK, BINARY_CHUNK = 0x46546C67, 2, 0x4E4F534A, 0x004E4942
FLOAT, UNSIGNED_BYTE, LINES = 5126, 5121, 1


def line_model(segments_m: Array, colours: npt.NDArray[np.uint8]) -> bytes:
    """A binary glTF file of (n, 2, 3) segments [m] with the (n, 2, 3) colours of their ends.

    The colours stand as they are where glTF expects linear ones: viser's ribbons take them so, too.
    """
    points_m = segments_m.reshape(-1, 3).astype("<f4")
    tints = np.full((len(points_m), 4), 255, dtype=np.uint8)
    tints[:, :3] = colours.reshape(-1, 3)
    places = {"count": len(points_m), "min": points_m.min(axis=0).tolist(), "max": points_m.max(axis=0).tolist()}
    about = _packed(json.dumps(_description(points_m.nbytes, tints.nbytes, places)).encode(), b" ", JSON_CHUNK)
    chunks = about + _packed(points_m.tobytes() + tints.tobytes(), b"\0", BINARY_CHUNK)
    return struct.pack("<III", MAGIC, VERSION, 12 + len(chunks)) + chunks


def _description(points_bytes: int, tints_bytes: int, places: dict[str, Any]) -> dict[str, Any]:
    """What is where in the binary part: all points, then all colours."""
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "COLOR_0": 1}, "mode": LINES}]}],
        "buffers": [{"byteLength": points_bytes + tints_bytes}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": points_bytes},
            {"buffer": 0, "byteOffset": points_bytes, "byteLength": tints_bytes},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": FLOAT, "type": "VEC3", **places},
            {
                "bufferView": 1,
                "componentType": UNSIGNED_BYTE,
                "normalized": True,
                "type": "VEC4",
                "count": places["count"],
            },
        ],
    }


def _packed(contents: bytes, filler: bytes, kind: int) -> bytes:
    """One chunk of the file, filled up to a multiple of four bytes."""
    whole = contents + filler * (-len(contents) % 4)
    return struct.pack("<II", len(whole), kind) + whole
