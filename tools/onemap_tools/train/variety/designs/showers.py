"""Showers of many makes: cubicles, walk-in screens, curtains, columns, cabins."""

from __future__ import annotations

import itertools

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import Mesh, box, box_between, rod, rounded_box, tube
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.sanitary import ring, shower_set, skin, stand
from onemap_tools.train.variety.designs.shower_parts import (
    clad_walls,
    clear_glass,
    corner_outline,
    flat_tray,
    floor_drain,
    glass_pane,
    pull_handle,
    wall_tiles,
)
from onemap_tools.train.variety.designs.showers_open import column, curtained, walk_in


def _bars(points: list[tuple[float, float]], low: float, top: float, thick: float) -> list[Mesh]:
    """Posts at the points of the floor, and rails between them at the bottom and the top."""
    meshes = [box((thick, thick, top - low), (x, y, low)) for x, y in points]
    for start, end in itertools.pairwise(points):
        for z in (low, top - thick):
            rail = glass_pane(start, end, z, z + thick)
            along = np.subtract(end, start) / np.linalg.norm(np.subtract(end, start))
            side = (-along[1] * thick * 0.4, along[0] * thick * 0.4)
            meshes += [rail.translated(*side), rail, rail.translated(-side[0], -side[1])]
    return meshes


def corner_cubicle(sampler: Sampler) -> Model:
    """A square cubicle with two framed glass sides and a door that may stand ajar."""
    side, tray_h, top = sampler.size(0.78, 1.0), sampler.size(0.05, 0.2), sampler.size(1.85, 2.1)
    deep = side * sampler.uniform(0.9, 1.1)
    x, y, thick = side / 2 - 0.03, deep / 2 - 0.03, sampler.uniform(0.02, 0.045)
    panes = [glass_pane((x, -y), (x, y), tray_h, top)]
    metal = _bars([(-x, -y), (x, -y), (x, y)], tray_h, top, thick)
    count, ajar = sampler.integer(1, 3), sampler.choice((0.0, 0.0, 30.0, 45.0))
    if count == 1:
        door = box_between((0.01, -0.004, tray_h + 0.02), (2 * x - 0.02, 0.004, top - thick))
        grip = pull_handle((2 * x - 0.1, -0.004, 1.0), 0.2)
        panes.append(door.rotated("z", -ajar).translated(-x, -y))
        metal.append(grip.rotated("z", -ajar).translated(-x, -y))
    else:
        each = 2 * x / count
        gone = sampler.integer(0, count)
        for i in range(count):
            start = -x + (max(i - 1, 0) if i == gone else i) * each
            shift = -y + 0.014 * (i % 2)
            panes.append(
                glass_pane((start, shift), (start + each, shift), tray_h + 0.02, top - thick)
            )
            metal.append(
                box((0.02, 0.02, top - tray_h - 0.02), (start + each, shift, tray_h + 0.01))
            )
    set_h = sampler.uniform(0.95, 1.15)
    pipes = shower_set(sampler, (0, deep / 2, set_h), sampler.uniform(1.8, 2.0))
    return stand(
        "shower",
        (sampler.ceramic(), [flat_tray((side, deep), tray_h)]),
        (wall_tiles(sampler), clad_walls(sampler, (side, deep), top)),
        (clear_glass(sampler), panes),
        (sampler.metal(), metal),
        (sampler.metal(), [*pipes, floor_drain((0, 0, max(tray_h - 0.06, tray_h * 0.4)))]),
    )


def _quarter(sampler: Sampler, bow: float) -> Model:
    side, tray_h, top = sampler.size(0.8, 1.0), sampler.size(0.04, 0.18), sampler.size(1.85, 2.05)
    outline = corner_outline(side, bow)

    def at(scale: float, z: float) -> F64:
        return np.concatenate([outline * scale, np.full((40, 1), z)], axis=1)

    tray = skin([at(1.0, 0), at(1.0, tray_h), at(0.9, tray_h), at(0.86, tray_h * 0.5)])
    inset = outline * 0.96
    front = [p for p in np.roll(inset, -10, axis=0) if p[0] > -side * 0.485 and p[1] < side * 0.485]
    path = [
        (float(p[0]), float(p[1]))
        for p in front
        if p[0] > side * 0.47 or p[1] < -side * 0.47 or p[0] - p[1] > 0
    ]
    path = sorted(path, key=lambda p: np.arctan2(p[1] - side / 2, p[0] + side / 2))
    gap = sampler.choice((0, 3, 5, 7))
    first = len(path) // 2 - gap // 2
    panes = [
        glass_pane(a, b, tray_h, top)
        for i, (a, b) in enumerate(itertools.pairwise(path))
        if not first <= i < first + gap
    ]
    posts = [path[0], path[max(first, 1)], path[first + max(gap, 1)], path[-1]]
    thick = sampler.uniform(0.02, 0.04)
    metal = [box((thick, thick, top - tray_h), (x, y, tray_h)) for x, y in posts]
    metal += [tube([(x, y, z) for x, y in path], thick * 0.55, 6) for z in (tray_h + 0.01, top)]
    grips = [
        rod((x * 1.06, y * 1.06, 0.95), (x * 1.06, y * 1.06, 1.25), 0.01) for x, y in posts[1:3]
    ]
    grips += [
        rod((x, y, z), (x * 1.06, y * 1.06, z), 0.008) for x, y in posts[1:3] for z in (0.97, 1.23)
    ]
    pipes = shower_set(sampler, (-side * 0.15, side / 2, 1.05), sampler.uniform(1.8, 2.0))
    return stand(
        "shower",
        (sampler.ceramic(), [tray]),
        (wall_tiles(sampler), clad_walls(sampler, (side, side), top)),
        (clear_glass(sampler), panes),
        (sampler.metal(), [*metal, *grips]),
        (sampler.metal(), [*pipes, floor_drain((0, 0, tray_h * 0.5))]),
    )


def quadrant(sampler: Sampler) -> Model:
    """A corner shower with a round front of curved glass, its doors shut or apart."""
    return _quarter(sampler, sampler.uniform(0.72, 0.82))


def five_sided(sampler: Sampler) -> Model:
    """A corner shower with its front cut straight across."""
    return _quarter(sampler, 0.0)


def cabin(sampler: Sampler) -> Model:
    """A closed cabin: a deep tub below, a roof above, glass all round and a mast inside."""
    side, top = sampler.size(0.85, 1.1), sampler.size(2.0, 2.2)
    base = sampler.uniform(0.15, 0.42)
    size, half = (side, side), side / 2 - 0.02
    roof = skin(
        [
            ring(size, top, 6.0),
            ring(size, top + 0.06, 6.0),
            ring((side * 0.8, side * 0.8), top + 0.11, 6.0),
        ]
    )
    tub = skin(
        [
            ring((side * 0.96, side * 0.96), 0, 6.0),
            ring(size, base, 6.0),
            ring((side - 0.1, side - 0.1), base, 6.0),
            ring((side * 0.7, side * 0.7), 0.08, 6.0),
        ]
    )
    mast = rounded_box((0.28, 0.08, top - base), (0, half - 0.04, base), 0.03)
    inset = half - 0.05
    points = [(-inset, inset), (-inset, -inset), (inset, -inset), (inset, inset)]
    gap = sampler.uniform(0.0, 0.9) * inset
    panes = [
        glass_pane(points[0], points[1], base, top),
        glass_pane(points[2], points[3], base, top),
    ]
    panes += [
        glass_pane((-inset, -inset), (-gap, -inset), base, top),
        glass_pane((gap, -inset), (inset, -inset), base, top),
    ]
    metal = [box((0.03, 0.03, top - base), (x, y, base)) for x, y in points]
    metal += [box((0.02, 0.03, top - base), (s * (gap + 0.01), -inset, base)) for s in (-1, 1)]
    metal += [pull_handle((s * (gap + 0.06), -inset - 0.004, 1.05), 0.22) for s in (-1, 1)]
    metal += shower_set(sampler, (0, half - 0.08, 1.05), top - 0.15)
    shell_material = sampler.plastic()
    return stand(
        "shower",
        (shell_material, [roof, tub]),
        (sampler.plastic() if sampler.chance(0.5) else shell_material, [mast]),
        (clear_glass(sampler), panes),
        (sampler.metal(), metal),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "shower": (corner_cubicle, walk_in, quadrant, five_sided, curtained, column, cabin)
}
