"""The known cells of a map as a point cloud: binary PLY."""

from __future__ import annotations

import numpy as np

from onemap_shared.messages import Occupancy
from onemap_tools.map_export.map_arrays import MapArrays

COLOURS = np.array([[90, 90, 90], [230, 230, 230], [30, 30, 30]], np.uint8)  # by occupancy
VERTEX = np.dtype(
    [
        ("x", "<f4"),
        ("y", "<f4"),
        ("z", "<f4"),
        ("red", "u1"),
        ("green", "u1"),
        ("blue", "u1"),
        ("occupancy", "u1"),
        ("similarity", "<f4"),
    ]
)
TYPES = {"<f4": "float", "|u1": "uchar"}


def point_cloud(arrays: MapArrays) -> bytes:
    """A vertex for each known cell, at its centre, z = 0, grey by its occupancy.

    ``occupancy``: 0 unknown, 1 free, 2 occupied; ``similarity``: to the text, NaN without one or
    where nothing was observed; red grows with it.
    """
    cells = np.argwhere(arrays.known)
    x, y = cells.T
    vertices = np.zeros(len(cells), VERTEX)
    for axis, name in enumerate(("x", "y")):
        vertices[name] = arrays.origin_m[axis] + (cells[:, axis] + 0.5) * arrays.cell_size_m
    occupancy = arrays.occupancy[x, y]
    vertices["occupancy"] = occupancy
    colours = COLOURS[np.minimum(occupancy, Occupancy.OCCUPIED)]
    similarity = np.full(len(cells), np.nan, np.float32)
    if arrays.similarity.size:
        similarity = arrays.similarity[x, y]
    share = np.nan_to_num(similarity)[:, None]
    colours = np.rint(colours * (1 - share) + np.array([255, 60, 0]) * share).astype(np.uint8)
    for index, name in enumerate(("red", "green", "blue")):
        vertices[name] = colours[:, index]
    vertices["similarity"] = similarity
    return _header(len(cells)) + vertices.tobytes()


def _header(count: int) -> bytes:
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {count}"]
    for name in VERTEX.names or ():
        lines.append(f"property {TYPES[VERTEX[name].str]} {name}")
    return "\n".join([*lines, "end_header", ""]).encode()
