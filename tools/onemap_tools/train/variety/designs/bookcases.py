"""Bookcases: shelves full of books in other constructions than the plain upright case."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, cylinder, rod, rounded_box
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.book_rows import contents
from onemap_tools.train.variety.designs.bookcases_closed import CLOSED_BOOKCASES
from onemap_tools.train.variety.designs.joinery import case, feet, settled, shifted, upright_board

NAME = "bookcase"


def ladder(sampler: Sampler) -> Model:
    """A leaning ladder whose steps carry books, deeper towards the floor."""
    width, depth = sampler.size(0.5, 0.85), sampler.size(0.38, 0.5)
    height, levels = sampler.size(1.6, 2.0), sampler.integer(4, 5)
    top_d, t = sampler.uniform(0.16, 0.2), sampler.uniform(0.02, 0.035)
    inside = contents(sampler)
    frame: list[Mesh] = []
    boards: list[Mesh] = []
    back = depth / 2
    upright_back, round_bar = sampler.chance(0.5), sampler.chance(0.4)
    for side in (-1, 1):
        x = side * (width - t) / 2
        ends = [((-back + t, 0.0), (back - top_d, height))]
        if upright_back:
            ends.append(((back - t, 0.0), (back - t, height)))
        for (y0, z0), (y1, z1) in ends:
            if round_bar:
                frame.append(rod((x, y0, z0 + 0.004), (x, y1, z1), t * 0.6))
            else:
                plank = [(-t, 0.0), (t, 0.0), (y1 - y0 + t, z1), (y1 - y0 - t, z1)]
                beam = upright_board(plank, t, t / 2).rotated("z", 90)
                frame.append(beam.translated(x, y0))
    for level in range(levels):
        z = 0.12 + level * (height - 0.3) / (levels - 1)
        front = -back + t + (depth - top_d - t) * z / height
        deep = back - front
        at = (0.0, (back + front) / 2, z)
        boards.append(box((width - 2 * t - 0.002, deep, 0.022), at))
        boards.append(box((width - 2 * t - 0.002, 0.012, 0.06), (0, back - 0.006, z + 0.023)))
        gap = (height - 0.3) / (levels - 1) - 0.04
        inside.fill((width - 0.08, deep - 0.04, min(gap, 0.3)), (0, at[1], z + 0.022))
    if round_bar:
        frame.append(box((width - t, t, t), (0, back - top_d, height - t)))
    wood = sampler.wood()
    rails = wood if sampler.chance(0.4) else sampler.metal()
    model = assemble(NAME, (wood, boards), (rails, frame), *inside.groups())
    return settled(model)


def cube_grid(sampler: Sampler) -> Model:
    """A grid of square compartments with books, some closed by doors or filled by boxes."""
    columns, rows = sampler.choice([(2, 4), (2, 5), (3, 3), (3, 4), (4, 4), (4, 2), (1, 5), (5, 5)])
    cell, depth = sampler.uniform(0.31, 0.38), sampler.size(0.28, 0.4)
    thick, edge = sampler.uniform(0.012, 0.02), sampler.choice([0.02, 0.038, 0.05])
    width, height = columns * cell + edge, rows * cell + edge
    foot = sampler.uniform(0.06, 0.15) if sampler.chance(0.3) else 0.0
    body = case((width, depth, height), edge, foot)
    if sampler.chance(0.4):
        body.pop()
    for column in range(1, columns):
        x = column * cell - columns * cell / 2
        body.append(box((thick, depth - 0.004, height - 2 * edge), (x, 0, foot + edge)))
    for row in range(1, rows):
        z = foot + edge / 2 + row * cell
        body.append(box((width - 2 * edge, depth - 0.008, thick), (0, 0, z)))
    inside = contents(sampler)
    doors: list[Mesh] = []
    bins: list[Mesh] = []
    free = cell - max(edge, thick) - 0.004
    for index in range(columns * rows):
        x = (index % columns + 0.5 - columns / 2) * cell
        z = foot + edge / 2 + (index // columns) * cell + max(thick, edge / 2)
        kind = sampler.rng.random()
        if kind < 0.12:
            doors.append(box((free, 0.016, free), (x, 0.012 - depth / 2, z + 0.002)))
            doors.append(
                cylinder(0.012, 0.02, segments=8)
                .rotated("x", 90)
                .translated(x, 0.004 - depth / 2, z + free * 0.8)
            )
        elif kind < 0.22:
            bins.append(
                rounded_box((free * 0.93, depth * 0.88, free * 0.85), (x, 0, z + 0.001), 0.02)
            )
            bins.append(box((free * 0.3, 0.012, 0.03), (x, -depth * 0.44 - 0.004, z + free * 0.6)))
        else:
            inside.fill((free, depth - 0.03, free), (x, -0.005, z + 0.001))
    wood = sampler.wood() if sampler.chance(0.7) else sampler.plastic()
    stand = feet(sampler, width, depth, foot + 0.004) if foot else []
    return assemble(
        NAME,
        (wood, body),
        (sampler.metal(), stand),
        (wood if sampler.chance(0.4) else sampler.plastic(), doors),
        (sampler.fabric(), bins),
        *inside.groups(),
    )


def pipes(sampler: Sampler) -> Model:
    """Thick planks on a frame of plumbing pipes with flanges and joints."""
    width, depth = sampler.size(0.75, 1.5), sampler.size(0.26, 0.36)
    levels, bays = sampler.integer(3, 5), sampler.integer(1, 2)
    height, radius = (
        min(levels * sampler.size(0.34, 0.42) + 0.1, 1.95),
        sampler.uniform(0.012, 0.02),
    )
    plank = sampler.uniform(0.025, 0.045)
    square = sampler.chance(0.3)
    frame: list[Mesh] = []
    boards: list[Mesh] = []
    inside = contents(sampler)
    overhang = sampler.choice([0.0, 0.08])
    xs = np.linspace(-width / 2 + 0.03 + overhang, width / 2 - 0.03 - overhang, bays + 1)
    zs = [0.08 + k * (height - 0.1) / levels for k in range(levels + 1)]
    for x in xs.tolist():
        for y in (-depth / 2 + 0.03, depth / 2 - 0.03):
            frame.append(
                box((radius * 2, radius * 2, height), (x, y, 0))
                if square
                else cylinder(radius, height, (x, y, 0), 8)
            )
            if not square:
                frame.append(cylinder(radius * 2.2, 0.012, (x, y, 0), 12))
                frame += [cylinder(radius * 1.4, 0.04, (x, y, z - 0.045), 6) for z in zs]
        frame += [
            rod(
                (x, -depth / 2 + 0.03, z - 0.024), (x, depth / 2 - 0.03, z - 0.024), radius * 0.8, 6
            )
            for z in zs
        ]
    if sampler.chance(0.4):
        y, ends = depth / 2 - 0.03, (float(xs[0]), float(xs[-1]))
        frame.append(rod((ends[0], y, 0.1), (ends[1], y, height - 0.1), 0.006, 6))
        frame.append(rod((ends[1], y, 0.1), (ends[0], y, height - 0.1), 0.006, 6))
    for z, above in zip(zs, [*zs[1:], zs[-1] + 0.3], strict=True):
        boards.append(box((width, depth, plank), (0, 0, z)))
        if above > zs[-1] and sampler.chance(0.5):
            continue
        for left, right in zip(xs.tolist()[:-1], xs.tolist()[1:], strict=True):
            room = right - left - 2.6 * radius
            inside.fill(
                (room, depth - 0.03, above - z - plank - 0.05), ((left + right) / 2, 0, z + plank)
            )
    return assemble(NAME, (sampler.wood(), boards), (sampler.metal(), frame), *inside.groups())


def stepped(sampler: Sampler) -> Model:
    """Columns of unlike heights with boards at unlike levels, books in every bay."""
    columns, depth = sampler.integer(2, 4), sampler.size(0.25, 0.34)
    each, t = sampler.size(0.3, 0.42), sampler.uniform(0.016, 0.03)
    step, first = sampler.uniform(0.0, 0.36), sampler.integer(2, 4)
    rise, inside = sampler.uniform(0.3, 0.37), contents(sampler)
    order = list(range(columns)) if sampler.chance(0.5) else [k % 2 for k in range(columns)]
    if sampler.chance(0.4):
        order.reverse()
    offset = sampler.choice([0.0, 0.5])
    body: list[Mesh] = []
    for column, place in enumerate(order):
        x = (column - (columns - 1) / 2) * each
        height = min(first * rise + place * step * 1.5 + offset * rise, 2.2)
        shell = shifted(case((each - 0.001, depth, height), t), x, 0)
        body += shell if sampler.chance(0.7) else shell[:-1]
        levels = max(1, round((height - t) / rise))
        marks = np.linspace(0, height - t, levels + 1) + 0.0
        marks[1:-1] += sampler.uniform(-0.05, 0.05) * (levels > 1)
        for low, high in zip(marks.tolist()[:-1], marks.tolist()[1:], strict=True):
            if low:
                body.append(box((each - 2 * t, depth - 0.012, t), (x, -0.004, low)))
            inside.fill(
                (each - 2 * t, depth - 0.04, high - low - t - 0.01), (x, -0.01, low + t + 0.001)
            )
        if sampler.chance(0.3):
            inside.fill((each * 0.9, depth - 0.04, 0.26), (x, -0.01, height + 0.001))
    return assemble(NAME, (sampler.wood(), body), *inside.groups())


def spine_tower(sampler: Sampler) -> Model:
    """A slim column on a foot plate with small trays on which books lie in piles."""
    width, depth = sampler.size(0.3, 0.42), sampler.size(0.28, 0.36)
    height, levels = sampler.size(1.3, 2.0), sampler.integer(6, 11)
    post, plate = sampler.uniform(0.03, 0.1), sampler.uniform(0.015, 0.04)
    frame = [
        rounded_box((width, depth, plate), (0, 0, 0), 0.006),
        box((post, 0.03, height - plate), (0, depth / 2 - 0.02, plate)),
    ]
    covers: list[list[Mesh]] = [[] for _ in range(6)]
    gap = (height - 0.1) / levels
    for level in range(levels):
        z = 0.06 + level * gap
        deep = depth - 0.06
        frame.append(box((width * 0.62, deep, 0.006), (0, -0.02, z)))
        top = z + 0.007
        while top < z + gap * sampler.uniform(0.6, 0.9) - 0.03:
            thick = sampler.uniform(0.015, 0.045)
            size = (width * sampler.uniform(0.65, 0.98), deep * sampler.uniform(0.8, 1.0), thick)
            turn = sampler.uniform(-6, 6)
            book = box(size).rotated("z", turn).translated(0, -0.02, top)
            sampler.choice(covers).append(book)
            top += thick + 0.001
    return assemble(
        NAME,
        (sampler.metal() if sampler.chance(0.6) else sampler.wood(), frame),
        *((sampler.plastic(), cover) for cover in covers),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    NAME: (ladder, cube_grid, pipes, stepped, spine_tower, *CLOSED_BOOKCASES)
}
