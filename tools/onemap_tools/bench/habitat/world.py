"""What the robot and the benchmark need of Habitat, in Habitat's coordinates."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from onemap_shared.geometry import F32, F64, I64, U8
from onemap_tools.bench.habitat.coordinates import Point, Quaternion


@dataclass(frozen=True, slots=True)
class AgentImage:
    """What the agent sees: rgb (H, W, 3) uint8; depth_m (H, W) float32 along the optical axis, 0 or
    infinite where nothing is; semantic_ids (H, W) of objects, 0 = none or not annotated."""

    rgb: U8
    depth_m: F32
    semantic_ids: I64


@dataclass(frozen=True, slots=True)
class AnnotatedBox:
    """An annotated object and the corners of its axis-aligned box."""

    semantic_id: int
    category: str
    lower: Point
    upper: Point


class World(Protocol):
    """One scene at a time with one agent in it."""

    def open(self, scene: Path, config: Path) -> None:
        """Load a scene's file with its annotations; ValueError with one sentence."""

    def place(self, position: Point, rotation: Quaternion) -> None:
        """Put the agent there."""

    def move(self, position: Point, rotation: Quaternion) -> Point:
        """Move the agent straight towards a position, as far as the floor allows without sliding
        along obstacles, and turn it; returns where it is."""

    @property
    def pose(self) -> tuple[Point, Quaternion]:
        """Where the agent is."""

    def capture(self) -> AgentImage:
        """What it sees."""

    def path_m(self, start: Point, ends: F64) -> float:
        """Length of the shortest path to the nearest of (N, 3) places; infinity without one."""

    def boxes(self) -> tuple[AnnotatedBox, ...]:
        """All annotated objects of the scene."""

    def close(self) -> None:
        """Unload the scene."""
