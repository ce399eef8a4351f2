"""Start pose and lamps for scenes from files, chosen from their free floor."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F32, F64, Bool
from onemap_shared.grid import GridSpec
from onemap_simulator.scene.cell_masks import clearance_m, dilated, largest_part
from onemap_simulator.scene.occupancy_raster import occupied_cells
from onemap_simulator.scene.scene import PointLight, Scene

CELL_SIZE_M = 0.05
ROBOT_CLEARANCE_M = 0.3  # from any obstacle: a robot of 0.25 m radius and a cell
BODY_HEIGHTS_M = (0.05, 1.4)  # geometry between these heights is an obstacle
FLOOR_HEIGHTS_M = (-0.05, 0.05)  # geometry between these heights is floor
LAMP_HEIGHT_M = 2.1
LAMP_SPACING_M = 3.5
MAX_LAMPS = 8
LAMP = (0.8, 0.8, 0.78)


def free_space(scene: Scene) -> tuple[GridSpec, F32]:
    """The largest connected floor area: clearance (nx, ny) float32 in metres, 0 outside of it.

    Floor is where geometry lies at height 0; a scene without any is taken to have a plane.
    """
    grid, blocked = occupied_cells(scene, CELL_SIZE_M, *BODY_HEIGHTS_M)
    floor = floor_cells(scene, blocked)
    if not floor.any():
        floor = np.ones_like(blocked)
    clearance = clearance_m(blocked | ~floor, CELL_SIZE_M)
    return grid, np.where(largest_part(clearance >= ROBOT_CLEARANCE_M), clearance, np.float32(0.0))


def floor_cells(scene: Scene, blocked: Bool) -> Bool:
    """Cells (nx, ny) with geometry at height 0; none if all of it lies below obstacles."""
    _, floor = occupied_cells(scene, CELL_SIZE_M, *FLOOR_HEIGHTS_M)
    foot = dilated(blocked)
    return floor if (floor & ~foot).any() else np.zeros_like(floor)


def start_pose(grid: GridSpec, clearance: F32) -> tuple[float, float, float] | None:
    """x, y, yaw where the clearance is largest, facing the centre of the free space, or None."""
    if not clearance.any():
        return None
    best = np.array(np.unravel_index(int(clearance.argmax()), clearance.shape))
    x, y = grid.centres(best)
    middle = grid.centres(np.argwhere(clearance > 0)).mean(axis=0)
    return (float(x), float(y), float(np.arctan2(middle[1] - y, middle[0] - x)))


def ceiling_lamps(grid: GridSpec, clearance: F32) -> tuple[PointLight, ...]:
    """Up to MAX_LAMPS lamps over the free space, by farthest point sampling."""
    places: F64 = grid.centres(np.argwhere(clearance > 0))
    if not len(places):
        return ()
    chosen = [places[np.linalg.norm(places - places.mean(axis=0), axis=1).argmin()]]
    away = np.linalg.norm(places - chosen[0], axis=1)
    while len(chosen) < MAX_LAMPS and away.max() > LAMP_SPACING_M:
        chosen.append(places[away.argmax()])
        away = np.minimum(away, np.linalg.norm(places - chosen[-1], axis=1))
    return tuple(PointLight((float(x), float(y), LAMP_HEIGHT_M), LAMP) for x, y in chosen)
