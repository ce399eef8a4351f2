"""Pictures of every shape of a class in a plain studio, to be looked at by people."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import U8, camera_mount, pose_2d
from onemap_tools.foreign import textures
from onemap_tools.foreign.finish import Finish, finished
from onemap_tools.foreign.finish_picker import LOFT, NORTHERN, OLD_TOWN, FinishPicker
from onemap_tools.foreign.frames import ForeignSetSpec, render_foreign
from onemap_tools.foreign.lit_scene import AreaLight, LitScene, PlacedObject, lit_scene
from onemap_tools.foreign.plain_mesh import block
from onemap_tools.foreign.plans import PLANS
from onemap_tools.foreign.renderer import ForeignRenderer
from onemap_tools.foreign.shapes.catalogue import CATALOGUE, SHAPES, ForeignPiece, build_piece

PALETTES = (NORTHERN, OLD_TOWN, LOFT)
COLUMNS = 4
VIEWS = 12


def studio(piece: ForeignPiece) -> LitScene:
    """The piece before a grey wall, with a lamp at each side."""
    grey = Finish(textures.plain(np.random.default_rng(0), (0.62, 0.62, 0.63)))
    room = [
        finished(block(8, 8, 0.1, 0).at(z=-0.101), grey),
        finished(block(8, 0.1, 4, 0).at(y=0.06, z=-0.1), grey),
    ]
    objects = [
        PlacedObject("floor", "", (room[0],)),
        PlacedObject("wall", "", (room[1],)),
        PlacedObject(piece.category, "", piece.parts),
    ]
    lights = (
        AreaLight((-2.2, -3.0, 2.8), (0.5, 0.5, 0.2), (2.2, 2.1, 1.9)),
        AreaLight((2.6, -2.0, 2.2), (0.4, 0.4, 0.4), (1.1, 1.15, 1.3)),
    )
    return lit_scene("studio", objects, lights, ambient=(0.3, 0.3, 0.32), rooms=(), start=(0, 0, 0))


def portrait_of(piece: ForeignPiece, size: int = 200) -> U8:
    """A square image of the whole piece from its front right."""
    lower, upper = piece.bounds
    middle, radius = (lower + upper) / 2, float(np.linalg.norm(upper - lower)) / 2
    camera = Intrinsics.from_fov(size, size, 0.75)
    away, yaw, pitch = 1.1 * radius / np.sin(0.375), 2.05, 0.3
    eye = middle + away * np.array(
        [-np.cos(yaw) * np.cos(pitch), -np.sin(yaw) * np.cos(pitch), np.sin(pitch)]
    )
    pose = pose_2d(float(eye[0]), float(eye[1]), yaw) @ camera_mount(
        0.0, max(float(eye[2]), 0.1), pitch
    )
    renderer = ForeignRenderer(studio(piece))
    return renderer.render(pose, camera, width=size, height=size, rng=np.random.default_rng(1))


def contact_sheet(category: str, seed: int = 0, size: int = 200) -> U8:
    """All shapes of a class, COLUMNS in a row: (rows * size, COLUMNS * size, 3) uint8."""
    tiles = []
    for variant in range(SHAPES):
        palette = PALETTES[(variant + seed) % len(PALETTES)]
        look = FinishPicker(np.random.default_rng([seed, variant]), palette)
        image = portrait_of(build_piece(category, variant, look), size)
        tiles.append(
            np.asarray(
                cv2.copyMakeBorder(image[1:-1, 1:-1], 1, 1, 1, 1, cv2.BORDER_CONSTANT), np.uint8
            )
        )
    return tiled(tiles)


def write_pictures(folder: Path, report: Callable[[str], None]) -> None:
    """A contact sheet of every class and twelve views of every apartment, as PNG files.

    ValueError: the folder cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for category in CATALOGUE:
            _write(folder / f"{category.replace(' ', '_')}.png", contact_sheet(category))
            report(category)
        for index, plan in enumerate(PLANS):
            frames = render_foreign((index, 0), (), ForeignSetSpec(1, VIEWS))
            _write(folder / f"{plan.name.replace(' ', '_')}.png", tiled([f.rgb for f in frames]))
            report(plan.name)
    except OSError as problem:
        raise ValueError(f"cannot write to {folder}: {problem.strerror or problem}") from problem


def tiled(images: Sequence[U8]) -> U8:
    """Images of one size, COLUMNS in a row; an incomplete last row is left out."""
    whole = len(images) - len(images) % COLUMNS
    rows = [np.concatenate(images[at : at + COLUMNS], axis=1) for at in range(0, whole, COLUMNS)]
    return np.concatenate(rows)


def _write(path: Path, image: U8) -> None:
    packed = cv2.imencode(".png", image[..., ::-1])[1]
    path.write_bytes(packed.tobytes())
