"""Books and ornaments that fill the compartments of bookcases."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, ellipsoid, lathe, prism, torus
from onemap_simulator.generation.model import Material
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.joinery import shifted

COVERS = 6
FINE_BOOKS = 50  # those after them have square spines, and all grow thicker


@dataclass(frozen=True, slots=True)
class Contents:
    """Collects what stands in one bookcase, by cover; ``full``: share of the width filled."""

    sampler: Sampler
    covers: tuple[list[Mesh], ...]
    ornaments: list[Mesh]
    full: float
    rounded: bool
    lying: float

    def fill(self, size: tuple[float, float, float], at: tuple[float, float, float]) -> None:
        """Fill a compartment of width, depth and height whose floor has its centre at ``at``."""
        width, depth, height = size
        x, end = -width / 2 + 0.004, width / 2 - 0.004
        if self.sampler.chance(0.07):
            return
        while x < end - 0.03:
            kind = self.sampler.rng.random()
            room = end - x
            if kind < self.lying and room > 0.2:
                x += self._pile(depth, height, x, at) + 0.01
            elif kind < self.lying + 0.12 and room > 0.12 and len(self.ornaments) < 7:
                x += self._ornament(min(room, depth, 0.22), height, x, at)
            elif kind < self.lying + 0.12 + 0.8 * (1 - self.full):
                x += self.sampler.uniform(0.05, 0.25)
            else:
                x += self._row(min(room, self.sampler.uniform(0.12, 0.5)), depth, height, x, at)

    def groups(self) -> list[tuple[Material, list[Mesh]]]:
        """All that was collected, with its materials."""
        made = [(self.sampler.plastic(), cover) for cover in self.covers]
        return [*made, (self.sampler.ceramic(), self.ornaments)]

    def _book(self, thick: float, deep: float, tall: float) -> Mesh:
        """A book that stands on its left lower edge at x = 0, its spine at y = 0."""
        if not self.rounded or sum(map(len, self.covers)) > FINE_BOOKS:
            return box((thick, deep, tall), (thick / 2, deep / 2, 0))
        half = thick / 2
        plan = [(0.0, 0.008), (half * 0.5, 0.0), (half * 1.5, 0.0), (thick, 0.008)]
        return prism([*plan, (thick, deep), (0.0, deep)], tall)

    def _row(
        self, room: float, depth: float, height: float, x: float, at: Sequence[float]
    ) -> float:
        """Standing books, often alike as a series; the last may lean. Returns the width used."""
        sampler, used = self.sampler, 0.0
        series = sampler.chance(0.15)
        cover, many = sampler.choice(self.covers), sum(map(len, self.covers))
        coarse = 1.0 + many / 70
        thick, tall = coarse * sampler.uniform(0.015, 0.05), height * sampler.uniform(0.6, 0.94)
        front = at[1] - depth / 2 + sampler.uniform(0.005, 0.04)
        deep = min(depth * 0.9, 0.2)
        while True:
            if not series:
                thick = coarse * sampler.uniform(0.012, 0.055)
                tall = height * sampler.uniform(0.55, 0.95)
                cover = sampler.choice(self.covers)
            if used + thick > room:
                break
            deep = min(depth * 0.92, sampler.uniform(0.13, 0.24), at[1] + depth / 2 - front)
            book = self._book(thick - 0.002, deep, tall)
            cover.append(book.translated(at[0] + x + used, front, at[2]))
            used += thick
        tall, lean = min(tall, height * 0.8), sampler.uniform(8, 22)
        wide = tall * float(np.sin(np.radians(lean))) + 0.03
        if used > 0.06 and used + wide < room:
            book = self._book(0.025, deep, tall).rotated("y", -lean)
            cover.append(book.translated(at[0] + x + used + wide - 0.03, front, at[2]))
            used += wide
        return max(used, 0.03)

    def _pile(self, depth: float, height: float, x: float, at: Sequence[float]) -> float:
        """Books lying on each other; returns the width used."""
        sampler, z = self.sampler, 0.0
        long, deep = sampler.uniform(0.16, 0.2), min(depth * 0.85, 0.2)
        for _ in range(sampler.integer(2, 6)):
            thick = sampler.uniform(0.015, 0.045)
            if z + thick > height * 0.9:
                break
            size = (long * sampler.uniform(0.8, 1.0), deep * sampler.uniform(0.85, 1), thick)
            place = (at[0] + x + long / 2, at[1] - depth * 0.05, at[2] + z)
            sampler.choice(self.covers).append(box(size, place))
            z += thick + 0.001
        return long

    def _ornament(self, room: float, height: float, x: float, at: Sequence[float]) -> float:
        """A vase, a ball, a box, a hoop or a frame; returns the width used."""
        sampler = self.sampler
        r = min(room * 0.42, sampler.uniform(0.04, 0.09), height * 0.4)
        kind, tall = sampler.integer(0, 4), min(height * 0.85, r * sampler.uniform(1.8, 3.5))
        if kind == 0:
            profile = [(0.5, 0.0), (1.0, 0.35), (0.75, 0.65), (0.35, 0.8), (0.5, 1.0)]
            made = [lathe([(r * a, tall * z) for a, z in profile], segments=10)]
        elif kind == 1:
            made = [ellipsoid((r, r, r), (0, 0, r), 8)]
        elif kind == 2:
            made = [box((r * 2, r * 1.6, tall * 0.5))]
        elif kind == 3:
            ring = torus(r * 0.8, r * 0.15, segments=10).rotated("x", 90)
            made = [ring.translated(0, 0, r * 0.99), box((r, r * 0.6, 0.015))]
        else:
            made = [box((r * 2, 0.012, min(r * 2.6, height * 0.85))).rotated("x", -8)]
            made = shifted(made, 0, 0, 0.002)
        self.ornaments.extend(shifted(made, at[0] + x + r * 1.1, at[1] - 0.01, at[2]))
        return r * 2.2


def contents(sampler: Sampler) -> Contents:
    """An empty collection with a manner of filling: crammed or airy, tidy or not."""
    return Contents(
        sampler,
        tuple([] for _ in range(COVERS)),
        [],
        full=sampler.uniform(0.45, 1.0),
        rounded=sampler.chance(0.4),
        lying=sampler.uniform(0.02, 0.2),
    )
