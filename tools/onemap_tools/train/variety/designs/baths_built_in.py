"""Bathtubs built in: behind panels, in tiled ledges, with a shower and a screen."""

from __future__ import annotations

from onemap_simulator.generation.mesh import Mesh, box, box_between, cylinder, rounded_box
from onemap_simulator.generation.model import Material, Model
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.bath_parts import Size, bath_extras, bath_size, tap_on_rim
from onemap_tools.train.variety.designs.sanitary import (
    SQUARE,
    Group,
    faucet,
    ring,
    shell,
    shower_set,
    skin,
    stand,
)


def _sunk(size: Size, hole: Size, height: float, power: float, low: float = 0.0) -> Mesh:
    """A rectangular block from ``low`` with a rounded basin sunk into its top."""
    deep = height * 0.28 + low * 0.3
    rings = [ring(size, low, SQUARE), ring(size, height, SQUARE), ring(hole, height, power)]
    rings += [
        ring((hole[0] * s, hole[1] * s), z, power) for s, z in ((0.97, height - 0.03), (0.82, deep))
    ]
    return skin([*rings, ring((hole[0] * 0.5, hole[1] * 0.5), deep - 0.01, power)])


def _panel_front(sampler: Sampler, size: Size, height: float) -> list[Mesh]:
    """What covers the front below the rim: fielded panels, boards or a flat sheet."""
    y, kind = -size[1] / 2 - 0.006, sampler.integer(0, 2)
    sheet = [box((size[0] - 0.02, 0.012, height - 0.06), (0, y, 0.01))]
    if kind == 0:
        count = sampler.integer(2, 4)
        each = size[0] / count
        frame = [
            box((each - 0.14, 0.012, height - 0.24), ((i - (count - 1) / 2) * each, y - 0.01, 0.1))
            for i in range(count)
        ]
        return [*sheet, *frame, box((size[0] - 0.02, 0.014, 0.08), (0, y - 0.008, 0.012))]
    if kind == 1:
        count = int(size[0] / 0.11)
        each = (size[0] - 0.02) / count
        return [
            rounded_box(
                (each - 0.006, 0.02, height - 0.07),
                ((i - (count - 1) / 2) * each, y - 0.002, 0.015),
                0.006,
            )
            for i in range(count)
        ]
    return [*sheet, box((0.03, 0.008, height - 0.1), (size[0] * 0.25, y - 0.008, 0.03))]


def _built_in(sampler: Sampler, size: Size, height: float) -> list[Group]:
    ceramic, power = sampler.ceramic(), sampler.uniform(3.0, 7.0)
    hole = (size[0] - sampler.uniform(0.14, 0.24), size[1] - sampler.uniform(0.12, 0.18))
    body = [_sunk((size[0] - 0.03, size[1] - 0.03), hole, height - 0.004, power)]
    lip = sampler.uniform(0.03, 0.06)
    x, y = size[0] / 2, size[1] / 2
    body.append(rounded_box((size[0], 0.05, lip), (0, -y + 0.02, height - lip), 0.015))
    body += [
        rounded_box((0.05, size[1], lip), (s * (x - 0.02), 0, height - lip), 0.015) for s in (-1, 1)
    ]
    apron = [m.translated(0, 0.006) for m in _panel_front(sampler, size, height)]
    cover = (
        sampler.wood() if sampler.chance(0.5) else sampler.material("tiles", 0.5, sampler.colour())
    )
    tap = tap_on_rim(sampler, -x + 0.06, height)
    drain = [
        cylinder(0.035, 0.02, segments=10)
        .rotated("y", 90)
        .translated(-hole[0] * 0.46, 0, height * 0.75)
    ]
    return [
        (ceramic, body),
        (ceramic if sampler.chance(0.25) else cover, apron),
        (sampler.metal(), [*tap, *drain]),
    ]


def built_in(sampler: Sampler) -> Model:
    """A rectangular bath with a rim and a front panel of boards, fields or tiles."""
    length, width, height = bath_size(sampler)
    size = (length, width)
    return stand("bathtub", *_built_in(sampler, size, height), *bath_extras(sampler, size, height))


def tiled_surround(sampler: Sampler) -> Model:
    """A bath sunk in a tiled ledge that is wider than it, with a step or a niche wall."""
    length, width, height = bath_size(sampler)
    deck = (length + sampler.uniform(0.1, 0.3), width + sampler.uniform(0.1, 0.25))
    hole, power = (length - 0.1, width - 0.08), sampler.choice((2.0, 2.5, 4.0))
    rise = 0.03
    outer = [
        ring(deck, 0.0, SQUARE),
        ring(deck, height, SQUARE),
        ring((hole[0] + 0.02, hole[1] + 0.02), height, power),
    ]
    ledge = [skin(outer, capped=False)]
    lips = [
        (1.05, height + 0.003),
        (1.05, height + rise),
        (0.98, height + rise),
        (0.8, 0.16),
        (0.5, 0.14),
    ]
    tub = skin([ring((hole[0] * s, hole[1] * s), z, power) for s, z in lips], capped=False)
    floor = shell([(0.55, 0.13), (0.55, 0.145)], hole, power)
    if sampler.chance(0.5):
        ledge.append(box((deck[0] * 0.6, 0.28, height * 0.42), (0, -deck[1] / 2 - 0.13, 0)))
    if sampler.chance(0.4):
        ledge.append(box((deck[0], 0.06, sampler.uniform(0.9, 1.4)), (0, deck[1] / 2 + 0.028, 0)))
    tiles: Material = sampler.material("tiles", sampler.uniform(0.25, 0.6), sampler.colour())
    tap = faucet(sampler, (0, hole[1] / 2 + 0.06, height + 0.002))
    surface = tiles if sampler.chance(0.7) else sampler.wood()
    return stand(
        "bathtub", (surface, ledge), (sampler.ceramic(), [tub, floor]), (sampler.metal(), tap)
    )


def with_screen(sampler: Sampler) -> Model:
    """A built-in bath with a shower: riser, rose and a glass screen on the rim."""
    length, width, height = bath_size(sampler)
    size, top = (length, width), sampler.uniform(1.85, 2.1)
    groups = _built_in(sampler, size, height)
    x0, y = -length / 2 + 0.02, -width / 2 + 0.03
    leaves = sampler.integer(1, 2)
    each = length * sampler.uniform(0.42, 0.55) / leaves
    glass: list[Mesh] = []
    bars = [box((0.025, 0.03, top - height), (x0, y, height))]
    fold = sampler.choice((0.0, 0.0, 35.0, 70.0))
    for index in range(leaves):
        turn = 0.0 if index == 0 and leaves == 2 else fold
        start = x0 + index * each
        for low, high, target in ((0.01, each - 0.01, glass), (each - 0.015, each, bars)):
            leaf = box_between((low, -0.004, height + 0.02), (high, 0.004, top - 0.01))
            wide = leaf if target is glass else leaf.scaled(1, 2.5, 1)
            target.append(wide.rotated("z", turn).translated(start, y, 0))
    back = [box_between((x0 - 0.04, -width / 2, height * 0.5), (x0 - 0.022, width / 2, top + 0.1))]
    pipes = [
        m.rotated("z", 90).translated(x0 + 0.02, 0, 0)
        for m in shower_set(sampler, (0, 0, height + 0.35), top)
    ]
    tiles = sampler.material("tiles", 0.5, sampler.colour())
    clear = sampler.material("plain", 0.5, (0.75, 0.85, 0.88))
    return stand(
        "bathtub", *groups, (tiles, back), (clear, glass), (sampler.metal(), [*bars, *pipes])
    )
