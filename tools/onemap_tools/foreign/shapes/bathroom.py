"""Toilets, bathtubs and washing machines."""

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
    revolved,
    ring,
    tube,
)
from onemap_tools.foreign.shapes.parts import Parts, legs


def toilet(variant: int, look: FinishPicker) -> Parts:
    """A toilet, its seat at 0.42 m, with a cistern or hung to the wall."""
    tones = ((0.94, 0.94, 0.93), (0.90, 0.86, 0.76), (0.94, 0.94, 0.93), (0.12, 0.12, 0.13))
    white = look.ceramic(tones[variant % 4])
    hung = variant in (2, 5, 7)
    power = 3.2 if variant in (3, 5) else 2.3
    body = _bowl(0.14 if hung else 0.0, power, 0.2 if variant % 2 else 0.3)
    seat = look.wood() if variant == 6 else white
    lids = _seat_and_lid(power, lid_up=variant in (1, 4, 6))
    tank = [] if hung else _cistern(variant)
    parts: Parts = [finished(joined([body, *tank]), white), finished(joined(lids), seat)]
    if hung:
        wall = block(0.5, 0.14, 1.1, 0.01).at(0, 0.34)
        plate = block(0.22, 0.012, 0.14, 0.005).at(0, 0.265, 0.85)
        panel = finished(wall, look.lacquer((0.9, 0.9, 0.9)))
        return [*parts, panel, finished(plate, look.chrome())]
    button = revolved([(0, 0), (0.022, 0), (0.02, 0.01), (0, 0.012)], 16).at(0, 0.34, 0.8)
    return [*parts, finished(button, look.chrome())]


def _bowl(low: float, power: float, waist: float) -> PlainMesh:
    """A bowl from z = low, narrow below, hollow above."""
    return loft(
        [
            ring(0.2, 0.26, low, power) + (0, 0.06, 0),
            ring(waist, 0.3, 0.2, power) + (0, 0.04, 0),
            ring(0.36, 0.5, 0.36, power),
            ring(0.37, 0.52, 0.4, power),
            ring(0.27, 0.4, 0.4, power) + (0, -0.02, 0),
            ring(0.18, 0.24, 0.28, power),
            ring(0.05, 0.06, 0.22, power),
        ]
    )


def _seat_and_lid(power: float, *, lid_up: bool) -> list[PlainMesh]:
    """A seat with a hole, and a lid that lies on it or leans to the wall."""
    rim = ((0.38, 0.54, 0.405), (0.38, 0.54, 0.425), (0.25, 0.36, 0.425), (0.25, 0.36, 0.405))
    seat = loft([ring(w, d, z, power) for w, d, z in rim], caps=False)
    steps = ((0.38, 0.54, 0.0), (0.39, 0.55, 0.012), (0.34, 0.5, 0.022))
    lid = loft([ring(w, d, z, power) for w, d, z in steps])
    lid = lid.at(0, -0.27).turned(pitch=-1.65).at(0, 0.25, 0.43) if lid_up else lid.at(z=0.43)
    return [seat, lid]


def _cistern(variant: int) -> list[PlainMesh]:
    """A tank behind the seat, or high on the wall with a pipe."""
    if variant == 6:
        pipe = tube([(0, 0.38, 0.35), (0, 0.38, 1.62)], 0.02)
        return [cushion(0.4, 0.16, 0.3, 0.03).at(0, 0.36, 1.6), pipe]
    wide, tall = (0.38, 0.36) if variant != 3 else (0.44, 0.3)
    return [
        cushion(wide, 0.18, tall, 0.04).at(0, 0.34, 0.4),
        cushion(wide + 0.02, 0.2, 0.035, 0.015).at(0, 0.34, 0.4 + tall),
        block(0.22, 0.24, 0.1, 0.03).at(0, 0.3, 0.3),
    ]


def bathtub(variant: int, look: FinishPicker) -> Parts:
    """A bathtub of 1.5 to 1.8 m, built in or free-standing."""
    long, d, h = look.between(1.55, 1.75), look.between(0.72, 0.8), look.between(0.54, 0.62)
    white = look.ceramic()
    tub = _tub(variant, long, d, h)
    parts: Parts = [finished(tub, white)]
    if variant in (0, 4, 7):
        apron = block(long + 0.01, 0.02, h - 0.02, 0.003).at(0, -d / 2 - 0.01)
        parts.append(finished(apron, look.lacquer() if variant else white))
    if variant == 3:
        parts.append(finished(legs(long * 0.7, d * 0.75, 0.2, 4, 0.05), look.brass()))
    if variant == 5:
        skirt = [ring(long + 0.01, d + 0.01, z, 3.0, 48) for z in (0, h - 0.08)]
        parts.append(finished(loft(skirt, caps=False), look.lacquer()))
    pipes = _tub_pipes(long, d, h, shower=variant in (0, 2, 7))
    return [*parts, finished(joined(pipes), look.chrome())]


def _tub(variant: int, long: float, d: float, h: float) -> PlainMesh:
    """The skin of a tub: its outside up to the rim, its inside down to the bottom."""
    power = (10.0, 2.6, 4.0, 2.2, 12.0, 3.0, 2.4, 8.0)[variant]
    outside = [(long, d, 0.0)]
    if variant in (1, 3, 6):
        low, flare = 0.16 if variant == 3 else 0.0, 0.82
        foot = (long * flare * 0.86, d * flare * 0.8, low)
        outside = [foot, (long * flare, d * flare, low + 0.05)]
    inside = [
        (long, d, h),
        (long + 0.02, d + 0.02, h + 0.015),
        (long - 0.12, d - 0.12, h + 0.015),
        (long - 0.2, d - 0.18, h - 0.2),
        (long - 0.4, d - 0.3, 0.2),
        (0.1, 0.1, 0.18),
    ]
    tub = loft([ring(w, deep, z, power, 48) for w, deep, z in (*outside, *inside)])
    if variant != 6:
        return tub

    def raised_ends(v: F64) -> F64:
        v[:, 2] += 0.16 * (v[:, 0] / long * 2) ** 2 * (v[:, 2] > 0.4)
        return v

    return tub.bent(raised_ends)


def _tub_pipes(long: float, d: float, h: float, *, shower: bool) -> list[PlainMesh]:
    """A mixer at the long side and maybe a shower at one end."""
    y = d / 2 - 0.05
    spout = [(0, y, h + 0.01), (0, y, h + 0.16), (0, y - 0.09, h + 0.2), (0, y - 0.15, h + 0.12)]
    pipes = [tube(curve(spout), 0.014)]
    if shower:
        x, wall, head = -long / 2 + 0.1, d / 2 - 0.03, d / 2 - 0.2
        pipes.append(tube(curve([(x, wall, h), (x, wall, 1.9), (x + 0.04, head, 2.0)]), 0.011))
        rose = revolved([(0, 0), (0.1, 0), (0.06, 0.02), (0, 0.03)], 20)
        pipes.append(rose.at(x + 0.04, head, 1.97))
    return pipes


def washing_machine(variant: int, look: FinishPicker) -> Parts:
    """A washing machine, 0.6 m wide, with a round door before the drum."""
    w, d, h = 0.6, (0.6, 0.45, 0.6, 0.58, 0.62, 0.6, 0.55, 0.6)[variant], 0.85
    skin = (look.ceramic, look.ceramic, look.steel, look.lacquer)[variant % 4]()
    glass, chrome = look.dark_glass(), look.chrome()
    r = (0.17, 0.15, 0.19, 0.16, 0.2, 0.17, 0.18, 0.165)[variant]
    hoop, pane = (mesh.at(0, -d / 2, 0.42) for mesh in _porthole(r))
    band = chrome if variant % 2 == 0 else look.plastic((0.2, 0.2, 0.22))
    panel = look.plastic((0.16, 0.17, 0.19) if variant in (2, 4, 6) else (0.82, 0.83, 0.84))
    dial = revolved([(0, 0), (0.035, 0), (0.03, 0.03), (0, 0.03)], 20).turned(pitch=np.pi / 2)
    dial_x, display_x = (0.05, -0.02, 0.0, 0.18)[variant % 4], 0.17 if variant % 4 != 3 else 0.0
    drawer = block(0.16, 0.01, 0.08, 0.004).at(-0.19, -d / 2 - 0.008, 0.735)
    display = block(0.12, 0.006, 0.05, 0.002).at(display_x, -d / 2 - 0.009, 0.75)
    parts: Parts = [
        finished(block(w, d, h, 0.012), skin),
        finished(hoop, band),
        finished(pane, glass),
        finished(block(w - 0.02, 0.012, 0.11, 0.004).at(0, -d / 2 - 0.004, 0.72), panel),
        finished(dial.at(dial_x, -d / 2 - 0.01, 0.775), chrome),
        finished(drawer, skin),
        finished(display, glass),
    ]
    if variant in (3, 7):
        towel = cushion(0.4, 0.3, 0.08, 0.035, puff=0.02)
        pile = joined([towel.at(0, 0, h + 0.08 * i) for i in range(2)])
        parts.append(finished(pile, look.cloth()))
    return parts


def _porthole(r: float) -> tuple[PlainMesh, PlainMesh]:
    """The ring and the bulging glass of a round door that looks along -y."""
    hoop = revolved([(r, 0), (r + 0.035, 0.0), (r + 0.03, 0.03), (r, 0.035)], 40)
    pane = revolved([(0, 0.06), (0.6 * r, 0.05), (r, 0.015), (r, 0), (0, 0)], 36)
    return hoop.turned(pitch=np.pi / 2), pane.turned(pitch=np.pi / 2)
