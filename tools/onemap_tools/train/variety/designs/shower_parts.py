"""Parts of showers: trays, panes, walls, and the outline of a corner."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import Mesh, box_between, cylinder, tube
from onemap_simulator.generation.model import Material
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.sanitary import SQUARE, ring, skin


def corner_outline(side: float, bow: float) -> F64:
    """A square (40, 2) about the origin whose corner (+x, -y) is cut by an arc or, at 0, a line.

    ``bow``: radius of the arc about the opposite corner, as a share of the diagonal.
    """
    angle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    c, s = np.cos(angle), np.sin(angle)
    half = side / 2
    reach = half / np.maximum(np.abs(c), np.abs(s))
    if bow == 0.0:
        across = (c - s) / np.sqrt(2)
        cut = np.where(across > 1e-6, side * 0.32 / np.maximum(across, 1e-6), np.inf)
    else:
        radius = side * np.sqrt(2) * bow
        along = c * half - s * half  # of the direction on the way from the corner (-x, +y)
        cut = -along + np.sqrt(along**2 + radius**2 - 2 * half**2 + 0.0)
    return np.stack([c, s], axis=1) * np.minimum(reach, cut)[:, None]


def clear_glass(sampler: Sampler) -> Material:
    """What the panes are made of."""
    return sampler.material("plain", 0.5, (0.75, 0.85, 0.88))


def wall_tiles(sampler: Sampler) -> Material:
    """What the walls are clad with: tiles or marble."""
    if sampler.chance(0.3):
        return sampler.material("marble", 0.8, sampler.colour())
    return sampler.material("tiles", sampler.uniform(0.25, 0.7), sampler.colour())


def flat_tray(size: tuple[float, float], height: float) -> Mesh:
    """A rectangular tray with a raised border."""
    inner = (size[0] - 0.1, size[1] - 0.1)
    low = max(height - 0.06, height * 0.4)
    rings = [ring(size, 0.0, SQUARE), ring(size, height, SQUARE), ring(inner, height, 12.0)]
    return skin([*rings, ring((inner[0] - 0.04, inner[1] - 0.04), low, 12.0)])


def glass_pane(
    start: tuple[float, float], end: tuple[float, float], low: float, top: float
) -> Mesh:
    """An upright sheet of glass between two points of the floor."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    long = float(np.hypot(dx, dy))
    sheet = box_between((0.0, -0.004, low), (long, 0.004, top))
    return sheet.rotated("z", float(np.degrees(np.arctan2(dy, dx)))).translated(*start)


def clad_walls(sampler: Sampler, size: tuple[float, float], top: float) -> list[Mesh]:
    """A clad wall behind, often another at the left."""
    x, y = size[0] / 2, size[1] / 2
    walls = [box_between((-x - 0.03, y, 0.0), (x, y + 0.03, top))]
    if sampler.chance(0.7):
        walls.append(box_between((-x - 0.03, -y, 0.0), (-x, y, top)))
    return walls


def pull_handle(at: tuple[float, float, float], tall: float) -> Mesh:
    """An upright bow to pull a door by."""
    x, y, z = at
    return tube(
        [(x, y, z), (x, y - 0.04, z + 0.02), (x, y - 0.04, z + tall), (x, y, z + tall + 0.02)],
        0.009,
    )


def floor_drain(at: tuple[float, float, float]) -> Mesh:
    """A round plate in the floor."""
    return cylinder(0.05, 0.008, at, 14)
