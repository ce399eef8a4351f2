from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
from PIL import Image

from onemap_simulator.scene.loading import load_scene
from onemap_simulator.scene.mesh_texture import COLOUR_STEP, MAX_TEXTURE_PX, texture_and_uv


def test_textures_and_plain_materials(tmp_path: Path) -> None:
    pixels = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [9, 9, 9]]], np.uint8)
    Image.fromarray(pixels).save(tmp_path / "t.png")
    (tmp_path / "a.mtl").write_text(
        "newmtl wood\nKd 1 1 1\nmap_Kd t.png\nnewmtl red\nKd 0.8 0.1 0.1\n"
    )
    corners = "".join(f"v {x} {y} 0\n" for x in (0, 4) for y in (0, 4))
    floor = "vt 0 0\nvt 0 1\nvt 1 0\nvt 1 1\no floor\nusemtl wood\nf 1/1 3/3 4/4\nf 1/1 4/4 2/2\n"
    chair = "v 1 1 .5\nv 2 1 .5\nv 1 2 1\no chair\nusemtl red\nf 5 6 7\n"
    (tmp_path / "a.obj").write_text("mtllib a.mtl\n" + corners + floor + chair)
    scene = load_scene(tmp_path / "a.obj")
    by_name = {
        obj.category: scene.textures[scene.face_texture[scene.face_object == i][0]]
        for i, obj in enumerate(scene.objects)
    }
    np.testing.assert_array_equal(by_name["floor"], pixels)
    assert by_name["chair"][0, 0].tolist() == [204, 26, 26]
    owner = [obj.category for obj in scene.objects].index("floor")
    rows = scene.face_object == owner
    corner = scene.vertices[scene.faces[rows]]
    # The image's last row lies at the texture's v = 0 of the file, where y is 0.
    np.testing.assert_allclose(scene.face_uv[rows][..., 1], 1 - corner[..., 1] / 4, atol=1e-6)


def test_colours_per_face_become_texels_of_their_faces() -> None:
    box = trimesh.creation.box((1, 1, 1))
    colours = np.random.default_rng(0).integers(0, 256, (len(box.faces), 4), dtype=np.uint8)
    box.visual.face_colors = colours
    texture, uv = texture_and_uv(box)
    height, width = texture.shape[:2]
    column, row = (uv * (width, height)).astype(int).transpose(2, 0, 1)
    shown = texture[row, column].astype(int)
    assert np.abs(shown - colours[:, None, :3]).max() < COLOUR_STEP


def test_a_texture_without_coordinates_becomes_its_mean_colour() -> None:
    image = Image.fromarray(np.array([[[0, 0, 0], [200, 100, 50]]], np.uint8))
    box = trimesh.creation.box((1, 1, 1))
    material = trimesh.visual.material.SimpleMaterial(image=image)
    box.visual = trimesh.visual.TextureVisuals(material=material)
    texture, _ = texture_and_uv(box)
    np.testing.assert_array_equal(np.unique(texture.reshape(-1, 3), axis=0), [[100, 50, 25]])


def test_large_textures_are_shrunk() -> None:
    image = Image.fromarray(np.full((20, 2 * MAX_TEXTURE_PX, 3), 90, np.uint8))
    box = trimesh.creation.box((1, 1, 1))
    material = trimesh.visual.material.SimpleMaterial(image=image)
    box.visual = trimesh.visual.TextureVisuals(uv=np.zeros((8, 2)), material=material)
    texture, uv = texture_and_uv(box)
    assert texture.shape == (10, MAX_TEXTURE_PX, 3)
    assert uv.shape == (len(box.faces), 3, 2)
