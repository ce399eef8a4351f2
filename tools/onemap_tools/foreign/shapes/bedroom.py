"""Beds with their covers, and pillows."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64
from onemap_tools.foreign.finish import finished
from onemap_tools.foreign.finish_picker import FinishPicker
from onemap_tools.foreign.plain_mesh import (
    PlainMesh,
    block,
    curve,
    cushion,
    joined,
    loft,
    ring,
    sheet,
    tube,
)
from onemap_tools.foreign.shapes.parts import Parts, frame, legs

LENGTH_M = 2.05


def bed(variant: int, look: FinishPicker) -> Parts:
    """A bed with mattress and cover, its head to the wall; single or double."""
    w = (1.6, 0.95, 1.8, 1.4, 1.6, 1.0, 1.8, 1.5)[variant]
    low = (0.3, 0.32, 0.22, 0.34, 0.28, 0.3, 0.36, 0.3)[variant]
    frame_parts = _bedstead(variant, w, low, look)
    mattress = cushion(w - 0.06, LENGTH_M - 0.08, 0.22, 0.06, puff=0.01).at(z=low)
    linen = look.cloth((0.9, 0.89, 0.87))
    cover = look.cloth()
    top = low + 0.22
    parts = [
        *frame_parts,
        finished(mattress, linen),
        finished(_duvet(w, top, variant, look), cover),
    ]
    if variant in (0, 4, 6):
        throw = _duvet(w + 0.02, top + 0.02, 7, look, length=0.55).at(y=-0.62)
        parts.append(finished(throw, look.cloth()))
    return parts


def _duvet(
    w: float, top: float, variant: int, look: FinishPicker, length: float = 1.45
) -> PlainMesh:
    """A quilt that hangs over both sides and the foot, with soft wrinkles; crumpled if odd."""
    drop = 0.28 if variant % 2 == 0 else 0.18
    across = np.linspace(-w / 2 - drop, w / 2 + drop, 46)
    along = np.linspace(-length / 2, length / 2, 40)
    x, y = np.meshgrid(across, along, indexing="ij")
    over = np.clip(np.abs(x) - w / 2, 0, None)
    flat_x = np.sign(x) * (np.minimum(np.abs(x), w / 2) + 0.03 * np.tanh(over * 12))
    z = top + 0.06 - 0.02 * np.exp(-((np.abs(x) - w / 2) ** 2) / 0.002) - over
    phase = look.rng.uniform(0, 6, 6)
    strength = 0.006 + 0.008 * (variant % 2)
    for k in range(6):
        fx, fy = look.rng.uniform(2, 9, 2)
        z += strength * np.sin(fx * x * 3 + fy * y + phase[k]) * np.exp(-over * 4)
        flat_x += 0.5 * strength * np.sin(fy * y * 3 + phase[k]) * np.tanh(over * 10)
    shift = -(LENGTH_M - length) / 2 if length > 1 else 0.0
    return sheet(np.stack([flat_x, y + shift, np.maximum(z, 0.06)], axis=-1))


def _bedstead(variant: int, w: float, low: float, look: FinishPicker) -> Parts:
    """What carries the mattress, and the head."""
    makers = (
        lambda: _board_bed(look, w, low),
        lambda: _iron_bed(look, w, low),
        lambda: _upholstered_bed(look, w, low),
        lambda: _slatted_bed(look, w, low),
        lambda: _cane_bed(look, w, low),
        lambda: _drawer_bed(look, w, low),
        lambda: _boxspring_bed(look, w),
        lambda: _platform_bed(look, w),
    )
    return makers[variant]()


def _board_bed(look: FinishPicker, w: float, low: float) -> Parts:
    head = LENGTH_M / 2
    base = block(w, LENGTH_M, low - 0.12, 0.01).at(z=0.12)
    wood = look.wood()
    board = [
        block(w + 0.04, 0.04, 0.95, 0.015).at(0, head),
        block(w + 0.04, 0.03, 0.42, 0.012).at(0, -head),
    ]
    return [finished(joined([base, *board, legs(w, LENGTH_M, 0.14, 0)]), wood)]


def _iron_bed(look: FinishPicker, w: float, low: float) -> Parts:
    head = LENGTH_M / 2
    rails = []
    for y, top in ((head, 1.0), (-head, 0.75)):
        rails += [tube([(s * w / 2, y, 0), (s * w / 2, y, top)], 0.02) for s in (-1, 1)]
        arc = curve([(-w / 2, y, top - 0.1), (0, y, top + 0.12), (w / 2, y, top - 0.1)], 10)
        rails.append(tube(arc, 0.014))
        rails += [
            tube([(x, y, 0.25), (x, y, top - 0.12 + 0.2 * (1 - (2 * x / w) ** 2))], 0.008, 8)
            for x in np.linspace(-0.35 * w, 0.35 * w, 6)
        ]
    side = [
        tube([(s * w / 2, -head, low - 0.03), (s * w / 2, head, low - 0.03)], 0.018)
        for s in (-1, 1)
    ]
    return [
        finished(joined([*rails, *side, block(w, LENGTH_M, 0.04).at(z=low - 0.05)]), look.iron())
    ]


def _upholstered_bed(look: FinishPicker, w: float, low: float) -> Parts:
    head = LENGTH_M / 2
    cover = look.cloth()
    panels = [
        cushion(w / 4 - 0.006, 0.62, 0.1, 0.04, puff=0.02)
        .turned(pitch=np.pi / 2)
        .at((i - 1.5) * w / 4, head + 0.03, 0.75)
        for i in range(4)
    ]
    return [
        finished(
            joined(
                [
                    cushion(w + 0.06, LENGTH_M + 0.04, low, 0.05),
                    *panels,
                    block(w, 0.08, 0.5).at(0, head + 0.03),
                ]
            ),
            cover,
        )
    ]


def _slatted_bed(look: FinishPicker, w: float, low: float) -> Parts:
    head = LENGTH_M / 2
    slats = [
        tube([(x, head, 0.3), (x, head, 1.0)], 0.012)
        for x in np.linspace(-w / 2 + 0.06, w / 2 - 0.06, 11)
    ]
    rail = [
        block(w + 0.02, 0.05, 0.06, 0.02).at(0, head, 1.0),
        *(block(0.06, 0.06, 1.1, 0.02).at(s * w / 2, head) for s in (-1, 1)),
        *(block(0.06, 0.06, 0.5, 0.02).at(s * w / 2, -head) for s in (-1, 1)),
    ]
    return [
        finished(joined([*slats, *rail, block(w, LENGTH_M, 0.12).at(z=low - 0.12)]), look.wood())
    ]


def _cane_bed(look: FinishPicker, w: float, low: float) -> Parts:
    head = LENGTH_M / 2
    base = block(w, LENGTH_M, low - 0.12, 0.01).at(z=0.12)
    arch = (
        loft([ring(w + 0.1, 1.1, z, 3.0, 48) for z in (-0.04, 0.04)])
        .turned(pitch=np.pi / 2)
        .at(0, head, 0.6)
    )
    return [
        finished(joined([base, legs(w, LENGTH_M, 0.14, 2)]), look.wood()),
        finished(arch, look.wicker()),
    ]


def _drawer_bed(look: FinishPicker, w: float, low: float) -> Parts:
    head = LENGTH_M / 2
    drawers = joined(
        [
            frame(LENGTH_M / 2 - 0.02, low - 0.06, 0.01, 0.012)
            .turned(yaw=s * np.pi / 2)
            .at(s * w / 2, y, 0.04)
            for s in (-1, 1)
            for y in (-0.5, 0.5)
        ]
    )
    box = [
        block(w, LENGTH_M, low, 0.008),
        block(w, 0.06, 0.85, 0.01).at(0, head),
        block(0.05, LENGTH_M, 0.6, 0.01).at(-w / 2),
    ]
    return [finished(joined([*box, drawers]), look.lacquer())]


def _boxspring_bed(look: FinishPicker, w: float) -> Parts:
    head = LENGTH_M / 2
    boxspring = cushion(w, LENGTH_M, 0.26, 0.03).at(z=0.1)
    buttons = _tufted_head(w)
    return [
        finished(boxspring, look.cloth()),
        finished(buttons.at(0, head + 0.04), look.leather()),
        finished(legs(w, LENGTH_M, 0.11, 1, 0.12), look.wood()),
    ]


def _platform_bed(look: FinishPicker, w: float) -> Parts:
    head = LENGTH_M / 2
    platform = joined(
        [
            block(w + 0.5, LENGTH_M + 0.1, 0.06, 0.02).at(z=0.2),
            block(w - 0.3, LENGTH_M - 0.4, 0.2),
            block(w + 0.5, 0.05, 0.5, 0.01).at(0, head + 0.05, 0.2),
        ]
    )
    return [finished(platform, look.wood())]


def _tufted_head(w: float) -> PlainMesh:
    """A padded head with buttons in a lattice."""
    x, z = np.meshgrid(np.linspace(-w / 2, w / 2, 80), np.linspace(0.1, 1.25, 40), indexing="ij")
    relief = 0.05 * np.abs(np.sin(x / 0.22 * np.pi)) * np.abs(np.sin(z / 0.2 * np.pi))
    edge = np.minimum(np.minimum(x + w / 2, w / 2 - x), 1.25 - z)
    y = -0.03 - relief * np.clip(edge / 0.05, 0, 1) - 0.03 * np.clip(edge / 0.03, 0, 1)
    return joined([sheet(np.stack([x, y, z], axis=-1)), block(w, 0.05, 1.25, 0.01)])


def pillow(variant: int, look: FinishPicker) -> Parts:
    """A pillow or cushion that lies flat; 4 is round, 7 a bolster."""
    white = look.cloth((0.92, 0.91, 0.89)) if variant in (0, 3, 6) else look.cloth()
    sizes = (
        (0.7, 0.45), (0.45, 0.45), (0.5, 0.3), (0.75, 0.5), (0.4, 0.4), (0.5, 0.5), (0.6, 0.4),
        (0.55, 0.18),
    )  # fmt: skip
    w, d = sizes[variant]
    if variant == 4:
        steps = ((0.4, 0), (0.9, 0.03), (1, 0.07), (0.9, 0.11), (0.3, 0.14))
        return [finished(loft([ring(w * s, w * s, z) for s, z in steps]), white)]
    return [finished(_bolster(w) if variant == 7 else _stuffed(w, d), white)]


def _bolster(w: float) -> PlainMesh:
    """A roll along x."""
    t = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    ends = ((-w / 2, 0.5), (-w / 2 + 0.02, 0.9), (-w / 2 + 0.05, 1.0))
    steps = (*ends, *((-x, r) for x, r in reversed(ends)))
    rings = [
        np.stack([np.full(24, x), 0.09 * r * np.cos(t), 0.09 + 0.09 * r * np.sin(t)], axis=1)
        for x, r in steps
    ]
    return loft(rings)


def _stuffed(w: float, d: float) -> PlainMesh:
    """Two sheets sewn together at the edges, fullest in the middle, with pointed corners."""
    u, v = np.meshgrid(np.linspace(-1, 1, 24), np.linspace(-1, 1, 24), indexing="ij")
    height: F64 = 0.085 * ((1 - u**4) * (1 - v**4)) ** 0.6
    x = u * w / 2 * (1 - 0.1 * (1 - np.abs(v) ** 2) * np.abs(u) ** 2)
    y = v * d / 2 * (1 - 0.1 * (1 - np.abs(u) ** 2) * np.abs(v) ** 2)
    return joined([sheet(np.stack([x, y, 0.085 + s * height], axis=-1)) for s in (-1, 1)])
