"""Lofts, revolutions and blocks: closed skins of the right volume."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from onemap_tools.foreign.plain_mesh import (
    PlainMesh,
    block,
    curve,
    cushion,
    joined,
    loft,
    revolved,
    ring,
    sheet,
    tube,
)


def volume(mesh: PlainMesh) -> float:
    """Enclosed by a mesh whose faces all turn the same way."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return abs(float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum())) / 6


def open_edges(mesh: PlainMesh) -> int:
    """Edges that do not belong to exactly two triangles."""
    edges = np.concatenate([mesh.faces[:, [i, (i + 1) % 3]] for i in range(3)])
    counts = Counter(map(tuple, np.sort(edges, axis=1).tolist()))
    return sum(count != 2 for count in counts.values())


CLOSED = {
    "block": (block(2, 3, 4, 0.001), 24.0),
    "sharp block": (block(1, 1, 1, 0.0), 1.0),
    "cushion": (cushion(1, 1, 1, 0.499, steps=12), 4 / 3 * np.pi * 0.125),
    "revolved": (revolved([(0, 0), (1, 0), (1, 2), (0, 2)], 128), 2 * np.pi),
    "tube": (tube([(0, 0, 0), (0, 0, 1), (0, 0, 3)], 0.5, 96), 0.25 * np.pi * 3),
    "loft": (loft([ring(2, 1, z, 2, 128) for z in (0, 1)]), np.pi / 2),
}


@pytest.mark.parametrize("name", CLOSED)
def test_a_skin_is_closed_and_holds_its_volume(name: str) -> None:
    mesh, expected = CLOSED[name]
    assert open_edges(mesh) == 0
    assert volume(mesh) == pytest.approx(expected, rel=0.02)


def test_a_sheet_is_open() -> None:
    grid = np.stack(np.meshgrid(np.arange(4.0), np.arange(3.0), [0.0], indexing="ij"), axis=-1)
    assert open_edges(sheet(grid[:, :, 0])) == 2 * (3 + 2)


def test_puff_bulges_in_the_middle_only() -> None:
    flat, puffed = cushion(1, 1, 0.2, 0.05), cushion(1, 1, 0.2, 0.05, puff=0.05)
    assert puffed.vertices[:, 2].max() == pytest.approx(flat.vertices[:, 2].max() + 0.05, abs=0.01)
    np.testing.assert_allclose(np.ptp(puffed.vertices[:, :2], axis=0), 1)


def test_a_curve_passes_through_its_points() -> None:
    points = [(0.0, 0.0, 0.0), (1.0, 2.0, 0.0), (3.0, 0.0, 1.0)]
    np.testing.assert_allclose(curve(points, 5)[::5], points, atol=1e-12)


def test_turning_keeps_lengths_and_joining_keeps_faces() -> None:
    mesh = block(1, 2, 3)
    turned = mesh.turned(yaw=0.3, pitch=-1.2, roll=2.0)
    assert volume(turned) == pytest.approx(volume(mesh))
    both = joined([mesh, turned.at(5)])
    assert volume(both) == pytest.approx(2 * volume(mesh))
    assert both.faces.max() == len(both.vertices) - 1
