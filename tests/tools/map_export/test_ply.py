"""The point cloud, read by trimesh."""

from __future__ import annotations

import io

import numpy as np
import trimesh

from onemap_tools.map_export.ply import point_cloud
from tests.tools.map_export.arrays import small_map


def test_trimesh_reads_places_and_colours() -> None:
    cloud = trimesh.load(io.BytesIO(point_cloud(small_map())), file_type="ply")
    vertices = np.asarray(cloud.vertices)
    assert len(vertices) == 5  # the unknown cell is left out
    np.testing.assert_allclose(vertices[0], [-0.75, 2.25, 0.0])
    np.testing.assert_allclose(vertices[-1], [0.25, 2.25, 0.0])
    colours = np.asarray(cloud.colors)[:, :3]
    assert colours[-1].tolist() == [255, 60, 0]  # the best match
    assert colours[2].tolist() == [230, 230, 230]  # free


def test_occupancy_and_similarity_are_properties() -> None:
    content = point_cloud(small_map())
    raw = trimesh.load(io.BytesIO(content), file_type="ply").metadata["_ply_raw"]["vertex"]["data"]
    assert raw["occupancy"].ravel().tolist() == [1, 2, 1, 1, 2]
    np.testing.assert_allclose(raw["similarity"].ravel()[[0, 4]], [0.2, 1.0])
    assert np.isnan(raw["similarity"].ravel()[1:4]).all()
    none = point_cloud(small_map(text=False))
    assert none.count(b"property") == content.count(b"property")
