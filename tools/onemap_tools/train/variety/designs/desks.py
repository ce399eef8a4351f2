"""Writing desks of wood, each with its knee space open."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cone,
    ellipsoid,
    rod,
)
from onemap_simulator.generation.model import Model, assemble, support_surface
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.fronts import HANDLES, Block, drawer, drawer_block, pulls
from onemap_tools.train.variety.designs.woodwork import (
    SIDES,
    centred,
    corners,
    frame,
    lean,
    turned,
)


def _pedestals(sampler: Sampler, width: float, depth: float, under: float) -> Block:
    """Two drawer stacks to the floor, a shallow drawer over the knees, a back panel."""
    kind, stack_w = sampler.choice(HANDLES), min(sampler.uniform(0.3, 0.42), width * 0.3)
    foot, count = sampler.choice([0.05, 0.1]), sampler.integer(2, 4)
    whole = Block([], [], [])
    for s in SIDES:
        x = s * (width - stack_w) / 2
        size = (stack_w, depth, under - foot)
        part = drawer_block(sampler, kind, size, (x, 0, foot), count)
        for into, more in zip(whole, part, strict=True):
            into.extend(more)
        if foot > 0.06:
            shaft = cone((0.02, 0.035), foot)
            whole.case.extend(shaft.translated(x + a, b) for a, b in corners(stack_w, depth, 0.05))
        else:
            whole.case.append(box((stack_w + 0.016, depth + 0.012, foot), (x, 0, 0)))
    knee = width - 2 * stack_w
    drop = 0.11
    whole.case.append(box((knee, depth - 0.08, drop), (0, 0.03, under - drop)))
    face = (0.0, -depth / 2 + 0.05, under - drop + 0.008)
    whole.fronts.extend(drawer((knee - 0.02, drop - 0.016), face))
    whole.handles.extend(pulls(kind, (0, face[1] - 0.02, under - drop / 2), knee - 0.02, drop))
    if sampler.chance(0.5):
        whole.case.append(box((knee, 0.018, under * 0.6), (0, depth / 2 - 0.03, under * 0.38)))
    return whole


def pedestal_desk(sampler: Sampler) -> Model:
    """A large writing desk on two drawer stacks with a leather field in the top."""
    width, depth, height = sampler.size(1.25, 1.7), sampler.size(0.6, 0.8), sampler.size(0.73, 0.78)
    thick = sampler.uniform(0.025, 0.045)
    parts = _pedestals(sampler, width - 0.06, depth - 0.05, height - thick)
    top = [box((width, depth, thick), (0, 0, height - thick))]
    leather = []
    if sampler.chance(0.6):
        leather = [box((width - 0.22, depth - 0.2, 0.004), (0, 0, height - 0.001))]
    if sampler.chance(0.3):
        top.append(box((width, 0.02, 0.05), (0, depth / 2 - 0.011, height - 0.002)))
    surface = support_surface(width, depth, height + 0.003)
    return assemble(
        "desk",
        (sampler.wood(), [*top, *parts.case]),
        (sampler.wood(), parts.fronts),
        (sampler.metal(), parts.handles),
        (sampler.material("leather", 0.3, sampler.colour()), leather),
        support_surfaces=(surface,),
    )


def roll_top(sampler: Sampler) -> Model:
    """A pedestal desk with a curved tambour hood, drawn half up over pigeonholes."""
    width, depth, height = sampler.size(1.2, 1.5), sampler.size(0.65, 0.8), sampler.size(0.73, 0.77)
    parts = _pedestals(sampler, width - 0.06, depth - 0.04, height - 0.03)
    wood = [box((width, depth, 0.03), (0, 0, height - 0.03)), *parts.case]
    tall, reach = sampler.uniform(0.32, 0.45), depth * sampler.uniform(0.68, 0.85)
    back, shut = depth / 2 - 0.01, sampler.uniform(0.1, 0.5)
    flat = reach * 0.45
    wood.append(box((width - 0.03, 0.02, tall), (0, back - 0.01, height - 0.002)))
    wood.append(box((width, flat, 0.025), (0, back - flat / 2, height + tall - 0.003)))
    curve = np.radians(np.linspace(0, 90, 8))
    round_y = back - flat - (reach - flat) * np.sin(curve)
    round_z = height + tall * np.cos(curve)
    for s in SIDES:
        x = s * (width / 2 - 0.024)
        for index in range(7):
            y0, y1 = float(round_y[index]), float(round_y[index + 1])
            middle = float(round_z[index] + round_z[index + 1]) / 2 - height
            wood.append(box((0.03, y0 - y1 + 0.001, middle), (x, (y0 + y1) / 2, height - 0.001)))
        wood.append(box((0.03, flat, tall), (x, back - flat / 2, height - 0.001)))
    slats: list[Mesh] = []
    for turn in np.linspace(0, np.pi / 2 * shut, max(int(16 * shut), 3)).tolist():
        y = back - flat - (reach - flat) * float(np.sin(turn))
        z = height + tall * float(np.cos(turn)) + 0.005
        slats.append(rod((-width / 2 + 0.02, y, z), (width / 2 - 0.02, y, z), 0.016, 6))
    holes = sampler.integer(4, 7)
    for index in range(1, holes):
        x = (index / holes - 0.5) * (width - 0.06)
        wood.append(box((0.012, 0.2, tall * 0.6), (x, back - 0.12, height - 0.001)))
    wood.append(box((width - 0.07, 0.2, 0.012), (0, back - 0.12, height + tall * 0.6)))
    surface = support_surface(width - 0.08, depth * 0.5, height)
    surface = surface._replace(y_min=-depth / 2 + 0.04, y_max=y - 0.03)
    return assemble(
        "desk",
        (sampler.wood(), wood),
        (sampler.wood(), [*slats, *parts.fronts]),
        (sampler.metal(), parts.handles),
        support_surfaces=(surface,),
    )


def pigeonholes(sampler: Sampler) -> Model:
    """A writing desk on four legs with a low upper part of pigeonholes and tiny drawers."""
    width, depth, height = (
        sampler.size(0.9, 1.3),
        sampler.size(0.52, 0.68),
        sampler.size(0.72, 0.77),
    )
    apron, stout, kind = sampler.uniform(0.08, 0.13), 0.024, sampler.choice(["knob", "ring", "cup"])
    under = height - 0.025
    wood = [box((width, depth, 0.025), (0, 0, under))]
    shaft = cone((0.012, 0.027), under - 0.002)
    if sampler.chance(0.5):
        shaft = turned(sampler, stout * 1.2, under - 0.002)
    legs = [shaft.translated(*at) for at in corners(width, depth, 0.05)]
    wood.append(box((width - 0.06, depth - 0.09, apron), (0, 0.015, under - apron)))
    fronts: list[Mesh] = []
    knobs: list[Mesh] = []
    count = sampler.integer(1, 3)
    each = (width - 0.08) / count
    for index in range(count):
        face = ((index - (count - 1) / 2) * each, -depth / 2 + 0.06, under - apron + 0.006)
        fronts += drawer((each - 0.012, apron - 0.012), face)
        knobs += pulls(kind, (face[0], face[1] - 0.02, under - apron / 2), each, apron)
    tall, deep = sampler.uniform(0.2, 0.6), sampler.uniform(0.18, 0.26)
    columns, rows = sampler.integer(3, 5), sampler.integer(1, 2) + (tall > 0.4)
    y = depth / 2 - deep / 2 - 0.004
    wood.append(box((width - 0.04, 0.012, tall), (0, depth / 2 - 0.012, height - 0.001)))
    cell_w, cell_h = (width - 0.04) / columns, (tall - 0.016) / rows
    for column in range(columns + 1):
        x = (column / columns - 0.5) * (width - 0.055)
        wood.append(box((0.014, deep, tall), (x, y, height - 0.001)))
    for row in range(rows + 1):
        wood.append(box((width - 0.05, deep - 0.006, 0.014), (0, y, height + row * cell_h)))
    for column in range(columns):
        for row in range(rows):
            if sampler.chance(0.2 if row else 0.5):
                x, z = (column - (columns - 1) / 2) * cell_w, height + row * cell_h + 0.016
                at = (x, y - deep / 2 - 0.002, z + cell_h / 2)
                fronts.append(box((cell_w - 0.018, deep - 0.02, cell_h - 0.02), (x, y - 0.006, z)))
                knobs.append(ellipsoid((0.01, 0.014, 0.01), at, 8))
    surface = support_surface(width, depth, height)._replace(y_max=depth / 2 - deep - 0.04)
    return assemble(
        "desk",
        (sampler.wood(), wood),
        (sampler.wood(), fronts),
        (sampler.metal(), knobs),
        (frame(sampler), legs),
        support_surfaces=(surface,),
    )


def secretary(sampler: Sampler) -> Model:
    """A narrow upright bureau with its flap let down as the writing surface."""
    width, deep, height = sampler.size(0.7, 1.0), sampler.size(0.26, 0.36), sampler.size(1.05, 1.45)
    flap_z, flap = sampler.uniform(0.7, 0.76), sampler.uniform(0.32, 0.42)
    low = flap_z - sampler.uniform(0.06, 0.14)
    inner = height - flap_z
    wood = [box((0.02, deep, height - low), (s * (width / 2 - 0.01), 0, low)) for s in SIDES]
    wood.append(box((width - 0.03, 0.014, height - low), (0, deep / 2 - 0.008, low)))
    wood.append(box((width - 0.03, deep - 0.006, flap_z - low), (0, 0, low + 0.002)))
    wood.append(box((width + 0.02, deep + 0.02, 0.022), (0, 0, height)))
    shelves = sampler.integer(1, 3)
    for index in range(1, shelves + 1):
        z = flap_z + index * inner / (shelves + 1)
        wood.append(box((width - 0.03, deep - 0.02, 0.014), (0, 0.004, z)))
    for index in range(1, sampler.integer(2, 5)):
        x = (index / 5 - 0.5) * width
        wood.append(box((0.012, deep - 0.03, inner / (shelves + 1)), (x, 0.004, flap_z)))
    leaf = [box((width - 0.05, flap, 0.022), (0, -deep / 2 - flap / 2 - 0.002, flap_z - 0.012))]
    stays: list[Mesh] = []
    for s in SIDES:
        x = s * (width / 2 - 0.034)
        start = (x, -deep / 2 - flap * 0.75, flap_z + 0.01)
        stays.append(rod(start, (x, -deep / 2 + 0.03, flap_z + inner * 0.6), 0.006, 6))
        stays.append(box((0.025, flap * 0.6, 0.04), (x, -deep / 2 - flap * 0.3, flap_z - 0.055)))
    legs: list[Mesh] = []
    if sampler.chance(0.5):
        for px, py in corners(width, deep, 0.03):
            legs.append(lean(cone((0.013, 0.022), low), 0, -0.3 * py).translated(px, py * 1.3))
    else:
        legs = [box((0.032, 0.032, low + 0.003), (*at, 0)) for at in corners(width, deep, 0.018)]
        legs.append(box((width - 0.05, deep - 0.02, 0.02), (0, 0, sampler.uniform(0.1, 0.2))))
    surface = support_surface(width - 0.06, flap, flap_z + 0.01)
    y = -deep / 2 - flap / 2
    surface = surface._replace(y_min=surface.y_min + y, y_max=surface.y_max + y)
    return centred(
        assemble(
            "desk",
            (sampler.wood(), wood),
            (sampler.wood(), leaf),
            (sampler.metal(), stays),
            (frame(sampler), legs),
            support_surfaces=(surface,),
        )
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "desk": (
        pedestal_desk,
        roll_top,
        pigeonholes,
        secretary,
    )
}
