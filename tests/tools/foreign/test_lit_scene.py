"""Normals of round and of bevelled things, and the scene that objects make."""

from __future__ import annotations

import numpy as np

from onemap_tools.foreign.finish import Finish, finished
from onemap_tools.foreign.lit_scene import PlacedObject, corner_normals, lit_scene
from onemap_tools.foreign.plain_mesh import block, revolved


def test_a_ball_is_smooth() -> None:
    turns = np.linspace(0, np.pi, 40)
    ball = revolved([(float(np.sin(t)), float(-np.cos(t))) for t in turns], 64)
    corners = ball.vertices[ball.faces]
    outward = corners / np.linalg.norm(corners, axis=-1, keepdims=True)
    cosine = np.abs((corner_normals(ball) * outward).sum(axis=-1))
    assert cosine.min() > 0.98


def test_a_bevelled_block_is_flat_but_for_its_edges() -> None:
    mesh = block(1, 2, 3, 0.05)
    corners = mesh.vertices[mesh.faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    large = np.linalg.norm(cross, axis=1) > 0.5
    normals = np.abs(corner_normals(mesh))
    assert large.sum() == 12
    assert normals[large].max(axis=-1).min() > 0.99
    assert normals[~large].max(axis=-1).min() < 0.8


def test_objects_keep_their_faces_and_finishes() -> None:
    finish = Finish(np.full((4, 4, 3), 90, np.uint8), gloss=0.3)
    parts = (finished(block(1, 1, 1), finish), finished(block(1, 1, 1).at(3), finish))
    objects = [PlacedObject("table", "hall", parts), PlacedObject("chair", "hall", parts[:1])]
    lit = lit_scene("x", objects, (), ambient=(1, 1, 1), rooms=(), start=(0, 0, 0))
    count = len(parts[0].mesh.faces)
    assert np.bincount(lit.scene.face_object).tolist() == [2 * count, count]
    assert np.bincount(lit.scene.face_texture).tolist() == [count] * 3
    assert [thing.category for thing in lit.scene.objects] == ["table", "chair"]
    assert len(lit.finishes) == len(lit.scene.textures) == 3
    assert lit.corner_normals.shape == (3 * count, 3, 3)
