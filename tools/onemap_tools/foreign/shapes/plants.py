"""Plants in pots, and vases."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onemap_tools.foreign import textures
from onemap_tools.foreign.finish import Finish, finished
from onemap_tools.foreign.finish_picker import FinishPicker
from onemap_tools.foreign.plain_mesh import (
    PlainMesh,
    curve,
    joined,
    loft,
    revolved,
    ring,
    sheet,
    smooth_profile,
    tube,
)
from onemap_tools.foreign.shapes.parts import Parts, vessel

Growth = tuple[list[PlainMesh], list[PlainMesh]]  # leaves, and stalks or trunk
Point = tuple[float, float, float]
GOLDEN_RAD = 2.4  # between one leaf and the next around the stem
GREENS = ((0.2, 0.42, 0.16), (0.3, 0.5, 0.2), (0.16, 0.34, 0.22), (0.38, 0.5, 0.26))


def potted_plant(variant: int, look: FinishPicker) -> Parts:
    """A plant in a pot, 0.3 to 1.6 m high."""
    height = (0.36, 0.34, 0.38, 0.2, 0.38, 0.26, 0.18, 0.32)[variant]
    covers = (lambda: look.plastic((0.66, 0.34, 0.22)), look.lacquer, look.wicker, look.ceramic)
    leaf = Finish(textures.foliage(look.rng, look.one_of(GREENS)), 0.2, 0.12, 20.0)
    makers = (_big_leaves, _palm, _fig, _succulent, _monstera, _fern, _cactus, _snake)
    greens, stems = makers[variant](look)
    parts: Parts = [
        finished(_pot(variant % 3, height), covers[variant % 4]()),
        finished(joined(greens).at(z=0.85 * height), leaf),
    ]
    if stems:
        bark = look.wood((0.34, 0.26, 0.16))
        parts.append(finished(joined(stems).at(z=0.85 * height), bark))
    return parts


def _pot(kind: int, h: float) -> PlainMesh:
    """A pot filled with earth: round, square or bellied."""
    r = 0.6 * h
    if kind == 1:
        steps = ((0.9, 0.0), (1.0, h), (0.9, h), (0.85, 0.85 * h), (0.05, 0.85 * h))
        return loft([ring(1.5 * r * s, 1.5 * r * s, z, 7, 40) for s, z in steps])
    if kind == 0:
        return vessel([(0.65 * r, 0), (0.8 * r, 0.5 * h), (r, h), (0.9 * r, h), (0, 0.86 * h)])
    belly = [(0.5 * r, 0.0), (1.1 * r, 0.45 * h), (0.9 * r, h), (0.82 * r, h), (0, 0.85 * h)]
    return vessel(belly)


def _leaf(length: float, width: float, droop: float, lobes: float = 0.0) -> PlainMesh:
    """A leaf along +x from the origin, bent down towards its tip, folded along its vein."""
    u, v = np.meshgrid(np.linspace(0, 1, 12), np.linspace(-1, 1, 7), indexing="ij")
    outline = np.sin(np.pi * np.clip(u, 0.02, 1) ** 0.7) ** 0.8
    outline = outline * (1 - lobes * (0.5 + 0.5 * np.cos(u * 28)) * np.abs(v))
    z = -droop * u**2 * length + 0.12 * width * np.abs(v)
    return sheet(np.stack([u * length, v * width / 2 * outline, z], axis=-1))


def _whorl(look: FinishPicker, count: int, base: Point, sizes: Point, lobes: float = 0.0) -> Growth:
    """Leaves on curved stalks around a point; sizes: length and width of a leaf, stalk."""
    long, wide, stalk = sizes
    leaves, stalks = [], []
    for i in range(count):
        yaw, rise = GOLDEN_RAD * i + look.between(-0.2, 0.2), look.between(0.5, 1.25)
        reach = stalk * look.between(0.7, 1.1)
        flat = reach * np.cos(rise)
        end = (
            base[0] + flat * np.cos(yaw),
            base[1] + flat * np.sin(yaw),
            base[2] + reach * np.sin(rise),
        )
        if reach > 0.03:
            middle = tuple(
                (a + b) / 2 + up for a, b, up in zip(base, end, (0, 0, 0.1 * reach), strict=True)
            )
            stalks.append(tube(curve([base, (middle[0], middle[1], middle[2]), end], 4), 0.006, 6))
        blade = _leaf(long * look.between(0.8, 1.15), wide, 0.35, lobes)
        leaves.append(blade.turned(roll=0.2 - 0.5 * rise).turned(yaw=yaw).at(*end))
    return leaves, stalks


def _big_leaves(look: FinishPicker) -> Growth:
    return _whorl(look, 26, (0, 0, 0), (0.38, 0.2, 0.45))


def _monstera(look: FinishPicker) -> Growth:
    return _whorl(look, 18, (0, 0, 0), (0.4, 0.4, 0.6), lobes=0.5)


def _palm(look: FinishPicker) -> Growth:
    """Fronds that rise and bend outwards, leaflets at both sides."""
    fronds, stalks = [], []
    for i in range(11):
        yaw, rise = GOLDEN_RAD * i, look.between(0.75, 1.3)
        reach, up = np.cos(rise), np.sin(rise)
        steps = (
            (0.0, 0.0),
            (0.37 * reach, 0.55 * up),
            (0.59 * reach, 0.8 * up),
            (0.74 * reach, 0.75 * up),
        )
        path = curve([(r * np.cos(yaw), r * np.sin(yaw), z) for r, z in steps], 7)
        stalks.append(tube(path, 0.006, 6))
        for x, y, z in path[7:]:
            fronds += [
                _leaf(0.24, 0.035, 0.5).turned(yaw=yaw + s * 0.9).at(x, y, z) for s in (-1, 1)
            ]
    return fronds, stalks


def _fig(look: FinishPicker) -> Growth:
    """A small tree with whorls along its trunk."""
    trunk = curve([(0, 0, 0), (0.04, 0.02, 0.4), (-0.02, 0, 0.8), (0.03, 0, 1.05)], 6)
    leaves, stalks = [], [tube(trunk, np.linspace(0.022, 0.01, len(trunk)))]
    for at in trunk[7::2]:
        base = (float(at[0]), float(at[1]), float(at[2]))
        more, stems = _whorl(look, 8, base, (0.22, 0.14, 0.1))
        leaves += more
        stalks += stems
    return leaves, stalks


def _succulent(_look: FinishPicker) -> Growth:
    """A rosette of thick pointed leaves."""
    t = np.linspace(0, 2 * np.pi, 10, endpoint=False)
    steps = ((0.0, 0.4), (0.06, 1.0), (0.11, 0.8), (0.15, 0.1))
    blade = loft(
        [
            np.stack([np.full(10, x), 0.035 * s * np.cos(t), 0.014 * s * np.sin(t)], axis=1)
            for x, s in steps
        ]
    )
    leaves = [
        blade.scaled(1.2 - 0.5 * i / 34)
        .turned(roll=-0.25 - 1.1 * i / 34)
        .turned(yaw=GOLDEN_RAD * i)
        .at(z=0.04)
        for i in range(34)
    ]
    return leaves, []


def _fern(look: FinishPicker) -> Growth:
    """Many narrow fronds that hang over the rim."""
    fronds = []
    for i in range(70):
        blade = _leaf(look.between(0.25, 0.42), 0.09, look.between(0.5, 1.0), 0.5)
        fronds.append(blade.turned(roll=-look.between(0.3, 1.1)).turned(yaw=GOLDEN_RAD * i))
    return fronds, []


def _cactus(_look: FinishPicker) -> Growth:
    """A ribbed column with an arm."""
    angle = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    ribs = 1 + 0.12 * np.cos(12 * angle)[:, None]
    bodies = []
    for x, tall, r in ((0.0, 0.42, 0.07), (0.1, 0.22, 0.04)):
        rings = []
        for z in np.linspace(0, 1, 14):
            edge = ring(2, 2, float(z) * tall, 2.0, 48)
            edge[:, :2] *= ribs * r * (1 - 0.95 * max(float(z) - 0.7, 0) ** 2 / 0.09)
            rings.append(edge)
        bodies.append(loft(rings).turned(roll=0.25 if x else 0.0).at(x, 0, 0.1 if x else 0.0))
    return bodies, []


def _snake(look: FinishPicker) -> Growth:
    """Upright twisted blades."""
    blades = []
    v, u = np.meshgrid(np.linspace(0, 1, 14), np.linspace(-1, 1, 5), indexing="ij")
    half = 0.035 * (1 - v**3)
    for i in range(14):
        tall, twist = look.between(0.45, 0.85), look.between(-0.6, 0.6)
        x, y = u * half * np.cos(twist * v), u * half * np.sin(twist * v) + 0.012 * u**2
        yaw = GOLDEN_RAD * i
        blade = sheet(np.stack([x, y, v * tall], axis=-1))
        blade = blade.turned(pitch=look.between(-0.2, 0.2), yaw=yaw)
        blades.append(blade.at(0.07 * np.cos(yaw), 0.07 * np.sin(yaw)))
    return blades, []


def vase(variant: int, look: FinishPicker) -> Parts:
    """A vase of 0.2 to 0.4 m, every second one with flowers."""
    h = look.between(0.22, 0.4)
    outlines: tuple[Sequence[tuple[float, float]], ...] = (
        ((0.2, 0), (0.32, 0.3), (0.12, 0.75), (0.18, 1.0)),
        ((0.22, 0), (0.22, 0.5), (0.24, 1.0)),
        ((0.12, 0), (0.42, 0.4), (0.14, 0.85), (0.16, 1.0)),
        ((0.26, 0), (0.12, 0.3), (0.3, 0.8), (0.36, 1.0)),
        ((0.18, 0), (0.3, 0.15), (0.08, 0.5), (0.08, 0.9), (0.14, 1.0)),
        ((0.1, 0), (0.2, 0.5), (0.34, 1.0)),
        ((0.3, 0), (0.36, 0.25), (0.2, 0.5), (0.3, 0.75), (0.2, 1.0)),
        ((0.16, 0), (0.24, 0.2), (0.26, 0.7), (0.12, 0.8), (0.14, 1.0)),
    )
    body = revolved(smooth_profile([(r * h, z * h) for r, z in outlines[variant]], 5), 30)
    tone = look.one_of(look.palette.textiles)
    glaze = (look.ceramic, lambda: look.ceramic(tone), look.brass, look.lacquer)[variant % 4]()
    return [finished(body, glaze), *(_flowers(h, look) if variant % 2 else [])]


def _flowers(h: float, look: FinishPicker) -> Parts:
    """Nine flowers of six petals that lean out of a vase of height h."""
    stems, heads = [], []
    for i in range(9):
        yaw, tilt, tall = GOLDEN_RAD * i, look.between(0.05, 0.4), h * look.between(0.6, 1.1)
        out = tall * np.sin(tilt)
        end = (float(out * np.cos(yaw)), float(out * np.sin(yaw)), float(h + tall * np.cos(tilt)))
        stems.append(tube([(0, 0, 0.7 * h), end], 0.003, 5))
        petal = _leaf(0.05, 0.04, -0.3).turned(roll=-0.4)
        heads += [petal.turned(yaw=k * 1.05).at(*end) for k in range(6)]
    petals = look.one_of(((0.85, 0.3, 0.35), (0.95, 0.8, 0.3), (0.75, 0.5, 0.8)))
    return [
        finished(joined(stems), look.plastic((0.2, 0.36, 0.16))),
        finished(joined(heads), look.plastic(petals)),
    ]
