"""Pictures of several panels, and groups of small ones."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, front_panel
from onemap_simulator.generation.model import Material, Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.drawn_art import artwork, mounted
from onemap_tools.train.variety.designs.flat_forms import settled, window
from onemap_tools.train.variety.designs.wall_pictures import edge_of


def in_parts(sampler: Sampler) -> Model:
    """A picture in two to five panels side by side, level, stepped or of growing height."""
    count = sampler.integer(2, 5)
    wide, gap = sampler.uniform(0.18, 0.4), sampler.uniform(0.02, 0.06)
    wide = min(wide, 1.5 / count)
    height, deep = sampler.size(0.45, 0.95), sampler.uniform(0.018, 0.035)
    whole = artwork(sampler.rng, count * wide, height)
    step, kind = sampler.uniform(0.04, 0.12), sampler.integer(0, 3)
    bodies, canvases = [], []
    framed = sampler.chance(0.3)
    for index in range(count):
        x = (index - (count - 1) / 2) * (wide + gap)
        off = abs(index - (count - 1) / 2) * step
        high = height - 2 * off if kind == 1 else height
        z = {0: 0.0, 1: off, 2: off, 3: index * step}[kind]
        if framed:
            bodies.append(window((wide, high), 0.014, deep).translated(x, 0, z))
            bodies.append(box((wide - 0.01, 0.008, high - 0.01), (x, -0.004, z + 0.005)))
        else:
            bodies.append(box((wide, deep, high), (x, -deep / 2, z)))
        inset, y = (0.02, -0.011) if framed else (0.004, -deep - 0.002)
        art = front_panel(wide - inset, high - inset, (x, y, z + inset / 2))
        cut = whole[:, index * whole.shape[1] // count : (index + 1) * whole.shape[1] // count]
        canvases.append((Material(np.ascontiguousarray(cut)), [art]))
    return settled("picture", (edge_of(sampler), bodies), *canvases)


def cluster(sampler: Sampler) -> Model:
    """A group of small frames hung close together: a grid, or sizes mixed in columns."""
    columns, gap = sampler.integer(2, 4), sampler.uniform(0.02, 0.05)
    bar, deep = sampler.uniform(0.01, 0.025), sampler.uniform(0.015, 0.03)
    even, high = sampler.chance(0.4), sampler.uniform(0.2, 0.34)
    rows = sampler.integer(1, 3) if columns < 4 else sampler.integer(1, 2)
    wide = sampler.uniform(0.17, 0.3)
    edges = [edge_of(sampler), edge_of(sampler)]
    frames: tuple[list[Mesh], list[Mesh]] = ([], [])
    canvases = []
    left = 0.0
    for column in range(columns):
        w = wide if even else wide * sampler.uniform(0.75, 1.3)
        z = 0.0 if even else sampler.uniform(0, 0.08)
        for _ in range(rows):
            h = high if even else high * sampler.uniform(0.7, 1.2)
            x = left + w / 2
            frames[column % 2].append(window((w, h), bar, deep).translated(x, 0, z))
            frames[column % 2].append(box((w - 0.01, 0.006, h - 0.01), (x, -0.004, z + 0.005)))
            art = front_panel(w - bar, h - bar, (x, -0.0095, z + bar / 2))
            image = artwork(sampler.rng, w, h)
            if sampler.chance(0.5):
                image = mounted(sampler.rng, image, 0.2)
            canvases.append((Material(image), [art]))
            z += h + gap
        left += w + gap
    return settled("picture", (edges[0], frames[0]), (edges[1], frames[1]), *canvases)


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {"picture": (in_parts, cluster)}
