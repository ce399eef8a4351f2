"""Doors, windows, curtains and rugs.

A door or window is built for an opening of a given width: x runs along the wall, the
wall's centre plane is y = 0, and the room on the -y side is the one it opens into.
"""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import U8
from onemap_simulator.generation.floor_plan import DOOR_HEIGHT_M, HALF_WALL_M
from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    box_between,
    cylinder,
    front_panel,
    panel,
    rod,
)
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.sampler import Sampler
from onemap_simulator.generation.textures import smooth_noise, to_image

LEAF_M = 0.04


def door(sampler: Sampler, width: float, leaf: tuple[str, float] | None) -> Model:
    """A door around a clear opening of ``width``, centred on x = 0.

    ``leaf`` is None for a passage, else where the leaf hangs and the angle it stands open at,
    in degrees: ("left", 90.0) has its hinge at -width / 2 and stands into the room at -y.
    """
    wood, handle = sampler.wood(), sampler.metal()
    frame = _frame(sampler, width)
    if leaf is None:
        return assemble("door", (wood, frame))
    hinge, degrees = leaf
    panels = _leaf(sampler, width)
    knob = _handles(sampler, width)
    if hinge == "right":
        panels, knob = ([_mirrored(mesh) for mesh in group] for group in (panels, knob))
    sign = 1.0 if hinge == "left" else -1.0
    pivot = (-sign * width / 2, -HALF_WALL_M - LEAF_M / 2 - 0.01)
    if degrees == 0.0:
        pivot = (-sign * width / 2, -HALF_WALL_M + LEAF_M)
    paint = sampler.wood() if sampler.chance(0.5) else wood
    return assemble(
        "door",
        (wood, frame),
        (paint, [mesh.rotated("z", -sign * degrees).translated(*pivot) for mesh in panels]),
        (handle, [mesh.rotated("z", -sign * degrees).translated(*pivot) for mesh in knob]),
    )


def _frame(sampler: Sampler, width: float) -> list[Mesh]:
    """Jambs and lintel casing that cover the wall's thickness, outside of the clear opening."""
    casing, depth = sampler.size(0.06, 0.1), 2 * (HALF_WALL_M + 0.015)
    height = DOOR_HEIGHT_M
    jamb = (casing, depth, height + casing)
    return [
        box(jamb, (-width / 2 - casing / 2, 0.0, 0.0)),
        box(jamb, (width / 2 + casing / 2, 0.0, 0.0)),
        box((width, depth, casing), (0.0, 0.0, height)),
    ]


def _leaf(sampler: Sampler, width: float) -> list[Mesh]:
    """The leaf from its hinge at x = 0 to x = width, with raised panels on both faces."""
    meshes = [box_between((0.01, -LEAF_M / 2, 0.01), (width, LEAF_M / 2, DOOR_HEIGHT_M - 0.01))]
    columns, rows = sampler.integer(1, 2), sampler.integer(1, 4)
    cell_w, cell_h = (width - 0.1) / columns, (DOOR_HEIGHT_M - 0.1) / rows
    for column in range(columns if sampler.chance(0.85) else 0):
        for row in range(rows):
            x, z = 0.05 + column * cell_w, 0.05 + row * cell_h
            meshes.append(
                box_between(
                    (x + 0.05, -LEAF_M / 2 - 0.012, z + 0.05),
                    (x + cell_w - 0.05, LEAF_M / 2 + 0.012, z + cell_h - 0.05),
                )
            )
    return meshes


def _handles(sampler: Sampler, width: float) -> list[Mesh]:
    x, reach = width - 0.08, LEAF_M / 2 + 0.045
    if sampler.chance(0.5):
        lever = rod((x, -reach, 1.02), (x - 0.13, -reach, 1.02), 0.012)
        back = rod((x, reach, 1.02), (x - 0.13, reach, 1.02), 0.012)
        return [lever, back, rod((x, -reach, 1.02), (x, reach, 1.02), 0.014)]
    knob = cylinder(0.03, 2 * reach, segments=10).rotated("x", -90)
    return [knob.translated(x, -reach, 1.02)]


def _mirrored(mesh: Mesh) -> Mesh:
    """The mesh reflected in x = 0, faces still wound outwards."""
    return Mesh(mesh.vertices * (-1.0, 1.0, 1.0), mesh.faces[:, ::-1], mesh.uv[:, ::-1])


def window(sampler: Sampler, width: float, height: float) -> Model:
    """A window that fills an opening; z = 0 is its sill. The panes show a bright outdoors."""
    frame, bar = sampler.pale() if sampler.chance(0.6) else sampler.wood(), sampler.size(0.05, 0.08)
    depth = 2 * HALF_WALL_M
    meshes = [
        box((bar, depth, height), (-width / 2 + bar / 2, 0.0, 0.0)),
        box((bar, depth, height), (width / 2 - bar / 2, 0.0, 0.0)),
        box((width, depth, bar), (0.0, 0.0, height - bar)),
        box((width, depth, bar), (0.0, 0.0, 0.0)),
        box((width + 0.12, 0.16, 0.04), (0.0, -HALF_WALL_M, -0.04)),
    ]
    for column in range(1, sampler.integer(1, 3)):
        share = column / 2 if width < 1.3 else column / 3
        meshes.append(box((0.04, 0.06, height), (width * (share - 0.5), 0.0, 0.0)))
    if sampler.chance(0.5):
        meshes.append(box((width, 0.06, 0.04), (0.0, 0.0, height * sampler.uniform(0.5, 0.7))))
    view = Material(outdoors(sampler.rng))
    return assemble(
        "window", (frame, meshes), (view, [front_panel(width, height, (0.0, 0.02, 0.0))])
    )


def outdoors(rng: np.random.Generator) -> U8:
    """A blurred view (64, 64, 3): sky with clouds, a horizon, something green or built."""
    rows = np.linspace(0, 1, 64, dtype=np.float32)[:, None, None]
    sky = np.array([0.62, 0.78, 0.95]) * (1 - rows) + np.array([0.92, 0.95, 0.98]) * rows
    clouds = smooth_noise(rng, (4, 4))[..., None] * 0.25
    ground = np.array(rng.uniform([0.25, 0.4, 0.2], [0.6, 0.65, 0.45]))
    horizon = rng.uniform(0.5, 0.85) + 0.15 * smooth_noise(rng, (1, 8))[:1, :, None]
    mix = np.clip((rows - horizon) * 12, 0, 1)
    return to_image((sky + clouds) * (1 - mix) + (ground + clouds) * mix)


def curtain(sampler: Sampler, width: float, height: float) -> Model:
    """A pleated curtain that hangs from a rod; z = 0 is its hem."""
    pleats, depth = sampler.integer(4, 8), sampler.size(0.04, 0.07)
    x = np.linspace(-width / 2, width / 2, pleats * 4 + 1)
    y = depth * np.sin(np.linspace(0, 2 * np.pi * pleats, pleats * 4 + 1))
    cloth = [
        panel((x[i], y[i], height), (x[i + 1] - x[i], y[i + 1] - y[i], 0.0), (0.0, 0.0, -height))
        for i in range(len(x) - 1)
    ]
    # Each strip shows its own part of the cloth, so that patterns run on.
    cloth = [
        Mesh(m.vertices, m.faces, m.uv * (x[1] - x[0], height) + (x[i], 0.0))
        for i, m in enumerate(cloth)
    ]
    bar = rod(
        (-width / 2 - 0.08, 0.0, height + 0.03), (width / 2 + 0.08, 0.0, height + 0.03), 0.018
    )
    return assemble("curtain", (sampler.fabric(), cloth), (sampler.metal(), [bar]))


def rug(sampler: Sampler, width: float, depth: float) -> Model:
    """A flat rug, rectangular with a border or round."""
    cloth, border = sampler.fabric(), sampler.fabric()
    if sampler.chance(0.25):
        radius = min(width, depth) / 2
        return assemble(
            "rug",
            (border, [cylinder(radius, 0.01, segments=24)]),
            (cloth, [cylinder(radius * 0.85, 0.014, segments=24)]),
        )
    edge = sampler.size(0.06, 0.15)
    inner = box((width - 2 * edge, depth - 2 * edge, 0.014))
    return assemble("rug", (border, [box((width, depth, 0.01))]), (cloth, [inner]))
