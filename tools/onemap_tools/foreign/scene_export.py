"""An apartment of the foreign set as a glTF file, so that a robot can search in it."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import trimesh
from PIL import Image
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from onemap_shared.geometry import I64, U8
from onemap_tools.foreign.finish import Finish
from onemap_tools.foreign.lit_scene import LitScene

JPEG_QUALITY = 90
SEPARATOR = "/"  # between a node's name and the number of its part
Y_UP_FROM_Z = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def glb(lit: LitScene) -> bytes:
    """The scene as binary glTF: a node for each object, a material for each of its parts.

    Nodes are named by category and number, as in ``coffee table_7``. Lights are left out.
    """
    scene = lit.scene
    file = trimesh.Scene()
    materials = [_material(finish) for finish in lit.finishes]
    for part, material in enumerate(materials):
        faces = np.flatnonzero(scene.face_texture == part)
        owner = int(scene.face_object[faces[0]])
        name = f"{scene.objects[owner].category}_{owner}"
        file.add_geometry(_mesh(lit, faces, material), geom_name=f"{name}{SEPARATOR}{part}")
    data: bytes = trimesh.exchange.gltf.export_glb(file, tree_postprocessor=_join_parts)
    return data


def _mesh(lit: LitScene, faces: I64, material: PBRMaterial) -> trimesh.Trimesh:
    """Some faces, each with corners of its own: a corner has one place in the texture."""
    scene = lit.scene
    corners = scene.vertices[scene.faces[faces]].reshape(-1, 3) @ Y_UP_FROM_Z.T
    normals = lit.corner_normals[faces].reshape(-1, 3) @ Y_UP_FROM_Z.T
    u, v = scene.face_uv[faces].reshape(-1, 2).T
    return trimesh.Trimesh(
        corners,
        np.arange(len(corners)).reshape(-1, 3),
        vertex_normals=normals,
        visual=TextureVisuals(uv=np.stack([u, 1 - v], axis=1), material=material),
        process=False,
    )


def _material(finish: Finish) -> PBRMaterial:
    """The finish in glTF's terms; its exponent becomes a roughness (Walter et al. 2007)."""
    roughness = float(np.sqrt(2 / (finish.sharpness + 2)))
    return PBRMaterial(
        baseColorTexture=_jpeg(finish.texture),
        metallicFactor=1.0 if finish.metal or finish.mirror > 0.5 else 0.0,
        roughnessFactor=0.0 if finish.mirror > 0.5 else roughness,
        emissiveFactor=[finish.glow] * 3,
    )


def _jpeg(texture: U8) -> Image.Image:
    """The image with its JPEG encoding, which the file takes over."""
    buffer = io.BytesIO()
    Image.fromarray(texture).save(buffer, "JPEG", quality=JPEG_QUALITY)
    return Image.open(buffer)


def _join_parts(tree: dict[str, Any]) -> None:
    """Make the parts of an object the primitives of one mesh, in glTF's document."""
    primitives: dict[str, list[Any]] = {}
    for mesh in tree["meshes"]:
        owner = mesh["name"].split(SEPARATOR)[0]
        primitives.setdefault(owner, []).extend(mesh["primitives"])
    tree["meshes"] = [{"name": name, "primitives": parts} for name, parts in primitives.items()]
    tree["nodes"] = [{"name": name, "mesh": index} for index, name in enumerate(primitives)]
    tree["scenes"] = [{"nodes": list(range(len(primitives)))}]
