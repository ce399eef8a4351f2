"""Mirrors and pictures in their frames."""

from __future__ import annotations

import numpy as np

from onemap_tools.foreign.finish import Finish, FinishedPart, finished, pictured
from onemap_tools.foreign.finish_picker import FinishPicker
from onemap_tools.foreign.images import PAINTINGS
from onemap_tools.foreign.plain_mesh import block, joined, loft, ring, tube
from onemap_tools.foreign.shapes.parts import Parts, frame, moved

LEANING = (1, 5)
ROUND = (2, 4, 6)
CANVASES = (3, 6)
MOUNTED = (1, 5, 7)


def mirror(variant: int, look: FinishPicker) -> Parts:
    """A mirror in a frame: for a wall, or leaning on the floor (LEANING)."""
    sizes = (
        (0.6, 0.8), (0.6, 1.6), (0.7, 0.7), (1.0, 0.7), (0.5, 0.75), (0.75, 1.75), (0.8, 0.8),
        (0.45, 1.2),
    )  # fmt: skip
    w, h = sizes[variant]
    border = (look.wood, look.brass, look.chrome, look.lacquer)[variant % 4]()
    if variant in ROUND:
        return _round_mirror(w, h, border, look, rays=variant == 6)
    parts = [
        *moved([pictured(w - 0.08, h - 0.08, look.silver())], 0, -0.008, 0.04),
        finished(frame(w, h, 0.05, 0.03), border),
        finished(block(w - 0.02, 0.01, h - 0.02).at(0, 0.01, 0.01), border),
    ]
    if variant in LEANING:
        return [FinishedPart(p.mesh.turned(pitch=-0.1), p.uv, p.finish) for p in parts]
    return parts


def _round_mirror(w: float, h: float, border: Finish, look: FinishPicker, *, rays: bool) -> Parts:
    """An oval in a ring, with rays around it if asked."""
    steps = ((0.0, 0.0), (0.0, 0.025), (0.03, 0.03), (0.045, 0.012))
    outline = [ring(w - 2 * s, h - 2 * s, -y, 2.0, 56) for s, y in steps]
    rim = loft(outline, caps=False).turned(pitch=-np.pi / 2)
    pane = [ring(w - 0.06, h - 0.06, z, 2.0, 56) for z in (0.008, 0.01)]
    glass = loft(pane).turned(pitch=np.pi / 2).at(y=-0.005)
    parts: Parts = [finished(rim, border), finished(glass, look.silver())]
    if rays:
        angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
        spikes = [
            tube(
                [(r * np.cos(a), 0, r * np.sin(a)) for r in (w / 2, w / 2 + 0.12)],
                [0.012, 0.004],
                6,
            )
            for a in angles
        ]
        parts.append(finished(joined(spikes), border))
    return moved(parts, z=h / 2)


def picture(variant: int, look: FinishPicker) -> Parts:
    """A painting, print or photograph in a frame, or on stretched canvas (CANVASES)."""
    sizes = (
        (0.8, 0.6), (0.5, 0.7), (0.45, 0.6), (0.9, 0.9), (0.6, 0.5), (0.5, 0.75), (1.2, 0.7),
        (0.7, 0.5),
    )  # fmt: skip
    scale = look.between(0.85, 1.2)
    w, h = (scale * side for side in sizes[variant])
    shape = (int(256 * min(h / w, 1)), int(256 * min(w / h, 1)))
    image = look.shown(PAINTINGS[variant](look.rng, shape), gloss=0.05)
    if variant in CANVASES:
        canvas = finished(block(w, 0.035, h, 0.003), look.plastic((0.9, 0.9, 0.88)))
        return [canvas, *moved([pictured(w, h, image)], 0, -0.019)]
    margin = 0.09 if variant in MOUNTED else 0.0
    wood, iron = look.wood, look.iron
    border = (look.brass, wood, wood, wood, wood, iron, iron, look.lacquer)[variant]()
    thick = 0.045 if margin == 0 else 0.02
    inset = 0.06 + 2 * margin
    paper = block(w - 0.01, 0.008, h - 0.01, 0.001, 1).at(z=0.005)
    return [
        finished(frame(w, h, thick, 0.025), border),
        finished(paper, look.plastic((0.95, 0.95, 0.93))),
        *moved([pictured(w - inset, h - inset, image)], 0, -0.008, 0.03 + margin),
    ]
