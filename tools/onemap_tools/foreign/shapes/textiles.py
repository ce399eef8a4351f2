"""Curtains that hang half open, and rugs."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import U8
from onemap_tools.foreign import textures
from onemap_tools.foreign.finish import Finish, FinishedPart, finished, pictured
from onemap_tools.foreign.finish_picker import FinishPicker
from onemap_tools.foreign.plain_mesh import (
    PlainMesh,
    block,
    joined,
    loft,
    revolved,
    ring,
    sheet,
    tube,
)
from onemap_tools.foreign.shapes.parts import Parts
from onemap_tools.foreign.textures import Colour, mix

TIED_BACK = (1, 4)
VEILED = (2, 4)


def curtain(variant: int, look: FinishPicker) -> Parts:
    """Curtains on a rod: half open, drawn aside, tied back, or only one of two."""
    w, top = look.between(1.7, 2.1), look.between(2.2, 2.35)
    low = 0.02 if variant != 5 else 0.85
    cloth, rod = look.cloth(), tube([(-w / 2 - 0.1, 0, top), (w / 2 + 0.1, 0, top)], 0.014)
    share = (0.3, 0.44, 0.2, 0.42, 0.28, 0.4, 0.5, 0.34)[variant]
    knob = revolved([(0, 0), (0.03, 0.01), (0.03, 0.04), (0, 0.06)], 16)
    ends = [knob.turned(roll=side * np.pi / 2).at(side * (w / 2 + 0.1), 0, top) for side in (-1, 1)]
    metal = look.brass() if variant % 2 else look.iron()
    parts: Parts = [finished(joined([rod, *ends]), metal)]
    sides = [(-1, share), (1, (1 - share) * 0.5 if variant in (3, 6) else share)]
    for side, part in sides[:1] if variant == 7 else sides:
        folds = _hanging(w * part, top - low, side, variant in TIED_BACK, look)
        parts.append(finished(folds.at(side * w / 2, 0, low), cloth))
    if variant in VEILED:
        veil = Finish(textures.weave(look.rng, (0.93, 0.93, 0.91), 128, 0.1), 0.3, 0.02)
        folds = _hanging(w, top - low - 0.02, -1, False, look)
        parts.append(finished(folds.at(-w / 2, 0.05, low), veil))
    return parts


def _hanging(width: float, height: float, side: int, tied: bool, look: FinishPicker) -> PlainMesh:
    """Folds that hang from z = height, from x = 0 to the other side than ``side``."""
    folds = max(int(width / 0.09), 3)
    phase = look.rng.uniform(0, 6)
    u, v = np.meshgrid(np.linspace(0, 1, folds * 8), np.linspace(0, 1, 24), indexing="ij")
    depth = 0.035 + 0.02 * (1 - v)
    gather = 1 - 0.62 * np.exp(-(((v - 0.42) / 0.16) ** 2)) if tied else 1.0
    x = -side * u * width * gather * (1 + 0.06 * (1 - v))
    y = depth * np.sin(2 * np.pi * folds * u + phase + 0.5 * v) + 0.012 * np.sin(13 * u + 3 * v)
    return sheet(np.stack([x, y, v * height], axis=-1))


def rug(variant: int, look: FinishPicker) -> Parts:
    """A rug on the floor: bordered, striped, round, shaggy, chequered, a hide."""
    w, d = look.between(1.6, 2.2), look.between(1.1, 1.5)
    if variant == 5:
        return _hide(look)
    coarse = variant in (3, 6)
    finish = Finish(_pile(variant, look), 0.5 if coarse else 1.0, 0.01, 4.0)
    thick = 0.03 if variant == 3 else 0.01
    if variant in (2, 6):
        disc = loft([ring(1.7, 1.7, z, 2, 56) for z in (0, thick)])
        return [finished(disc, finish.over(1.7))]
    top = pictured(w, d, finish)
    times = 2 if variant in (3, 7) else 1
    flat = top.mesh.turned(pitch=-np.pi / 2).at(0, -d / 2, thick)
    base = block(w, d, thick, 0.004).at(z=-0.001)
    return [finished(base, finish), FinishedPart(flat, top.uv * times, finish)]


def _pile(variant: int, look: FinishPicker) -> U8:
    """The picture of a rug."""
    rng = look.rng
    one, other = look.one_of(look.palette.textiles), look.one_of(look.palette.textiles)
    makers = {
        0: lambda: _oriental(look, one, other),
        1: lambda: textures.stripes(rng, one, other, 6),
        2: lambda: _oriental(look, other, mix(one, (1, 1, 1), 0.5)),
        3: lambda: textures.fur(rng, mix(one, (1, 1, 1), 0.4)),
        4: lambda: textures.wallpaper(rng, mix(one, (1, 1, 1), 0.7), other),
        6: lambda: textures.weave(rng, (0.68, 0.56, 0.38), 32, 0.5),
        7: lambda: textures.plaid(rng, one, other),
    }
    return makers[variant]()


def _hide(look: FinishPicker) -> Parts:
    """A spotted hide with four legs."""
    t = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    r = 1 + 0.16 * np.cos(4 * t + 0.7) + 0.08 * np.cos(7 * t)
    rings = [
        np.stack([0.75 * r * np.cos(t), 0.6 * r * np.sin(t), np.full(60, z)], axis=1)
        for z in (0, 0.012)
    ]
    spots = textures.marble(look.rng, (0.9, 0.87, 0.82), (0.3, 0.2, 0.14))
    return [finished(loft(rings), Finish(spots, 0.7, 0.02))]


def _oriental(look: FinishPicker, one: Colour, other: Colour) -> U8:
    """A field with a medallion and two borders, knotted unevenly."""
    image = textures.weave(look.rng, one, 128, 0.2).astype(np.float32)
    y, x = np.mgrid[-1:1:256j, -1:1:256j]
    edge, dark = np.maximum(np.abs(x), np.abs(y)), mix(one, (0, 0, 0), 0.6)
    star = np.abs(x) ** 0.9 + np.abs(y) ** 0.9 + 0.08 * np.cos(8 * np.arctan2(y, x))
    fields = (
        (edge > 0.92, dark),
        ((edge > 0.72) & (edge < 0.88), other),
        (star < 0.55, other),
        (star < 0.3, dark),
    )
    for field, colour in fields:
        image[field] = image[field] * 0.3 + np.array(colour) * 178
    motif = (np.sin(x * 26) * np.sin(y * 26) > 0.75) & (edge < 0.7)
    image[motif] = image[motif] * 0.5 + 110
    return np.clip(image, 0, 255).astype(np.uint8)
