"""Mirrors with lamps: bathroom cabinets and dressing-room mirrors."""

from __future__ import annotations

from onemap_simulator.generation.furniture.wall_decor import frame
from onemap_simulator.generation.mesh import Mesh, Vec, box, ellipsoid, front_panel, rounded_box
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.mirror_parts import edge_material, mirror_glass
from onemap_tools.train.variety.designs.sanitary import stand


def _cabinet_lamps(sampler: Sampler, size: Vec) -> tuple[list[Mesh], list[Mesh]]:
    """The rail for bulbs and the lamps of a cabinet: bulbs, a tube at each side, a bar or none."""
    width, depth, height = size
    rail: list[Mesh] = []
    lamps: list[Mesh] = []
    y, kind = -depth / 2, sampler.integer(0, 3)
    if kind == 0:
        rail.append(box((width * 0.8, 0.05, 0.04), (0, 0, height - 0.002)))
        bulbs = sampler.integer(3, 6)
        lamps = [
            ellipsoid(
                (0.032, 0.032, 0.032),
                ((i - (bulbs - 1) / 2) * width * 0.75 / bulbs, y + 0.02, height + 0.045),
                10,
            )
            for i in range(bulbs)
        ]
    elif kind == 1:
        lamps = [
            rounded_box(
                (0.035, 0.05, height * 0.8),
                (s * (width / 2 + 0.016), y + 0.03, height * 0.1),
                0.015,
            )
            for s in (-1, 1)
        ]
    elif kind == 2:
        lamps = [rounded_box((width * 0.6, 0.1, 0.03), (0, y, height - 0.002), 0.012)]
    return rail, lamps


def cabinet_mirror(sampler: Sampler) -> Model:
    """A shallow bathroom cabinet with one to three mirror doors and lamps above or beside."""
    width, height, depth = sampler.size(0.45, 1.0), sampler.size(0.5, 0.75), sampler.size(0.1, 0.16)
    count = sampler.integer(1, 3)
    each, glass, low = width / count, mirror_glass(sampler), 0.0
    body = [box((width, depth - 0.02, height), (0, 0.01, low))]
    doors: list[Mesh] = []
    plates: list[Mesh] = []
    ajar = sampler.integer(0, count - 1) if sampler.chance(0.3) else -1
    for i in range(count):
        x = (i - (count - 1) / 2) * each
        leaf = box((each - 0.008, 0.016, height - 0.008), (0, 0, low + 0.004))
        sheet = front_panel(each - 0.03, height - 0.03, (0, -0.01, low + 0.015))
        for mesh, group in ((leaf, doors), (sheet, plates)):
            moved = mesh.translated(each / 2, 0)
            turned = moved.rotated("z", -40 if i == ajar else 0)
            group.append(turned.translated(x - each / 2, -depth / 2))
    fittings, lamps = _cabinet_lamps(sampler, (width, depth, height))
    body += fittings
    if sampler.chance(0.4):
        body.append(box((width, depth, 0.02), (0, 0, -0.13)))
        body += [box((0.02, depth, 0.13), (s * (width / 2 - 0.01), 0, -0.125)) for s in (-1, 1)]
    case = sampler.wood()
    return stand(
        "mirror",
        (case, body),
        (case if sampler.chance(0.5) else sampler.metal(), doors),
        (glass, plates),
        (sampler.pale(), lamps),
    )


def with_lamps(sampler: Sampler) -> Model:
    """A dressing-room mirror: bulbs all around a wide frame, or a glowing band in the glass."""
    width, height, bar = (
        sampler.size(0.55, 0.95),
        sampler.size(0.5, 0.8),
        sampler.uniform(0.06, 0.1),
    )
    depth = sampler.uniform(0.04, 0.08)
    parts = frame(width, height, bar, depth)
    parts.append(box((width - 0.02, 0.02, height - 0.02), (0, -0.01, 0.01)))
    lamps: list[Mesh] = []
    if sampler.chance(0.6):
        rows, radius = sampler.integer(3, 5), bar * 0.34
        for i in range(rows):
            z = bar / 2 + i * (height - bar) / (rows - 1)
            lamps += [
                ellipsoid(
                    (radius, radius, radius), (s * (width - bar) / 2, -depth - radius * 0.6, z), 8
                )
                for s in (-1, 1)
            ]
        across = sampler.integer(2, 4)
        for i in range(across):
            x = ((i + 1) / (across + 1) - 0.5) * (width - bar)
            lamps.append(
                ellipsoid((radius, radius, radius), (x, -depth - radius * 0.6, height - bar / 2), 8)
            )
    else:
        lamps = [
            m.translated(0, -0.024, bar)
            for m in frame(width - 2 * bar, height - 2 * bar, 0.025, 0.012)
        ]
    plate = front_panel(width - 2 * bar, height - 2 * bar, (0, -0.022, bar))
    return stand(
        "mirror",
        (edge_material(sampler), parts),
        (mirror_glass(sampler), [plate]),
        (sampler.pale(), lamps),
    )
