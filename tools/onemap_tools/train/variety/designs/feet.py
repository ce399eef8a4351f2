"""Feet of sofas, armchairs and beds: turned, carved, bent of steel, on a star."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, cylinder, lathe, rod, tube
from onemap_simulator.generation.model import Material
from onemap_simulator.generation.sampler import Sampler

WOODEN = ("block", "bun", "tapered", "splayed", "turned", "cabriole")
STEEL = ("sled", "hairpin", "peg")
# Feet turned on a lathe: radius in shares of the thickness, height in shares of the height.
_LATHED = {
    "bun": ((0.5, 0.0), (0.95, 0.2), (1.0, 0.45), (0.8, 0.75), (0.45, 0.85), (0.5, 1.0)),
    "turned": ((0.3, 0.0), (0.45, 0.1), (0.3, 0.2), (0.65, 0.6), (0.4, 0.7), (0.65, 0.8), (0.6, 1)),
    "tapered": ((0.3, 0.0), (0.62, 1.0)),
    "peg": ((0.35, 0.0), (0.35, 1.0)),
}
Group = tuple[Material, list[Mesh]]


def feet(sampler: Sampler, width: float, depth: float, height: float, style: str) -> list[Mesh]:
    """Feet at the corners of a rectangle, set in a little; a middle pair under long things."""
    thick = float(np.clip(height * sampler.uniform(0.3, 0.5), 0.03, 0.07))
    x, y = width / 2 - thick, depth / 2 - thick
    if style == "sled":
        return [_sled(side * (x - 0.05), y, height) for side in (-1, 1)]
    xs = [-x, x] if width < 1.7 else [-x, 0.0, x]
    return [
        mesh for at_x in xs for at_y in (-y, y) for mesh in _foot(at_x, at_y, height, thick, style)
    ]


def _sled(x: float, y: float, height: float) -> Mesh:
    points = [(x, -y, height), (x, -y, 0.03), (x, -y + 0.03, 0.012)]
    points += [(x, y - 0.03, 0.012), (x, y, 0.03), (x, y, height)]
    return tube(points, 0.012)


def _foot(x: float, y: float, height: float, thick: float, style: str) -> list[Mesh]:
    if style in _LATHED:
        return [lathe([(r * thick, h * height) for r, h in _LATHED[style]], (x, y, 0), 10)]
    if style == "block":
        return [box((thick * 1.4, thick * 1.4, height), (x, y, 0))]
    return _slanting_foot(x, y, height, thick, style)


def _slanting_foot(x: float, y: float, height: float, thick: float, style: str) -> list[Mesh]:
    out_x, out_y = float(np.sign(x)), float(np.sign(y))
    if style == "splayed":
        top = (x - out_x * 0.25 * height, y - out_y * 0.25 * height, height)
        return [rod((x, y, 0), top, thick * 0.4)]
    if style == "hairpin":
        tops = [(x - out_x * 0.08, y, height), (x, y - out_y * 0.08, height)]
        return [rod((x, y, 0), top, 0.006, 6) for top in tops]
    knee = np.array([[0, 1], [0.5, 0.75], [0.3, 0.45], [0.0, 0.15], [0.35, 0.03]])
    points = [(x + out_x * k * thick, y + out_y * k * thick, h * height) for k, h in knee.tolist()]
    sole = cylinder(thick * 0.6, 0.016, (points[-1][0], points[-1][1], 0), 8)
    return [tube(points, thick * 0.42, 8), sole]


def swivel_star(sampler: Sampler, radius: float, height: float) -> list[Mesh]:
    """A column on a star of four or five spokes, or on a flat disc."""
    column = [cylinder(0.024, height - 0.02, (0, 0, 0.02), 12)]
    if sampler.chance(0.3):
        return [*column, cylinder(radius * 0.85, 0.02, (0, 0, 0), 22)]
    count = sampler.choice((4, 4, 5))
    spokes = [(i + 0.5) * 2 * np.pi / count for i in range(count)]
    for angle in spokes:
        x, y = radius * float(np.cos(angle)), radius * float(np.sin(angle))
        column.append(rod((0, 0, 0.09), (x, y, 0.022), 0.016))
        column.append(cylinder(0.022, 0.02, (x, y, 0), 8))
    return column


def footing(sampler: Sampler, width: float, depth: float, height: float) -> Group:
    """Feet of any style, of wood or metal."""
    if sampler.chance(0.7):
        return sampler.wood(), feet(sampler, width, depth, height, sampler.choice(WOODEN))
    return sampler.metal(), feet(sampler, width, depth, height, sampler.choice(STEEL))
