"""Baskets and bins."""

from __future__ import annotations

from onemap_tools.foreign.finish import finished
from onemap_tools.foreign.finish_picker import FinishPicker
from onemap_tools.foreign.plain_mesh import PlainMesh, block, curve, joined, loft, ring, tube
from onemap_tools.foreign.shapes.parts import Parts

OPEN_BINS = (2, 4, 6)


def _stack(
    w: float, power: float, steps: tuple[tuple[float, float], ...], caps: bool = True
) -> PlainMesh:
    """A loft of square to round rings: (share of the width, height) each."""
    return loft([ring(w * s, w * s, z, power, 40) for s, z in steps], caps)


def basket(variant: int, look: FinishPicker) -> Parts:
    """A basket for laundry or toys, plaited."""
    w = look.between(0.34, 0.48)
    sizes = ((0.5, 2), (0.3, 2), (0.55, 6), (0.28, 5), (0.4, 2), (0.6, 2), (0.25, 2), (0.45, 4))
    h, power = sizes[variant]
    belly = 1.15 if variant in (1, 4, 6) else 1.0
    inside = ((0.94, h), (0.84 * belly, 0.5 * h), (0.1, 0.05))
    wall = _stack(w, power, ((0.8, 0.0), (0.9 * belly, 0.5 * h), (1.0, h), *inside))
    parts: Parts = [finished(wall, look.wicker())]
    if variant in (0, 3, 6):
        grips = [
            tube(
                curve(
                    [(s * w / 2, -0.07, h), (s * (w / 2 + 0.03), 0, h + 0.08), (s * w / 2, 0.07, h)]
                ),
                0.012,
            )
            for s in (-1, 1)
        ]
        parts.append(finished(joined(grips), look.wicker()))
    if variant in (2, 5):
        lid = _stack(w, power, ((1.02, h), (1.02, h + 0.02), (0.5, h + 0.05)))
        parts.append(finished(lid, look.wicker()))
    if variant in (1, 3, 4, 7):
        heap = ((0.8, 0.6 * h), (0.85, 0.95 * h), (0.5, 1.12 * h), (0.1, 1.15 * h))
        parts.append(finished(_stack(w, 2.5, heap), look.cloth()))
    return parts


def trash_can(variant: int, look: FinishPicker) -> Parts:
    """A bin: with a pedal and a lid, or open for paper (OPEN_BINS)."""
    sizes = (
        (0.45, 0.26), (0.6, 0.34), (0.32, 0.26), (0.65, 0.4), (0.3, 0.24), (0.5, 0.3), (0.38, 0.3),
        (0.55, 0.36),
    )  # fmt: skip
    h, w = sizes[variant]
    power = 2.0 if variant in (0, 2, 4, 6) else 6.0
    grey = (0.2, 0.22, 0.24)
    skin = (look.steel, lambda: look.plastic(grey), look.lacquer, look.steel)[variant % 4]()
    if variant in OPEN_BINS:
        wall = _stack(w, power, ((0.75, 0.0), (1.0, h), (0.95, h), (0.72, 0.02), (0.05, 0.02)))
        rim = ((0.97, h - 0.05), (1.04, h + 0.005), (0.96, h + 0.01), (0.8, 0.5 * h))
        bag = finished(_stack(w, power, rim, caps=False), look.plastic((0.92, 0.92, 0.9)))
        return [finished(wall, skin), *([bag] if variant == 6 else [])]
    body = _stack(w, power, ((0.94, 0.0), (1.0, 0.02), (1.0, h - 0.1)))
    lid = _stack(w, power, ((1.03, h - 0.1), (1.03, h - 0.07), (0.85, h - 0.01), (0.3, h)))
    top = look.plastic((0.1, 0.1, 0.1)) if variant in (0, 3) else skin
    pedal = block(0.08, 0.06, 0.015, 0.005).at(0, -w / 2 - 0.02, 0.02)
    return [finished(body, skin), finished(lid, top), finished(pedal, look.iron())]
