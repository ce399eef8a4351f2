"""Potted plants with forms of their own: snake plants, cacti, succulents, trailers, orchids."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, cylinder, ellipsoid, lathe, rod, tube
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.flat_forms import settled
from onemap_tools.train.variety.designs.plant_parts import (
    HEART,
    LANCE,
    OVAL,
    STRAP,
    Groups,
    arch,
    leaf,
    pot,
    potted,
)


def snake_plant(sampler: Sampler) -> Model:
    """Stiff upright swords, flat or round, close together."""
    base = pot(sampler, sampler.size(0.07, 0.16))
    tall = sampler.size(0.3, 0.9)
    leaves = []
    round_ones = sampler.chance(0.2)
    for index in range(sampler.integer(7, 16)):
        turn, out = index * 137.5, base.radius * sampler.uniform(0.05, 0.7)
        x, y = out * float(np.cos(np.radians(turn))), out * float(np.sin(np.radians(turn)))
        long = tall * sampler.uniform(0.5, 1.0)
        if round_ones:
            spike = lathe([(0.014, 0), (0.016, long * 0.5), (0.002, long)], segments=7)
            leaves.append(
                spike.rotated("y", sampler.uniform(0, 18))
                .rotated("z", turn)
                .translated(x, y, base.soil_z - 0.005)
            )
            continue
        wide = sampler.uniform(0.05, 0.09) * (0.6 + tall * 0.6)
        sword = leaf((wide, long), (sampler.uniform(72, 92), sampler.uniform(-12, 12)), STRAP, 0.35)
        leaves.append(
            sword.rotated("z", turn + sampler.uniform(-60, 60)).translated(
                x, y, base.soil_z - 0.005
            )
        )
    return potted(sampler, base, leaves, [])


def _column(radius: float, height: float, ribs: int) -> Mesh:
    """A ribbed column with a domed top."""
    profile = [(radius * 0.9, 0), (radius, height * 0.3), (radius, height - radius)]
    profile += [(radius * 0.75, height - radius * 0.35), (radius * 0.1, height)]
    plain = lathe(profile, segments=2 * ribs)
    angle = np.arctan2(plain.vertices[:, 1], plain.vertices[:, 0])
    shrink = np.where(np.round(angle / (np.pi / ribs)).astype(int) % 2 == 0, 1.0, 0.8)
    factor = np.stack([shrink, shrink, np.ones_like(shrink)], axis=1)
    return Mesh(plain.vertices * factor, plain.faces, plain.uv)


def cactus(sampler: Sampler) -> Model:
    """A cactus: a ribbed column with arms, a group of columns, a ball, or flat paddles."""
    base = pot(sampler, sampler.size(0.06, 0.15))
    tall, kind, z = sampler.size(0.15, 0.8), sampler.integer(0, 3), base.soil_z - 0.005
    r, ribs = min(base.radius * 0.6, 0.08), sampler.integer(6, 10)
    body: list[Mesh] = []
    if kind == 0:
        body.append(_column(r, tall, ribs).translated(0, 0, z))
        for side in (-1, 1) if sampler.chance(0.7) else (1,):
            high, out = tall * sampler.uniform(0.35, 0.6), side * r * 2.2
            body.append(
                tube(
                    [(0, 0, z + high), (out * 0.8, 0, z + high), (out, 0, z + high + r)], r * 0.5, 8
                )
            )
            body.append(
                _column(r * 0.55, tall * sampler.uniform(0.2, 0.35), 6).translated(
                    out, 0, z + high + r * 0.6
                )
            )
    elif kind == 1:
        for index in range(sampler.integer(3, 6)):
            a, out = index * 2.4, base.radius * 0.6 * (index > 0)
            one = _column(r * 0.6, tall * sampler.uniform(0.4, 1.0), ribs)
            body.append(one.translated(out * float(np.cos(a)), out * float(np.sin(a)), z))
    elif kind == 2:
        ball = base.radius * sampler.uniform(0.85, 1.15)
        body.append(_column(ball, ball * sampler.uniform(1.5, 1.9), ribs + 4).translated(0, 0, z))
        body.append(ellipsoid((ball * 0.25, ball * 0.25, ball * 0.16), (0, 0, z + ball * 1.6), 8))
    else:
        size = tall * 0.3
        for index, (x, level, tilt) in enumerate(
            ((0, 0, 0), (0, 1.6, 12), (0.7, 1.3, 50), (-0.7, 1.3, -45), (0.3, 3.0, 20))
        ):
            paddle = ellipsoid((size * 0.65, size * 0.16, size), (0, 0, size * 0.95), 12)
            turned = paddle.rotated("y", tilt).rotated("z", index * 17)
            body.append(turned.translated(x * size * 0.5, 0, z + level * size))
    groups: Groups = [*base.groups, (sampler.foliage(), body)]
    if kind < 2 and sampler.chance(0.3):
        x, y = body[0].vertices[body[0].vertices[:, 2].argmax(), :2].tolist()
        top = float(body[0].vertices[:, 2].max())
        groups.append((sampler.plastic(), [ellipsoid((0.014, 0.014, 0.018), (x, y, top), 8)]))
    return settled("potted plant", *groups)


def succulent_bowl(sampler: Sampler) -> Model:
    """A low bowl with rosettes of thick leaves, pebbles between, or one large aloe."""
    base = pot(sampler, sampler.size(0.09, 0.18), low=True)
    count = sampler.choice((1, 3, 4, 5, 7))
    leaves: list[Mesh] = []
    for index in range(count):
        a, out = index * 2 * np.pi / max(count - 1, 1), base.radius * 0.68 * (index > 0)
        x, y = out * float(np.cos(a)), out * float(np.sin(a))
        size = base.radius * (1.3 if count == 1 else sampler.uniform(0.65, 0.95))
        layers, shape = sampler.integer(2, 4), sampler.choice((OVAL, LANCE))
        for layer in range(layers):
            ring = 7 if count > 3 else 9
            for place in range(ring):
                bend = (12 + 65 * layer / layers, -sampler.uniform(10, 40))
                long = size * (1 - 0.18 * layer)
                petal = leaf((long * 0.42, long), bend, shape[::2] + (0.02,), 0.5)
                turn = 360 * place / ring + layer * 23
                leaves.append(
                    petal.rotated("z", turn).translated(x, y, base.soil_z + 0.012 + 0.004 * layer)
                )
    stones = []
    for _ in range(sampler.integer(0, 8)):
        a, out, r = (
            sampler.uniform(0, 6.28),
            base.radius * sampler.uniform(0.5, 0.9),
            sampler.uniform(0.008, 0.016),
        )
        at = (out * float(np.cos(a)), out * float(np.sin(a)), base.soil_z + 0.004)
        stones.append(ellipsoid((r, r, r * 0.7), at, 6))
    groups: Groups = [*base.groups, (sampler.foliage(), leaves)]
    if stones:
        groups.append((sampler.pale(), stones))
    return settled("potted plant", *groups)


def trailing_plant(sampler: Sampler) -> Model:
    """Long strands of small leaves that hang from a pot on a tall stool or pedestal."""
    radius = sampler.size(0.09, 0.14)
    stand_h = sampler.size(0.35, 0.9)
    top = stand_h + radius * 1.5
    body = [(radius * 0.7, stand_h), (radius, stand_h + radius * 0.8), (radius, top)]
    vessel = lathe(
        [*body, (radius - 0.012, top), (radius - 0.014, top - 0.03), (0.003, top - 0.03)]
    )
    stand: list[Mesh] = [cylinder(radius * 1.15, 0.02, (0, 0, stand_h - 0.021), 18)]
    if sampler.chance(0.7):
        for a in np.radians([45, 135, 225, 315] if sampler.chance(0.5) else [90, 210, 330]):
            x, y = float(np.cos(a)) * radius, float(np.sin(a)) * radius
            stand.append(rod((x * 1.4, y * 1.4, 0), (x * 0.7, y * 0.7, stand_h - 0.01), 0.012))
    else:
        stand += [
            cylinder(0.03, stand_h - 0.02, segments=10),
            cylinder(radius * 0.9, 0.025, segments=18),
        ]
    leaves: list[Mesh] = []
    stems: list[Mesh] = []
    shape, small = sampler.choice((HEART, OVAL))[::2] + (0.02,), sampler.uniform(0.035, 0.06)
    for index in range(sampler.integer(7, 12)):
        a = index * 2.4 + sampler.uniform(-0.3, 0.3)
        c, s, drop = float(np.cos(a)), float(np.sin(a)), sampler.uniform(0.3, 0.85) * top
        path = [
            (0.4 * radius * c, 0.4 * radius * s, top - 0.02),
            (radius * c, radius * s, top + 0.03),
        ]
        for share in np.linspace(0.1, 1, 6).tolist():
            out = radius * (1.3 + 0.15 * np.sin(share * 7 + index))
            path.append((out * c, out * s, top - drop * share))
        stems.append(tube(path, 0.003, 4))
        for place, point in enumerate(path):
            for side in (-1, 1):
                bend = (sampler.uniform(-70, 10), 40)
                blade = leaf((small * 0.8, small), bend, shape)
                turn = float(np.degrees(a)) + side * 60 + 15 * place
                leaves.append(blade.rotated("z", turn).translated(*point))
    crown = ellipsoid((radius * 0.85, radius * 0.85, 0.05), (0, 0, top - 0.01), 10)
    return settled(
        "potted plant",
        (sampler.ceramic() if sampler.chance(0.6) else sampler.plastic(), [vessel]),
        (sampler.wood() if sampler.chance(0.6) else sampler.metal(), stand),
        (sampler.foliage(), [*leaves, crown]),
        (sampler.foliage(), stems),
    )


def orchid(sampler: Sampler) -> Model:
    """An orchid: broad strap leaves at the foot, arching stalks with a row of flat flowers."""
    base = pot(sampler, sampler.size(0.06, 0.09))
    tall, z = sampler.size(0.35, 0.6), base.soil_z
    leaves: list[Mesh] = []
    stems: list[Mesh] = []
    petals: list[Mesh] = []
    hearts: list[Mesh] = []
    for index in range(sampler.integer(4, 7)):
        long = base.radius * sampler.uniform(2.2, 3.6)
        blade = leaf(
            (long * 0.32, long), (sampler.uniform(25, 55), sampler.uniform(50, 90)), STRAP, 0.3
        )
        leaves.append(blade.rotated("z", index * 137.5).translated(0, 0, z - 0.005))
    size = sampler.uniform(0.025, 0.04)
    for index in range(sampler.integer(1, 3)):
        turn = index * 150 + sampler.uniform(-40, 40)
        c, s = float(np.cos(np.radians(turn))), float(np.sin(np.radians(turn)))
        high = tall * sampler.uniform(0.8, 1.0)
        end = (c * tall * 0.5, s * tall * 0.5, z + high * 0.75)
        path = arch((0, 0, z - 0.005), end, high * 0.42, 11)
        stems.append(tube(path, 0.004, 5))
        for x, y, level in path[5:]:
            facing = turn - 90 + sampler.uniform(-40, 40)
            for petal in range(5):
                flat = leaf((size * 0.9, size * 1.2), (8, 20), OVAL[::2] + (0.02,), 0.1).rotated(
                    "z", petal * 72
                )
                petals.append(flat.rotated("x", 75).rotated("z", facing).translated(x, y, level))
            hearts.append(ellipsoid((size * 0.22,) * 3, (x, y, level), 6))
    groups: Groups = [*base.groups, (sampler.foliage(), leaves), (sampler.foliage(), stems)]
    groups += [(sampler.plastic(), petals), (sampler.plastic(), hearts)]
    return settled("potted plant", *groups)


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "potted plant": (snake_plant, cactus, succulent_bowl, trailing_plant, orchid)
}
