"""The layout of an apartment's rooms: the models placed, and whether one more fits.

Models are treated as axis-aligned boxes in the map frame. A model fits if its box
overlaps no other, if a robot can still drive from the hub into every room, and if it
can still approach every model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onemap_shared.geometry import F32, F64, Bool
from onemap_shared.grid import GridSpec
from onemap_simulator.generation.floor_plan import HALF_WALL_M, FloorPlan, Opening, Rect
from onemap_simulator.generation.mesh import rotation
from onemap_simulator.generation.model import Model
from onemap_simulator.scene.cell_masks import clearance_m, connected_part, distance_m

CELL_SIZE_M = 0.05
ROBOT_CLEARANCE_M = 0.32  # radius 0.25 m and a margin of more than one cell
MAX_APPROACH_M = 0.85  # distance at which every model must be approachable; the scenes promise 1 m
DOOR_CLEAR_M = 0.75  # floor that stays free on both sides of a door
MAX_CUT_OFF_M2 = 0.3  # total floor area that may become unreachable: negligible
TOUCH_M = 0.01  # overlap that counts as touching
STEP_OVER_M = 0.05  # lower models, such as rugs, do not block
ROBOT_HEIGHT_M = 1.4  # models that hang higher do not block


@dataclass(frozen=True, slots=True, eq=False)
class PlacedModel:
    """A model at x, y, z (metres), rotated counter-clockwise by degrees, in room ``space``."""

    model: Model
    position_m: tuple[float, float, float]
    yaw_deg: float
    space: int
    box: F64  # (2, 3): lower and upper corner in the map frame

    @property
    def blocks(self) -> bool:
        """Whether a robot cannot drive over or under it."""
        return bool(self.box[1, 2] > STEP_OVER_M and self.box[0, 2] < ROBOT_HEIGHT_M)


def place(
    model: Model, position_m: tuple[float, float, float], yaw_deg: float, space: int
) -> PlacedModel:
    """The placed model, with its box."""
    R = rotation("z", yaw_deg)
    points = [part.mesh.vertices @ R.T for part in model.parts]
    lower = np.min([p.min(axis=0) for p in points], axis=0)
    upper = np.max([p.max(axis=0) for p in points], axis=0)
    return PlacedModel(model, position_m, yaw_deg, space, np.stack([lower, upper]) + position_m)


class RoomLayout:
    """The models of an apartment, grown by ``add``; every model stays approachable."""

    def __init__(self, plan: FloorPlan) -> None:
        self.plan = plan
        self.placed: list[PlacedModel] = []
        self.window_boxes = _window_zones(plan)
        self._boxes = np.array([*_door_zones(plan), *self.window_boxes])
        rects = np.array([space.rect for space in plan.spaces])
        lower, upper = rects[:, :2].min(axis=0), rects[:, 2:].max(axis=0)
        self.grid = GridSpec.covering(CELL_SIZE_M, tuple(lower), tuple(upper))
        self._blocked = self._walls()
        self._goals = self.grid.cells(np.array(_gate_points(plan)))

    def add_fixed(self, fittings: Sequence[PlacedModel]) -> None:
        """Add doors, whose open leaves block, and windows; both may lie in walls."""
        parts = [
            place(Model("door", (part,)), item.position_m, item.yaw_deg, item.space)
            for item in fittings
            for part in item.model.parts
            if item.model.category == "door"
        ]
        for part in parts:
            if part.blocks:
                self._blocked[self._cells_of(part.box)] = True
        self._boxes = np.concatenate([self._boxes, [part.box for part in parts]])

    def add(self, group: Sequence[PlacedModel], ignoring: Sequence[F64] = ()) -> bool:
        """Place the group, whose members may overlap each other; returns whether it fits.

        ``ignoring`` holds boxes that the group may overlap: those of what it stands on.
        """
        if not all(self.fits(item, ignoring) for item in group):
            return False
        blocked = self._blocked
        if any(item.blocks for item in group):
            blocked = blocked.copy()
            for item in group:
                if item.blocks:
                    blocked[self._cells_of(item.box)] = True
        everything = [*self.placed, *group]
        if not self._all_near(blocked, everything):
            return False
        self._blocked = blocked
        self.placed = everything
        self._boxes = np.concatenate([self._boxes, [item.box for item in group]])
        return True

    def fits(self, item: PlacedModel, ignoring: Sequence[F64] = ()) -> bool:
        """Whether the model lies within its room and overlaps no other box."""
        x0, y0, x1, y1 = self.plan.spaces[item.space].inner
        (left, low, bottom), (right, high, top) = item.box
        if left < x0 - TOUCH_M or right > x1 + TOUCH_M or low < y0 - TOUCH_M:
            return False
        if high > y1 + TOUCH_M or bottom < -TOUCH_M or top > self.plan.height_m:
            return False
        if top <= STEP_OVER_M:
            return True
        meets = (self._boxes[:, 0] < item.box[1] - TOUCH_M) & (
            self._boxes[:, 1] > item.box[0] + TOUCH_M
        )
        hits = np.flatnonzero(meets.all(axis=1))
        return all(any(np.array_equal(self._boxes[i], box) for box in ignoring) for i in hits)

    def reachable_cells(self) -> Bool:
        """Cells (nx, ny) where the robot's centre may be, reachable from the hub."""
        return connected_part(self.clearance() >= ROBOT_CLEARANCE_M, self._goals[0])

    def clearance(self) -> F32:
        """Distance (nx, ny) in metres to the nearest blocked cell."""
        return clearance_m(self._blocked, CELL_SIZE_M)

    def _all_near(self, blocked: Bool, items: Sequence[PlacedModel]) -> bool:
        """Whether almost all floor stays reachable and every model approachable."""
        roomy = clearance_m(blocked, CELL_SIZE_M) >= ROBOT_CLEARANCE_M
        reachable = connected_part(roomy, self._goals[0])
        if not reachable[self._goals[:, 0], self._goals[:, 1]].all():
            return False
        if (roomy & ~reachable).sum() * CELL_SIZE_M**2 > MAX_CUT_OFF_M2:
            return False
        away = distance_m(reachable, CELL_SIZE_M, exact=False)
        return all(away[self._cells_of(item.box)].min() <= MAX_APPROACH_M for item in items)

    def _cells_of(self, box: F64) -> tuple[slice, slice]:
        low = np.maximum(self.grid.cells(box[0] + TOUCH_M), 0)
        high = np.maximum(self.grid.cells(box[1] - TOUCH_M), low)
        return slice(int(low[0]), int(high[0]) + 1), slice(int(low[1]), int(high[1]) + 1)

    def _walls(self) -> Bool:
        blocked = np.ones(self.grid.shape, dtype=bool)
        for space in self.plan.spaces:
            self._clear(blocked, space.inner)
        for door in self.plan.doors:
            reach = HALF_WALL_M + CELL_SIZE_M
            x, y = door.centre
            half = (door.width / 2, reach) if door.axis == 0 else (reach, door.width / 2)
            self._clear(blocked, (x - half[0], y - half[1], x + half[0], y + half[1]))
        return blocked

    def _clear(self, blocked: Bool, rect: Rect) -> None:
        """Free the cells that lie wholly within the rectangle."""
        low = self.grid.cells(np.array(rect[:2]) + CELL_SIZE_M * 0.999)
        high = self.grid.cells(np.array(rect[2:]))
        blocked[low[0] : high[0], low[1] : high[1]] = False


def _around(opening: Opening, reach: float, z: tuple[float, float]) -> F64:
    """The box (2, 3) in front of and behind an opening."""
    x, y = opening.centre
    half = (opening.width / 2, reach) if opening.axis == 0 else (reach, opening.width / 2)
    return np.array([[x - half[0], y - half[1], z[0]], [x + half[0], y + half[1], z[1]]])


def _door_zones(plan: FloorPlan) -> list[F64]:
    reach = HALF_WALL_M + DOOR_CLEAR_M
    openings = (*plan.doors, plan.entrance)
    return [_around(opening, reach, (0.0, opening.top)) for opening in openings]


def _window_zones(plan: FloorPlan) -> list[F64]:
    return [_around(w, HALF_WALL_M + 0.12, (w.sill, w.top)) for w in plan.windows]


def _gate_points(plan: FloorPlan) -> list[tuple[float, float]]:
    """Points just inside both rooms of every door: all must stay reachable from the first."""
    points = []
    for door in plan.doors:
        x, y = door.centre
        for sign in (-1, 1):
            off = sign * (HALF_WALL_M + 0.5)
            points.append((x, y + off) if door.axis == 0 else (x + off, y))
    return points
