"""A flat room of Habitat's, 4 m deep, without Habitat."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from onemap_shared.geometry import F64
from onemap_tools.bench.habitat.coordinates import Point, Quaternion
from onemap_tools.bench.habitat.world import AgentImage, AnnotatedBox

FLOOR_Y_M = 1.5
ROOM_X_M, ROOM_Z_M = (-2.0, 2.0), (-4.0, 0.0)  # right and backward
SOFA = AnnotatedBox(7, "couch", (-1.5, FLOOR_Y_M, -4.0), (0.0, FLOOR_Y_M + 0.8, -3.5))


class FakeWorld:
    """Implements ``World``: walls stop the agent, and it always sees the same picture."""

    def __init__(self, size: tuple[int, int] = (16, 16)) -> None:
        self._size = size
        self._pose: tuple[Point, Quaternion] = ((0.0, FLOOR_Y_M, 0.0), (0.0, 0.0, 0.0, 1.0))
        self.opened: list[tuple[Path, Path]] = []
        self.closed = False
        self.visible_id = SOFA.semantic_id

    def open(self, scene: Path, config: Path) -> None:
        self.opened.append((scene, config))

    def place(self, position: Point, rotation: Quaternion) -> None:
        self._pose = (position, rotation)

    def move(self, position: Point, rotation: Quaternion) -> Point:
        x, y, z = position
        reached = (float(np.clip(x, *ROOM_X_M)), y, float(np.clip(z, *ROOM_Z_M)))
        self._pose = (reached, rotation)
        return reached

    @property
    def pose(self) -> tuple[Point, Quaternion]:
        return self._pose

    def capture(self) -> AgentImage:
        rgb = np.full((*self._size, 3), 90, np.uint8)
        depth = np.full(self._size, 2.0, np.float32)
        depth[0] = np.inf
        depth[1] = 0.2
        return AgentImage(rgb, depth, np.full(self._size, self.visible_id, np.int64))

    def path_m(self, start: Point, ends: F64) -> float:
        return float(np.linalg.norm(ends - np.array(start), axis=1).min())

    def boxes(self) -> tuple[AnnotatedBox, ...]:
        return (SOFA,)

    def close(self) -> None:
        self.closed = True
