"""Televisions and laptops that show pictures, lamps, microwaves."""

from __future__ import annotations

import numpy as np

from onemap_tools.foreign.finish import finished, pictured
from onemap_tools.foreign.finish_picker import FinishPicker
from onemap_tools.foreign.plain_mesh import (
    PlainMesh,
    block,
    curve,
    cushion,
    joined,
    loft,
    revolved,
    ring,
    smooth_profile,
    tube,
)
from onemap_tools.foreign.screens import SCREENS, desktop, news, switched_off
from onemap_tools.foreign.shapes.parts import Parts, moved, rotated

SCREEN_GLOW = 0.85


def television(variant: int, look: FinishPicker) -> Parts:
    """A flat screen that shows a picture, on a foot or a low board; an old set with a tube."""
    w = (1.1, 1.25, 0.95, 1.45, 0.8, 1.2, 1.0, 0.6)[variant]
    h = w * (9 / 16 if variant != 7 else 3 / 4)
    image = SCREENS[variant](look.rng)
    glow = SCREEN_GLOW if SCREENS[variant] is not switched_off else 0.0
    glass = look.shown(image, glow, gloss=0.5)
    black = look.plastic((0.04, 0.04, 0.045))
    if variant == 7:
        return _tube_set(w, look)
    case = cushion(w + 0.02, 0.04, h + 0.02, 0.008).at(0, 0.022, 0.07)
    parts: Parts = [
        finished(case, look.steel() if variant == 3 else black),
        *moved([pictured(w, h, glass)], 0, -0.001, 0.08),
    ]
    if variant in (0, 4):
        foot = joined(
            [
                loft([ring(0.5, 0.24, z, 2.2) for z in (0, 0.012)]),
                tube([(0, 0.03, 0), (0, 0.03, 0.12)], 0.025),
            ]
        )
    elif variant in (1, 6):
        foot = joined(
            [
                tube([(s * w * 0.36 + t, y, 0.0), (s * w * 0.36, 0.02, 0.09)], 0.008)
                for s in (-1, 1)
                for t, y in ((0, -0.12), (0, 0.14))
            ]
        )
    elif variant == 2:
        foot = joined(
            [
                tube([(0.28 * np.cos(a), 0.16 * np.sin(a), -0.12), (0, 0.03, 0.1)], 0.012)
                for a in (0.3, 2.84, 4.7)
            ]
        )
    else:
        foot = joined(
            [
                block(w * 0.7, 0.08, 0.05, 0.02).at(0, 0, 0.0),
                block(0.3, 0.05, 0.06).at(0, 0.03, 0.02),
            ]
        )
    return [*parts, finished(foot, look.chrome() if variant == 0 else black)]


def _tube_set(w: float, look: FinishPicker) -> Parts:
    """A deep wooden case with a bulging tube, knobs and a bunny-ear aerial."""
    case = block(w + 0.16, 0.4, 0.5, 0.03)
    screen = moved(
        [pictured(w - 0.06, 0.4, look.shown(news(look.rng), SCREEN_GLOW))], -0.06, -0.206, 0.05
    )
    knobs = [
        revolved([(0, 0), (0.025, 0), (0.02, 0.03), (0, 0.03)], 16)
        .turned(pitch=np.pi / 2)
        .at(w / 2 + 0.02, -0.2, z)
        for z in (0.3, 0.4)
    ]
    ears = [tube([(0, 0, 0.5), (s * 0.2, 0, 0.85)], 0.004, 6) for s in (-1, 1)]
    return [finished(case, look.wood()), *screen, finished(joined([*knobs, *ears]), look.chrome())]


def laptop(variant: int, look: FinishPicker) -> Parts:
    """An open computer, 0.3 to 0.4 m wide, its screen lit."""
    w = (0.32, 0.36, 0.3, 0.39, 0.34, 0.31, 0.36, 0.33)[variant]
    d, angle = w * 0.68, (1.9, 2.0, 1.75, 1.85, 2.2, 1.65, 1.95, 2.05)[variant] - np.pi / 2
    tones = ((0.7, 0.71, 0.72), (0.1, 0.1, 0.11), (0.85, 0.78, 0.74), (0.25, 0.26, 0.29))
    skin = look.steel(tones[variant % 4])
    keys = [
        block(w / 14, d / 10, 0.003, 0.001, 1).at((i - 5.5) * w / 13, d * 0.3 - j * d / 9, 0.016)
        for i in range(12)
        for j in range(5)
    ]
    image = (desktop, SCREENS[variant])[variant % 2](look.rng)
    lid = [
        finished(cushion(w, 0.008, d, 0.003), skin),
        *moved([pictured(w - 0.02, d - 0.025, look.shown(image, SCREEN_GLOW))], 0, -0.005, 0.012),
    ]
    return [
        finished(cushion(w, d, 0.016, 0.006), skin),
        finished(joined(keys), look.plastic((0.08, 0.08, 0.08))),
        *moved(rotated(lid, pitch=-angle), 0, d / 2, 0.014),
    ]


def microwave(variant: int, look: FinishPicker) -> Parts:
    """A microwave with a dark door and a panel at its right."""
    w, d, h = look.between(0.46, 0.54), 0.36, look.between(0.27, 0.32)
    skins = (
        look.steel(),
        look.lacquer((0.92, 0.92, 0.91)),
        look.plastic((0.07, 0.07, 0.08)),
        look.lacquer(),
    )
    bevel = 0.05 if variant in (3, 7) else 0.01
    parts: Parts = [finished(cushion(w, d, h, bevel), skins[variant % 4])]
    door = w * (0.7 if variant < 6 else 0.98)
    x = -(w - door) / 2
    parts.append(
        finished(block(door - 0.02, 0.02, h - 0.04, 0.01).at(x, -d / 2, 0.02), look.dark_glass())
    )
    if variant < 6:
        panel = [block(0.1, 0.012, 0.05, 0.003).at(w * 0.36, -d / 2, h * 0.72)]
        dial = [
            revolved([(0, 0), (0.028, 0), (0.024, 0.025), (0, 0.025)], 18)
            .turned(pitch=np.pi / 2)
            .at(w * 0.36, -d / 2, z * h)
            for z in ((0.3,) if variant % 2 else (0.25, 0.5))
        ]
        parts.append(finished(joined([*panel, *dial]), look.chrome()))
    grip = tube(
        [
            (x + door / 2 - 0.03, -d / 2 - 0.035, 0.05),
            (x + door / 2 - 0.03, -d / 2 - 0.035, h - 0.05),
        ],
        0.008,
    )
    return [*parts, finished(grip, look.chrome())]


def lamp(variant: int, look: FinishPicker) -> Parts:
    """A standing lamp of 1.4 to 1.8 m, or a table lamp with odd number, its shade lit."""
    makers = (_standing, _table_lamp, _arc, _desk_lamp, _tripod, _gourd, _globes, _mushroom)
    return makers[variant](look)


def _shade(low: float, high: float, tall: float, pleats: int = 0) -> PlainMesh:
    angle = np.linspace(0, 2 * np.pi, 72, endpoint=False)
    wave = 1 + 0.03 * np.cos(angle * pleats)[:, None] if pleats else np.ones((72, 1))
    rings = []
    for r, z in ((low, 0.0), (high, tall)):
        edge = ring(2 * r, 2 * r, z, 2.0, 72)
        edge[:, :2] *= wave
        rings.append(edge)
    return loft(rings, caps=False)


def _standing(look: FinishPicker) -> Parts:
    pole = joined(
        [
            tube([(0, 0, 0), (0, 0, 1.5)], 0.012),
            revolved([(0, 0), (0.15, 0), (0.14, 0.02), (0, 0.03)], 32),
        ]
    )
    return [finished(pole, look.brass()), finished(_shade(0.24, 0.18, 0.3).at(z=1.4), look.light())]


def _table_lamp(look: FinishPicker) -> Parts:
    base = revolved(
        smooth_profile([(0.08, 0), (0.12, 0.08), (0.1, 0.2), (0.03, 0.28), (0.02, 0.34)]), 32
    )
    return [
        finished(base, look.ceramic(look.one_of(look.palette.textiles))),
        finished(_shade(0.2, 0.13, 0.22, 24).at(z=0.33), look.light()),
    ]


def _arc(look: FinishPicker) -> Parts:
    bow = curve(
        [(0.5, 0, 0.03), (0.48, 0, 1.0), (0.2, 0, 1.75), (-0.3, 0, 1.8), (-0.48, 0, 1.55)], 10
    )
    dome = revolved(
        [(0.05, 0.18), (0.15, 0.14), (0.2, 0.0), (0.19, 0.0), (0.14, 0.12), (0.0, 0.16)], 36
    ).at(-0.48, 0, 1.4)
    bulb = revolved([(0, 0), (0.06, 0.03), (0.06, 0.07), (0, 0.1)], 20).at(-0.48, 0, 1.42)
    foot = block(0.3, 0.3, 0.06, 0.01).at(0.5)
    return [
        finished(joined([tube(bow, 0.012), dome]), look.chrome()),
        finished(foot, look.marble()),
        finished(bulb, look.light()),
    ]


def _desk_lamp(look: FinishPicker) -> Parts:
    arm = [
        tube([(0, 0.1, 0.02), (0, 0.22, 0.3)], 0.008),
        tube([(0, 0.22, 0.3), (0, -0.06, 0.5)], 0.008),
    ]
    head = (
        revolved([(0.02, 0.12), (0.04, 0.1), (0.09, 0.0), (0.085, 0.0), (0.0, 0.08)], 28)
        .turned(pitch=0.5)
        .at(0, -0.1, 0.42)
    )
    foot = revolved([(0, 0), (0.1, 0), (0.09, 0.02), (0, 0.025)], 28).at(0, 0.1)
    bulb = revolved([(0, 0), (0.04, 0.02), (0, 0.06)], 16).at(0, -0.12, 0.43)
    return [finished(joined([*arm, head, foot]), look.lacquer()), finished(bulb, look.light())]


def _tripod(look: FinishPicker) -> Parts:
    rods = [
        tube(
            [(0.3 * np.cos(a), 0.3 * np.sin(a), 0), (0.03 * np.cos(a), 0.03 * np.sin(a), 1.15)],
            0.016,
        )
        for a in (0.5, 2.6, 4.7)
    ]
    return [
        finished(joined(rods), look.wood()),
        finished(_shade(0.25, 0.25, 0.28).at(z=1.12), look.light()),
    ]


def _gourd(look: FinishPicker) -> Parts:
    base = revolved(
        smooth_profile(
            [(0.06, 0), (0.11, 0.06), (0.06, 0.16), (0.08, 0.23), (0.03, 0.3), (0.015, 0.36)]
        ),
        32,
    )
    return [
        finished(base, look.brass()),
        finished(_shade(0.19, 0.1, 0.2).at(z=0.34), look.light((1.0, 0.84, 0.6))),
    ]


def _globes(look: FinishPicker) -> Parts:
    pole = [
        tube([(0, 0, 0), (0, 0, 1.6)], 0.01),
        revolved([(0, 0), (0.13, 0), (0.12, 0.015), (0, 0.02)], 32),
    ]
    balls = []
    for i, z in enumerate((0.95, 1.25, 1.55)):
        x, y = 0.2 * np.cos(2.1 * i), 0.2 * np.sin(2.1 * i)
        pole.append(tube([(0, 0, z), (x, y, z)], 0.007))
        balls.append(
            revolved(
                [(0.09 * np.sin(t), -0.09 * np.cos(t)) for t in np.linspace(0, np.pi, 14)], 24
            ).at(x, y, z)
        )
    return [finished(joined(pole), look.iron()), finished(joined(balls), look.light())]


def _mushroom(look: FinishPicker) -> Parts:
    foot = revolved(smooth_profile([(0.1, 0), (0.06, 0.03), (0.04, 0.15), (0.05, 0.26)]), 32)
    cap = revolved([(0.05, 0.24), (0.16, 0.22), (0.17, 0.25), (0.12, 0.34), (0, 0.37)], 36)
    return [finished(foot, look.lacquer()), finished(cap, look.light())]
