"""What may be wrong with a user's scene file although a robot can drive in it, in sentences."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.scene.loading import BODY_HEIGHTS_M, CELL_SIZE_M, floor_cells, load_scene
from onemap_simulator.scene.occupancy_raster import occupied_cells
from onemap_simulator.scene.scene import UNNAMED, Scene
from onemap_simulator.scene.scene_file import SceneFile, read_scene_file

MIN_WIDTH_M = 1.0  # narrower is probably not in metres
MAX_LISTED = 5  # names listed in a warning


def scene_warnings(
    path: Path, *, radius_m: float, height_m: float, own_start: bool = True
) -> list[str]:
    """What can be corrected in the YAML; ValueError if the file cannot be read, or a robot of this
    size cannot stand at its start.

    own_start: whether the robot begins at the scene's start, not at one of the configuration.
    """
    file, scene = read_scene_file(path), load_scene(path)
    x, y = scene.start[:2]
    if own_start and not CollisionMap.of(scene, height_m).reachable_cells(x, y, radius_m).any():
        raise ValueError(
            f"a robot of {radius_m:g} m radius cannot stand at the start ({x:.2f}, {y:.2f}) of "
            f"scene {path}: give another 'start: [x, y, yaw]' in {file.yaml.name}"
        )
    return [*_naming_warnings(file), *_floor_warnings(scene)]


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
