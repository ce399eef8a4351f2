"""Bookcases, shelves, wardrobes, dressers and nightstands."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, box_between, cylinder, rounded_box
from onemap_simulator.generation.model import Model, SupportSurface, assemble, support_surface
from onemap_simulator.generation.sampler import Sampler

BOARD_M = 0.025


def carcass(width: float, depth: float, height: float, shelves: int) -> list[Mesh]:
    """An open cupboard: sides, back, base, lid and boards at equal distances."""
    meshes = [
        box((BOARD_M, depth, height), (side * (width - BOARD_M) / 2, 0, 0)) for side in (-1, 1)
    ]
    meshes.append(box((width, 0.012, height), (0, depth / 2 - 0.006, 0)))
    for level in np.linspace(0.0, height - BOARD_M, shelves + 1):
        meshes.append(box((width - 2 * BOARD_M, depth, BOARD_M), (0, 0, float(level))))
    return meshes


def books(sampler: Sampler, width: float, depth: float, height: float) -> list[Mesh]:
    """A row of upright books from x = 0 to at most ``width``, some leaning gaps left out."""
    meshes, x = [], 0.0
    while x < width - 0.05:
        thick, tall = sampler.uniform(0.025, 0.06), height * sampler.uniform(0.65, 0.95)
        if x + thick > width:
            break
        deep = depth * sampler.uniform(0.7, 0.95)
        meshes.append(box_between((x, -deep / 2, 0.0), (x + thick - 0.003, deep / 2, tall)))
        x += thick
    return meshes


def bookcase(sampler: Sampler) -> Model:
    """Tall open shelves, most of them filled with rows of book spines."""
    width, depth = sampler.size(0.7, 1.1), sampler.size(0.27, 0.34)
    shelves = sampler.integer(4, 6)
    height = shelves * sampler.size(0.31, 0.36)
    meshes = carcass(width, depth, height, shelves)
    covers: list[list[Mesh]] = [[] for _ in range(5)]
    gap = height / shelves - BOARD_M
    inner = width - 2 * BOARD_M - 0.01
    for shelf in range(shelves):
        z = shelf * (height - BOARD_M) / shelves + BOARD_M
        filled = inner * sampler.uniform(0.6, 1.0)
        row = books(sampler, filled, depth - 0.05, gap * 0.92)
        for book in row:
            sampler.choice(covers).append(book.translated(-inner / 2, -0.01, z))
    materials = [sampler.plastic() for _ in covers]
    return assemble(
        "bookcase",
        (sampler.wood(), meshes),
        *zip(materials, covers, strict=True),
    )


def shelf(sampler: Sampler) -> Model:
    """Boards on the wall on brackets, or a low open rack, for small objects."""
    width, depth, wood = sampler.size(0.7, 1.1), sampler.size(0.24, 0.3), sampler.wood()
    metal = sampler.metal()
    if sampler.chance(0.5):
        levels = [0.0, sampler.size(0.38, 0.45)][: sampler.integer(1, 2)]
        boards = [box((width, depth, 0.035), (0, 0, z)) for z in levels]
        brackets = [
            box((0.025, depth * 0.9, 0.08), (side * width * 0.36, 0.01, z - 0.08))
            for z in levels
            for side in (-1, 1)
        ]
        support_surfaces = tuple(support_surface(width, depth, z + 0.035, 0.02) for z in levels)
        model = assemble(
            "shelf", (wood, boards), (metal, brackets), support_surfaces=support_surfaces
        )
        return raised(model, sampler.size(1.0, 1.15))
    height, count = sampler.size(0.9, 1.3), sampler.integer(2, 3)
    levels = np.linspace(0.08, height - 0.03, count + 1).tolist()
    boards = [box((width, depth + 0.05, 0.03), (0, 0, z)) for z in levels]
    posts = [
        box((0.03, 0.03, height + 0.02), (x * (width / 2 - 0.015), y * (depth / 2 + 0.01), 0))
        for x in (-1, 1)
        for y in (-1, 1)
    ]
    support_surfaces = tuple(support_surface(width - 0.08, depth, z + 0.03, 0.02) for z in levels)
    return assemble("shelf", (wood, boards), (metal, posts), support_surfaces=support_surfaces)


def raised(model: Model, z: float) -> Model:
    """The model lifted by z metres, with its support surfaces."""
    parts = tuple(part._replace(mesh=part.mesh.translated(0, 0, z)) for part in model.parts)
    return Model(
        model.category, parts, tuple(top._replace(z=top.z + z) for top in model.support_surfaces)
    )


def wardrobe(sampler: Sampler) -> Model:
    """A tall closed cupboard with doors, one of which may carry a drawer below."""
    doors = sampler.integer(2, 3)
    width, depth, height = (
        doors * sampler.size(0.42, 0.52),
        sampler.size(0.52, 0.6),
        sampler.size(1.85, 2.15),
    )
    foot = sampler.size(0.04, 0.1)
    wood, metal = sampler.wood(), sampler.metal()
    leaf_material = wood if sampler.chance(0.5) else sampler.wood()
    body = [box((width, depth - 0.03, height - foot), (0, 0.015, foot))]
    body.append(box((width + 0.03, depth + 0.02, 0.04), (0, 0, height)))
    body.append(box((width - 0.06, depth - 0.1, foot), (0, 0, 0)))
    drawer_h = sampler.size(0.22, 0.3) if sampler.chance(0.4) else 0.0
    leaves, handles = [], []
    y, each = -depth / 2 + 0.012, width / doors
    low = foot + drawer_h
    for index in range(doors):
        x = (index - (doors - 1) / 2) * each
        leaf_h = height - low - 0.03
        leaves.append(rounded_box((each - 0.015, 0.03, leaf_h), (x, y, low + 0.015), 0.008))
        if sampler.chance(0.5):
            leaves.append(box((each - 0.14, 0.02, leaf_h - 0.16), (x, y - 0.012, low + 0.1)))
        side = 1 if index % 2 == 0 else -1
        at = (x + side * (each / 2 - 0.05), y - 0.035, low + leaf_h * 0.45)
        handles.append(box((0.02, 0.03, sampler.uniform(0.12, 0.25)), at))
    if drawer_h:
        leaves.append(
            rounded_box((width - 0.02, 0.03, drawer_h - 0.02), (0, y, foot + 0.01), 0.008)
        )
        for side in (-1, 1):
            handles.append(
                box((0.14, 0.03, 0.02), (side * width / 4, y - 0.03, foot + drawer_h / 2))
            )
    return assemble("wardrobe", (wood, body), (leaf_material, leaves), (metal, handles))


def dresser(sampler: Sampler) -> Model:
    """A chest of drawers in one to three columns."""
    columns = sampler.integer(1, 3)
    width = columns * sampler.size(0.42, 0.55) + (0.25 if columns == 1 else 0.0)
    return _drawers(
        sampler, "dresser", (width, sampler.size(0.42, 0.5), sampler.size(0.72, 1.0)), columns
    )


def nightstand(sampler: Sampler) -> Model:
    """A small chest beside a bed, with drawers or an open compartment."""
    size = (sampler.size(0.38, 0.5), sampler.size(0.34, 0.42), sampler.size(0.45, 0.6))
    return _drawers(sampler, "nightstand", size, 1)


def _drawers(
    sampler: Sampler, category: str, size: tuple[float, float, float], columns: int
) -> Model:
    width, depth, height = size
    rows = sampler.integer(3, 4) if category == "dresser" else sampler.integer(1, 2)
    wood, metal = sampler.wood(), sampler.metal()
    leaf = wood if sampler.chance(0.5) else sampler.wood()
    leg = sampler.size(0.08, 0.2) if sampler.chance(0.5) else 0.03
    top = box((width + 0.03, depth + 0.02, 0.03), (0, 0, height - 0.03))
    hollow = category == "nightstand" and rows == 1
    low = leg + (height - leg) * 0.5 if hollow else leg
    body = [top, box((width, depth - 0.03, height - low - 0.03), (0, 0.015, low))]
    if hollow:
        body += [m.translated(0, 0, leg) for m in carcass(width, depth - 0.03, low - leg + 0.01, 1)]
    for left in (-1, 1):
        for ahead in (-1, 1):
            body.append(
                box((0.045, 0.045, leg), (left * (width / 2 - 0.03), ahead * (depth / 2 - 0.05), 0))
            )
    fronts, knobs = [], []
    each_w, each_h = width / columns, (height - low - 0.04) / rows
    round_knob = sampler.chance(0.5)
    for column in range(columns):
        for row in range(rows):
            x, z = (column - (columns - 1) / 2) * each_w, low + row * each_h
            at = (x, -depth / 2 + 0.012, z + 0.01)
            fronts.append(rounded_box((each_w - 0.025, 0.03, each_h - 0.02), at, 0.008))
            knobs += _pulls(round_knob, each_w, (x, -depth / 2, z + each_h / 2))
    support_surfaces: tuple[SupportSurface, ...] = (support_surface(width, depth, height),)
    return assemble(
        category, (wood, body), (leaf, fronts), (metal, knobs), support_surfaces=support_surfaces
    )


def _pulls(round_knob: bool, width: float, at: tuple[float, float, float]) -> list[Mesh]:
    x, y, z = at
    if not round_knob:
        return [box((min(0.16, width * 0.4), 0.03, 0.02), (x, y - 0.015, z))]
    knob = cylinder(0.02, 0.035, segments=8).rotated("x", 90)
    offsets = (-width / 4, width / 4) if width > 0.5 else (0.0,)
    return [knob.translated(x + offset, y, z) for offset in offsets]


def handle_bar(
    sampler: Sampler, length: float, at: tuple[float, float, float], upright: bool
) -> Mesh:
    """A bar handle in front of a door at y, upright or level."""
    thick = sampler.uniform(0.018, 0.028)
    size = (thick, 0.035, length) if upright else (length, 0.035, thick)
    x, y, z = at
    return box(size, (x, y - 0.017, z - size[2] / 2))
