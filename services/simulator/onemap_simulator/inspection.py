"""Inspection of a user's scene file: its interpretation, and whether a robot can search in it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from onemap_shared.geometry import Bool
from onemap_shared.grid import GridSpec
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.scene.loading import (
    BODY_HEIGHTS_M,
    CELL_SIZE_M,
    assemble,
    floor_cells,
    free_space,
    size_problem,
    start_pose,
)
from onemap_simulator.scene.occupancy_raster import occupied_cells
from onemap_simulator.scene.scene import UNNAMED, Scene
from onemap_simulator.scene.scene_file import (
    Y_UP_SUFFIXES,
    SceneFile,
    missing_node,
    read_scene_file,
)

MIN_WIDTH_M = 1.0  # narrower is probably not in metres
MAX_LISTED = 5  # names listed in a warning

StartPose = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class SceneNode:
    """One node: its category, whether the YAML gives it, and its number of triangles."""

    name: str
    category: str
    from_yaml: bool
    triangles: int


@dataclass(frozen=True, slots=True)
class FloorMap:
    """Obstacles and the cells that the robot's centre can reach, (nx, ny) over ``grid``."""

    grid: GridSpec
    obstacles: Bool
    reachable: Bool

    @property
    def reachable_m2(self) -> float:
        """Area in square metres that the robot's centre can reach."""
        return float(self.reachable.sum()) * self.grid.cell_size_m**2


@dataclass(frozen=True, slots=True)
class SceneInspection:
    """The interpretation of a scene file in the map's axes (z up, floor at 0), in metres.

    floor_m: the floor's height along the file's up axis; start: x, y, yaw, None without free
    floor; floor: None if the scene is too wide to be examined. ``problems`` prevent a search,
    ``warnings`` do not.
    """

    scene: Scene
    nodes: tuple[SceneNode, ...]
    up: str
    up_reason: str
    floor_m: float
    start: StartPose | None
    start_from_yaml: bool
    floor: FloorMap | None
    warnings: tuple[str, ...]
    problems: tuple[str, ...]

    @property
    def searchable(self) -> bool:
        """Whether a robot can search in the scene."""
        return not self.problems

    @property
    def extent_m(self) -> tuple[StartPose, StartPose]:
        """The smallest and the largest x, y, z."""
        points = self.scene.vertices
        x, y, z = np.stack([np.min(points, axis=0), np.max(points, axis=0)], axis=1).tolist()
        return (x[0], y[0], z[0]), (x[1], y[1], z[1])


def inspect_scene(path: Path, *, radius_m: float, height_m: float) -> SceneInspection:
    """Examine a scene file for a robot of this size; ValueError if the file cannot be read.

    What only prevents a search, or can be corrected in the YAML, becomes a problem or a warning
    of the result.
    """
    file = read_scene_file(path)
    scene, floor_m = assemble(file)
    problems = [missing_node(file)] if file.unknown_nodes else []
    warnings = _naming_warnings(file)
    too_wide = size_problem(scene)
    start, floor = file.corrections.start, None
    if too_wide:
        problems.append(f"The scene {too_wide}.")
    else:
        warnings += _floor_warnings(scene)
        start = start or start_pose(*free_space(scene))
        collision = CollisionMap.of(scene, height_m)
        reachable = np.zeros(collision.clearance.shape, bool)
        if start is not None:
            reachable = collision.reachable_cells(start[0], start[1], radius_m)
        floor = FloorMap(collision.grid, collision.clearance <= 0, reachable)
        problems += _start_problems(file, start, floor, radius_m)
    return SceneInspection(
        scene=replace(scene, start=start or scene.start),
        nodes=tuple(
            SceneNode(
                node.name,
                file.category(node.name),
                node.name in file.corrections.categories,
                node.triangles,
            )
            for node in file.nodes
        ),
        up=file.up,
        up_reason=_up_reason(file),
        floor_m=floor_m,
        start=start,
        start_from_yaml=file.corrections.start is not None,
        floor=floor,
        warnings=tuple(warnings),
        problems=tuple(problems),
    )


def _up_reason(file: SceneFile) -> str:
    if file.corrections.up:
        return f"given by {file.yaml.name}"
    if file.path.suffix.lower() in Y_UP_SUFFIXES:
        return "the glTF standard"
    return f"assumed, the format does not say; 'up: y' in {file.yaml.name} changes it"


def _naming_warnings(file: SceneFile) -> list[str]:
    unnamed = sorted(n.name for n in file.nodes if file.category(n.name) == UNNAMED)
    if not unnamed:
        return []
    more = ", ..." if len(unnamed) > MAX_LISTED else ""
    return [
        f"{len(unnamed)} of {len(file.nodes)} nodes have no name that says what they are "
        f"({', '.join(unnamed[:MAX_LISTED])}{more}): a search for them has no ground truth. "
        f"Name them under 'categories' in {file.yaml.name}."
    ]


def _floor_warnings(scene: Scene) -> list[str]:
    warnings = []
    width_m = float(np.ptp(scene.vertices[:, :2], axis=0).max())
    if width_m < MIN_WIDTH_M:
        warnings.append(f"The scene is only {width_m:.2g} m wide: is its unit the metre?")
    _, blocked = occupied_cells(scene, CELL_SIZE_M, *BODY_HEIGHTS_M)
    if not floor_cells(scene, blocked).any():
        warnings.append(
            "No floor was found at height 0: the robot is taken to drive on a plane. If that is "
            "wrong, look whether the up axis is right."
        )
    return warnings


def _start_problems(
    file: SceneFile, start: StartPose | None, floor: FloorMap, radius_m: float
) -> list[str]:
    if start is None:
        return [
            "There is no free floor for a robot: look whether unit and up axis are right, or "
            f"give 'start: [x, y, yaw]' in {file.yaml.name}."
        ]
    if not floor.reachable.any():
        return [
            f"A robot of {radius_m:g} m radius cannot stand at the start ({start[0]:.2f}, "
            f"{start[1]:.2f}): give another 'start: [x, y, yaw]' in {file.yaml.name}."
        ]
    return []
