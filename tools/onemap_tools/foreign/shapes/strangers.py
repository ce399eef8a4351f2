"""Things that ``mini`` has no class for: a piano, a ladder, an ironing board."""

from __future__ import annotations

import numpy as np

from onemap_tools.foreign.finish import finished
from onemap_tools.foreign.finish_picker import FinishPicker
from onemap_tools.foreign.plain_mesh import block, joined, loft, revolved, ring, tube
from onemap_tools.foreign.shapes.parts import Parts, front, legs


def piano(variant: int, look: FinishPicker) -> Parts:
    """An upright piano, 1.4 to 1.5 m wide, with its keys open; 1.0 to 1.3 m high."""
    w, h = (
        (1.5, 1.45, 1.4, 1.5, 1.48, 1.42, 1.5, 1.46)[variant],
        (1.2, 1.1, 1.0, 1.3, 1.15, 1.25, 1.05, 1.18)[variant],
    )
    body = (lambda: look.lacquer((0.05, 0.05, 0.05)), look.wood, look.lacquer, look.wood)[
        variant % 4
    ]()
    case = [
        block(w, 0.32, h, 0.015).at(0, 0.12),
        block(w, 0.3, 0.12, 0.01).at(0, -0.16, 0.6),
        block(w, 0.34, 0.03, 0.008).at(0, 0.12, h),
    ]
    case += (
        [block(0.06, 0.3, 0.6, 0.01).at(s * (w / 2 - 0.04), -0.16) for s in (-1, 1)]
        if variant % 2 == 0
        else [legs(w, 0.3, 0.6, 2, 0.06).at(y=-0.16)]
    )
    case += [block(0.05, 0.3, 0.1, 0.01).at(s * (w / 2 - 0.03), -0.16, 0.7) for s in (-1, 1)]
    keys = 52
    step = (w - 0.14) / keys
    white = joined(
        [
            block(step * 0.92, 0.14, 0.022, 0.002, 1).at(
                (i + 0.5) * step - (w - 0.14) / 2, -0.22, 0.715
            )
            for i in range(keys)
        ]
    )
    black = joined(
        [
            block(step * 0.5, 0.09, 0.035, 0.002, 1).at(
                (i + 1) * step - (w - 0.14) / 2, -0.19, 0.72
            )
            for i in range(keys - 1)
            if i % 7 not in (1, 4)
        ]
    )
    desk = front(w * 0.5, 0.24, (0, 2, 1, 2)[variant % 4]).turned(pitch=-0.2).at(0, -0.05, 0.8)
    pedals = joined([block(0.03, 0.09, 0.012, 0.004).at(x, -0.1, 0.06) for x in (-0.08, 0, 0.08)])
    return [
        finished(joined([*case, desk]), body),
        finished(white, look.ceramic()),
        finished(black, look.plastic((0.04, 0.04, 0.04))),
        finished(pedals, look.brass()),
    ]


def ladder(variant: int, look: FinishPicker) -> Parts:
    """A step ladder that stands open, or a ladder that leans on the wall."""
    rungs, h = (4, 6, 3, 8, 5, 7, 4, 9)[variant], (1.2, 1.7, 0.9, 2.1, 1.45, 1.9, 1.1, 2.2)[variant]
    leaning = variant in (3, 7)
    spread = 0.5 if leaning else 0.34 * h
    at = [(0.03 + 0.94 * (i + 1) / (rungs + 1)) for i in range(rungs)]
    rails = [
        block(0.03, 0.06, np.hypot(h, spread), 0.006)
        .turned(pitch=-np.arctan2(spread, h))
        .at(s * (0.2 if leaning else 0.24), -spread)
        for s in (-1, 1)
    ]
    if leaning:
        steps = [
            tube([(-0.2, -spread * (1 - t), t * h), (0.2, -spread * (1 - t), t * h)], 0.016)
            for t in at
        ]
    else:
        steps = [block(0.46, 0.09, 0.025, 0.005).at(0, -spread * (1 - t), t * h) for t in at]
        rails += [tube([(s * 0.22, 0.3 * h, 0), (s * 0.2, 0, 0.97 * h)], 0.014) for s in (-1, 1)]
        steps.append(block(0.44, 0.26, 0.025, 0.006).at(0, 0.02, h))
    metal = look.steel() if variant % 2 else look.wood()
    tread = look.plastic((0.1, 0.1, 0.1)) if variant % 2 else look.wood()
    return [finished(joined(rails), metal), finished(joined(steps), tread)]


def ironing_board(variant: int, look: FinishPicker) -> Parts:
    """A padded board on crossed legs, 0.8 to 0.95 m high, some with an iron on it."""
    h, long = look.between(0.8, 0.95), look.between(1.15, 1.35)
    t = np.linspace(0, 2 * np.pi, 56, endpoint=False)
    nose = (0.5, 0.8, 0.3, 0.65, 1.0, 0.4, 0.7, 0.9)[variant]
    half = 0.19 * (1 - nose * 0.5 * np.clip(np.cos(t), 0, 1) ** 1.5)
    outline = [
        np.stack(
            [
                long / 2 * np.sign(np.cos(t)) * np.abs(np.cos(t)) ** 0.6,
                half * np.sign(np.sin(t)) * np.abs(np.sin(t)) ** 0.7,
                np.full(56, z),
            ],
            axis=1,
        )
        for z in (h - 0.03, h)
    ]
    x = long * (0.3, 0.34, 0.26, 0.3)[variant % 4]
    bars = [tube([(-x, y, 0.01), (x * 0.9, y * 0.7, h - 0.03)], 0.012) for y in (-0.16, 0.16)]
    bars += [tube([(x, y, 0.01), (-x * 0.9, y * 0.7, h - 0.03)], 0.012) for y in (-0.13, 0.13)]
    bars += [tube([(s * x, -0.2, 0.014), (s * x, 0.2, 0.014)], 0.014) for s in (-1, 1)]
    parts: Parts = [
        finished(loft(outline), look.cloth()),
        finished(joined(bars), look.steel() if variant % 2 else look.lacquer()),
    ]
    if variant in (1, 2, 5, 6):
        iron = loft(
            [
                ring(0.24 * s, 0.11 * s, z, 2.2)
                for s, z in ((1, h), (1, h + 0.03), (0.8, h + 0.06), (0.6, h + 0.07))
            ]
        )
        grip = tube(
            [(-0.08, 0, h + 0.07), (-0.07, 0, h + 0.13), (0.05, 0, h + 0.13), (0.07, 0, h + 0.07)],
            0.013,
        )
        parts.append(
            finished(joined([iron, grip]).at(-long * 0.28), look.plastic((0.2, 0.35, 0.6)))
        )
    else:
        parts.append(
            finished(
                revolved([(0, h), (0.05, h), (0.04, h + 0.16), (0, h + 0.18)], 16).at(-long * 0.3),
                look.plastic((0.8, 0.85, 0.9)),
            )
        )
    return parts
