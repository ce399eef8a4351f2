"""Exact distances from a place on the floor to the outlines of obstacles."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64

REACH_M = 0.5  # distances up to this are exact; a robot's radius is less
BLOCK_M = 0.5  # side of the squares for which the segments nearby are gathered once


class Outlines:
    """Segments (M, 2, 2) in metres: the outlines of everything at the heights of a robot."""

    def __init__(self, segments: F64) -> None:
        self._segments = segments
        self._lower = segments.min(axis=1)
        self._upper = segments.max(axis=1)
        self._blocks: dict[tuple[int, int], F64] = {}

    def distance_m(self, x_m: float, y_m: float) -> float:
        """Distance in metres to the nearest outline; infinity if it is above ``REACH_M``."""
        segments = self._near(int(x_m // BLOCK_M), int(y_m // BLOCK_M))
        if not len(segments):
            return float("inf")
        start, along = segments[:, 0], segments[:, 1] - segments[:, 0]
        to_place = np.array([x_m, y_m]) - start
        squared = np.maximum((along**2).sum(axis=1), 1e-18)
        part = np.clip((to_place * along).sum(axis=1) / squared, 0.0, 1.0)
        distance = float(np.hypot(*(to_place - part[:, None] * along).T).min())
        return distance if distance <= REACH_M else float("inf")

    def _near(self, i: int, j: int) -> F64:
        """The segments whose bounding box comes within ``REACH_M`` of a block."""
        if (i, j) not in self._blocks:
            lower = np.array([i, j]) * BLOCK_M - REACH_M
            upper = lower + BLOCK_M + 2 * REACH_M
            near = ((self._upper >= lower) & (self._lower <= upper)).all(axis=1)
            self._blocks[i, j] = np.unique(self._segments[near], axis=0)
        return self._blocks[i, j]
