"""Parts of toilets: the pan, the hollow bowl, seat and cover, the flush."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, cylinder, from_faces, rod
from onemap_simulator.generation.model import Material
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.sanitary import shell


class Pan(NamedTuple):
    """Width, length and rim height of a bowl, and the powers of its front and back outline."""

    width: float
    length: float
    height: float
    power: float
    back: float

    @property
    def size(self) -> tuple[float, float]:
        return (self.width, self.length)


def draw_pan(sampler: Sampler, power: float = 2.0) -> Pan:
    """A pan of any size; ``power``: of its outline in front."""
    back = max(power, sampler.uniform(2.2, 5.0))
    return Pan(
        sampler.size(0.34, 0.41),
        sampler.size(0.44, 0.56),
        sampler.size(0.37, 0.46),
        power,
        back,
    )


def hollow_bowl(pan: Pan, foot: float, low: float = 0.0, setback: float = 0.08) -> Mesh:
    """A hollow bowl whose foot (a share of the rim) is set back; from ``low`` to the rim."""
    h = pan.height - low
    shares = [(foot, 0.0), (foot * 0.94, 0.3), ((foot + 1) / 2 - 0.04, 0.62), (0.97, 0.88)]
    inside = [(1.0, 0.94), (1.0, 1.0), (0.72, 1.0), (0.62, 0.72), (0.3, 0.45), (0.0, 0.42)]
    profile = [(share, low + z * h) for share, z in [*shares, *inside]]
    body = shell(profile, pan.size, pan.power, pan.back)
    fall = (1 - (body.vertices[:, 2] - low) / h) ** 2
    shift = np.stack([np.zeros_like(fall), fall * setback, np.zeros_like(fall)], axis=1)
    return from_faces(body.vertices + shift, body.faces)


def seat_and_cover(sampler: Sampler, pan: Pan, state: str) -> list[Mesh]:
    """A seat ring and a cover: "closed", "open" (the cover upright) or "up" (both upright)."""
    thick, w = sampler.uniform(0.018, 0.03), sampler.uniform(1.0, 1.06)
    size = (pan.width * w, pan.length * w)
    hole = sampler.uniform(0.6, 0.7)
    edges = [(1.0, 0.0), (1.0, thick), (hole, thick), (hole, 0.0), (1.0, 0.0)]
    seat = shell(edges, size, pan.power, pan.back, capped=False)
    dome = sampler.uniform(0.0, 0.02)
    top = [(1.0, 0.0), (1.0, 0.016), (0.92, 0.02 + dome * 0.6), (0.0, 0.022 + dome)]
    cover = shell(top, size, pan.power, pan.back)
    back, z = size[1] / 2, pan.height + 0.004
    hinges = [cylinder(0.016, 0.03, (x * pan.width * 0.22, back - 0.01, z), 8) for x in (-1, 1)]
    tilt = -(90 + sampler.uniform(2, 7))
    if state == "closed":
        return [seat.translated(0, 0, z), cover.translated(0, 0, z + thick + 0.003), *hinges]
    upright = cover.translated(0, -back, 0).rotated("x", tilt).translated(0, back, z + 0.02)
    if state == "open":
        return [seat.translated(0, 0, z), upright, *hinges]
    ring = seat.translated(0, -back, 0).rotated("x", tilt + 3)
    return [ring.translated(0, back - 0.028, z + 0.02), upright, *hinges]


def seat_material(sampler: Sampler, ceramic: Material) -> Material:
    """What a seat is made of, as its bowl or of its own."""
    kind = sampler.integer(0, 3)
    if kind < 2:
        return ceramic if kind == 0 else sampler.plastic()
    return sampler.wood() if kind == 2 else sampler.dark()


def flush_handle(sampler: Sampler, at: tuple[float, float, float], width: float) -> list[Mesh]:
    """On a tank: buttons on its top, or a lever on its front; ``at``: middle of the top."""
    x, y, z = at
    kind = sampler.integer(0, 2)
    if kind == 0:
        return [cylinder(0.03, 0.012, (x, y, z), 12)]
    if kind == 1:
        return [box((0.05, 0.04, 0.01), (x + s * 0.028, y, z)) for s in (-1, 1)]
    side = sampler.choice((-1, 1)) * width * 0.32
    low = z - 0.07
    front = y - 0.1
    return [
        rod((side, y, low), (side, front - 0.025, low), 0.014),
        rod(
            (side, front - 0.02, low),
            (side - np.sign(side) * 0.08, front - 0.025, low - 0.015),
            0.008,
        ),
    ]
