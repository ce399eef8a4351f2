"""Sinks of many makes, for bathrooms and kitchens; all stand on the floor."""

from __future__ import annotations

from onemap_simulator.generation.mesh import Mesh, box, cylinder, ellipsoid, lathe, rod
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.basin_parts import Size, basin_slab, free_bowl, siphon
from onemap_tools.train.variety.designs.sanitary import Group, faucet, stand
from onemap_tools.train.variety.designs.washbasins_bare import pedestal, wall_hung


def carcass(size: Size, low: float, top: float, bowls_from: float) -> list[Mesh]:
    """A cabinet's body whose upper part, from ``bowls_from``, is hollow to hold the bowls."""
    x, y = size[0] / 2, size[1] / 2
    full = min(bowls_from, top)
    body = [box((*size, full - low), (0, 0.005, low))]
    if top - full > 0.01:
        tall = top - full + 0.005
        body += [box((0.02, size[1], tall), (s * (x - 0.01), 0.005, full - 0.005)) for s in (-1, 1)]
        body += [
            box((size[0] - 0.03, 0.02, tall), (0, s * (y - 0.012) + 0.005, full - 0.005))
            for s in (-1, 1)
        ]
    return body


def cabinet_front(sampler: Sampler, size: Size, z: Size, y: float) -> tuple[list[Mesh], list[Mesh]]:
    """Doors or drawers over a width (size[0]) and their handles; some may stand open."""
    width, low, high = size[0], z[0], z[1]
    leaves: list[Mesh] = []
    handles: list[Mesh] = []
    framed, knob = sampler.chance(0.4), sampler.chance(0.4)
    drawers = sampler.chance(0.45)
    count = sampler.integer(1, 3) if drawers else max(2, round(width / 0.4))
    open_at = sampler.integer(0, count) if sampler.chance(0.25) else -1
    for i in range(count):
        if drawers:
            tall, w = (high - low) / count, width - 0.012
            at = (0.0, y - 0.01 - (0.15 if i == open_at else 0.0), low + i * tall)
        else:
            tall, w = high - low, width / count - 0.01
            at = ((i - (count - 1) / 2) * width / count, y - 0.01, low)
        leaf = [box((w, 0.02, tall - 0.01), at)]
        if drawers and i == open_at:
            leaf.append(box((w - 0.03, 0.16, tall * 0.6), (at[0], at[1] + 0.085, at[2] + 0.02)))
        if framed:
            leaf += [
                box((w, 0.01, 0.04), (at[0], at[1] - 0.014, at[2] + s)) for s in (0, tall - 0.05)
            ]
            leaf += [
                box((0.04, 0.01, tall - 0.01), (at[0] + s * (w / 2 - 0.02), at[1] - 0.0155, at[2]))
                for s in (-1, 1)
            ]
        side = 0.0 if drawers else (w / 2 - 0.05) * (1 if i % 2 == 0 else -1)
        grip = (at[0] + side, at[1] - 0.03, at[2] + tall * (0.6 if drawers else 0.75))
        if knob:
            handles.append(ellipsoid((0.016, 0.02, 0.016), grip, 8))
        else:
            bar = (min(0.2, w * 0.5), 0.025, 0.012) if drawers else (0.012, 0.025, 0.12)
            handles.append(box(bar, grip))
        leaves += leaf
    return leaves, handles


def vessel_console(sampler: Sampler) -> Model:
    """A free bowl that stands on a console: a board on legs, a shelf below, a high tap."""
    width, depth, top = sampler.size(0.6, 1.1), sampler.size(0.42, 0.54), sampler.size(0.7, 0.8)
    bowl_h, d = sampler.size(0.1, 0.17), sampler.size(0.34, 0.42)
    power, x = sampler.choice((2.0, 2.0, 3.0, 8.0)), sampler.uniform(-0.5, 0.5) * (width - 0.55)
    bowl_w = d * sampler.choice((1.0, 1.3))
    bowl = free_bowl(
        (min(bowl_w, width - 0.06), d), top, top + bowl_h, power, sampler.uniform(0.35, 0.85)
    )
    thick = sampler.uniform(0.03, 0.09)
    board = [box((width, depth, thick), (0, 0, top - thick))]
    legs: list[Mesh] = []
    lx, ly = width / 2 - 0.03, depth / 2 - 0.03
    splay = sampler.choice((0.0, 0.04))
    for sx in (-1, 1):
        for sy in (-1, 1):
            if splay:
                legs.append(
                    rod(
                        (sx * lx, sy * ly, 0),
                        (sx * (lx - splay), sy * (ly - splay), top - thick),
                        0.02,
                    )
                )
            else:
                legs.append(box((0.04, 0.04, top - thick), (sx * lx, sy * ly, 0)))
    if sampler.chance(0.6):
        z = sampler.uniform(0.12, 0.3)
        board.append(box((width - 0.08, depth - 0.06, 0.02), (0, 0, z)))
        if sampler.chance(0.5):
            board += [
                box((width - 0.08, 0.018, 0.04), (0, s * (depth / 2 - 0.035), z + 0.018))
                for s in (-1, 1)
            ]
    if sampler.chance(0.4):
        legs.append(rod((-lx, -ly - 0.02, top - 0.15), (lx, -ly - 0.02, top - 0.15), 0.01))
    tap = [m.scaled(1, 1, 1.2) for m in faucet(sampler, (0, 0, 0))]
    tap = [m.translated(x, depth / 2 - 0.04, top) for m in tap]
    neck = cylinder(0.022, bowl_h * 0.6, (x, depth / 2 - 0.04, top), 10)
    trap = siphon((x, 0.0), top - thick, False, depth / 2)
    return stand(
        "sink",
        (
            sampler.ceramic() if sampler.chance(0.75) else sampler.metal(),
            [bowl.translated(x, -0.035)],
        ),
        (sampler.wood(), board),
        (sampler.metal() if sampler.chance(0.5) else sampler.wood(), legs),
        (sampler.metal(), [*tap, neck, *trap]),
    )


def _footing(size: Size, lift: float) -> list[Mesh]:
    """What a cabinet stands on: four turned legs if it is lifted high, else a plinth."""
    width, depth = size
    if lift > 0.15:
        return [
            lathe(
                [(0.014, 0), (0.024, lift + 0.01)],
                (sx * (width / 2 - 0.06), sy * (depth / 2 - 0.06), 0),
                8,
            )
            for sx in (-1, 1)
            for sy in (-1, 1)
        ]
    return [box((width - 0.08, depth - 0.1, lift + 0.005), (0, 0.02, 0))]


def _cabinet(sampler: Sampler, size: Size, height: float, bowls: int) -> list[Group]:
    """A vanity: a carcass on plinth or legs, a slab with its basins, a tap for each."""
    width, depth = size
    thick, lift = sampler.uniform(0.02, 0.12), sampler.choice((0.06, 0.1, 0.18))
    low = height - thick
    body = carcass((width - 0.02, depth - 0.03), lift, low, height - 0.16)
    legs = _footing(size, lift)
    leaves, handles = cabinet_front(
        sampler, (width - 0.03, 0.0), (lift + 0.012, low - 0.012), -depth / 2 + 0.012
    )
    each = width / bowls
    slabs: list[Mesh] = []
    taps: list[Mesh] = []
    on_top, power = sampler.chance(0.3), sampler.choice((2.0, 2.5, 4.0, 9.0))
    for i in range(bowls):
        x = (i - (bowls - 1) / 2) * each
        if on_top:
            bowl = free_bowl((min(0.42, each - 0.1), 0.36), height, height + 0.12, power, 0.6)
            slabs += [bowl.translated(x, -0.03), box((each - 0.001, depth, thick), (x, 0, low))]
        else:
            hole = (min(each - 0.1, sampler.uniform(0.4, 0.56)), depth * 0.66)
            slabs.append(
                basin_slab((each, depth), hole, (low, height), 0.13, power).translated(x, 0)
            )
        tap = faucet(sampler, (x, depth / 2 - 0.05, height))
        taps += [m.translated(0, 0, 0.06 if on_top else 0) for m in tap]
        taps += [cylinder(0.02, 0.07, (x, depth / 2 - 0.05, height), 8)] if on_top else []
    if sampler.chance(0.4):
        slabs.append(box((width, 0.018, 0.1), (0, depth / 2 - 0.009, height - 0.005)))
    wood = sampler.wood()
    top = (
        sampler.ceramic()
        if sampler.chance(0.7)
        else sampler.material("marble", 0.8, sampler.colour())
    )
    return [
        (top, slabs),
        (wood, [*body, *leaves]),
        (sampler.metal(), [*handles, *taps]),
        (sampler.wood() if sampler.chance(0.4) else wood, legs),
    ]


def vanity(sampler: Sampler) -> Model:
    """A cabinet with doors or drawers under a slab with one basin."""
    size = (sampler.size(0.5, 0.95), sampler.size(0.42, 0.54))
    return stand("sink", *_cabinet(sampler, size, sampler.size(0.78, 0.9), 1))


def double_vanity(sampler: Sampler) -> Model:
    """A wide cabinet with two basins side by side and two taps."""
    size = (sampler.size(1.1, 1.5), sampler.size(0.46, 0.56))
    return stand("sink", *_cabinet(sampler, size, sampler.size(0.8, 0.9), 2))


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "sink": (pedestal, vessel_console, vanity, double_vanity, wall_hung)
}
