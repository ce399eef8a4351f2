"""Placement of models in an apartment's rooms, and whether one more fits.

Models are treated as axis-aligned boxes in the map frame. A model fits if its box
overlaps no other, if a robot can still drive from the hub into every room, and if it
can still approach every model.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from onemap_shared.geometry import F32, F64, Bool
from onemap_shared.grid import GridSpec
from onemap_simulator.generation.floor_plan import HALF_WALL_M, SIDES, FloorPlan, Opening, Rect
from onemap_simulator.generation.mesh import Model, Vec, rotation
from onemap_simulator.generation.style import ModelFactory, Sampler
from onemap_simulator.scene.cell_masks import clearance_m, connected_part, distance_m

CELL_SIZE_M = 0.05
ROBOT_CLEARANCE_M = 0.32  # radius 0.25 m and a margin of more than one cell
MAX_APPROACH_M = 0.85  # distance at which every model must be approachable; the scenes promise 1 m
DOOR_CLEAR_M = 0.75  # floor that stays free on both sides of a door
WINDOW_CLEAR_M = 0.12
MAX_CUT_OFF_M2 = 0.3  # total floor area that may become unreachable: negligible
TOUCH_M = 0.01  # overlap that counts as touching
STEP_OVER_M = 0.05  # lower models, such as rugs, do not block
ROBOT_HEIGHT_M = 1.4  # models that hang higher do not block

# Rotation in degrees that puts a model's back (+y) to each side of a room.
YAW_DEG = {"north": 0.0, "west": 90.0, "south": 180.0, "east": 270.0}
WALL_GAP_M = 0.02
TRIES = 14
WIDE_M = 0.3
SHARES = 9  # places tried along one wall

Candidate = tuple[float, ModelFactory]  # probability, factory


@dataclass(frozen=True, slots=True, eq=False)
class PlacedModel:
    """A model at x, y, z (metres), rotated counter-clockwise by degrees, in room ``space``."""

    model: Model
    position_m: Vec
    yaw_deg: float
    space: int
    box: F64  # (2, 3): lower and upper corner in the map frame

    @property
    def blocks(self) -> bool:
        """Whether a robot cannot drive over or under it."""
        return bool(self.box[1, 2] > STEP_OVER_M and self.box[0, 2] < ROBOT_HEIGHT_M)


def place(model: Model, position_m: Vec, yaw_deg: float, space: int) -> PlacedModel:
    """The placed model, with its box."""
    return PlacedModel(model, position_m, yaw_deg, space, _box(model, yaw_deg) + position_m)


@lru_cache(maxsize=64)  # a model is tried along all walls
def _box(model: Model, yaw_deg: float) -> F64:
    """The model's box (2, 3) after rotation about its origin; not to be written."""
    R = rotation("z", yaw_deg)
    points = np.concatenate([part.mesh.vertices @ R.T for part in model.parts])
    return np.stack([points.min(axis=0), points.max(axis=0)])


def _relative(support: PlacedModel, model: Model, offset: F64, yaw_deg: float) -> PlacedModel:
    """The model at an offset (3,) and rotation in the local frame of a placed one."""
    x, y, z = rotation("z", support.yaw_deg) @ offset + support.position_m
    return place(model, (float(x), float(y), float(z)), support.yaw_deg + yaw_deg, support.space)


class RoomLayout:
    """The models of an apartment, grown by ``add``; every model stays approachable."""

    def __init__(self, plan: FloorPlan) -> None:
        self.plan = plan
        self.placed: list[PlacedModel] = []
        self._cells: list[tuple[slice, slice]] = []  # of each of the placed
        reach = HALF_WALL_M + DOOR_CLEAR_M
        doors = [_around(door, reach, 0.0) for door in (*plan.doors, plan.entrance)]
        reach = HALF_WALL_M + WINDOW_CLEAR_M
        self.window_boxes = [_around(window, reach, window.sill) for window in plan.windows]
        self._boxes = np.array([*doors, *self.window_boxes])
        rects = np.array([space.rect for space in plan.spaces])
        lower, upper = rects[:, :2].min(axis=0), rects[:, 2:].max(axis=0)
        self.grid = GridSpec.covering(CELL_SIZE_M, tuple(lower), tuple(upper))
        self._blocked = self._walls()
        self._goals = self.grid.cells(np.array(_gate_points(plan)))

    def add_fixed(self, fittings: Sequence[PlacedModel]) -> None:
        """Add doors, whose open leaves block; they may lie in walls."""
        parts = [
            place(Model("door", (part,)), item.position_m, item.yaw_deg, item.space)
            for item in fittings
            for part in item.model.parts
            if item.model.category == "door"
        ]
        self._blocked = self._with(parts)
        self._boxes = np.concatenate([self._boxes, [part.box for part in parts]])

    def add(self, group: Sequence[PlacedModel], ignoring: Sequence[F64] = ()) -> bool:
        """Place the group, whose members may overlap each other; returns whether it fits.

        ``ignoring`` holds boxes that the group may overlap: those of what it stands on.
        """
        if not all(self._fits(item, ignoring) for item in group):
            return False
        blocked = self._with(group)
        cells = [*self._cells, *(self._cells_of(item.box) for item in group)]
        if not self._all_near(blocked, cells):
            return False
        self._blocked, self._cells = blocked, cells
        self.placed = [*self.placed, *group]
        self._boxes = np.concatenate([self._boxes, [item.box for item in group]])
        return True

    def clearance(self) -> F32:
        """Distance (nx, ny) in metres to the nearest blocked cell, 0 where no robot gets to."""
        clearance = clearance_m(self._blocked, CELL_SIZE_M)
        reachable = connected_part(clearance >= ROBOT_CLEARANCE_M, self._goals[0])
        return np.where(reachable, clearance, np.float32(0.0))

    def _fits(self, item: PlacedModel, ignoring: Sequence[F64]) -> bool:
        """Whether the model lies within its room and overlaps no other box."""
        x0, y0, x1, y1 = self.plan.spaces[item.space].inner
        lower, upper = item.box
        if (lower < (x0 - TOUCH_M, y0 - TOUCH_M, -TOUCH_M)).any():
            return False
        if (upper > (x1 + TOUCH_M, y1 + TOUCH_M, self.plan.height_m)).any():
            return False
        if upper[2] <= STEP_OVER_M:
            return True
        meets = (self._boxes[:, 0] < upper - TOUCH_M) & (self._boxes[:, 1] > lower + TOUCH_M)
        hits = self._boxes[meets.all(axis=1)]
        return all(any(np.array_equal(hit, box) for box in ignoring) for hit in hits)

    def _with(self, items: Sequence[PlacedModel]) -> Bool:
        """The blocked cells (nx, ny), with those of the items."""
        blocking = [item for item in items if item.blocks]
        blocked = self._blocked.copy() if blocking else self._blocked
        for item in blocking:
            blocked[self._cells_of(item.box)] = True
        return blocked

    def _all_near(self, blocked: Bool, cells: Sequence[tuple[slice, slice]]) -> bool:
        """Whether almost all floor stays reachable and every model, by its cells, approachable."""
        roomy = clearance_m(blocked, CELL_SIZE_M) >= ROBOT_CLEARANCE_M
        reachable = connected_part(roomy, self._goals[0])
        if not reachable[self._goals[:, 0], self._goals[:, 1]].all():
            return False
        if (roomy & ~reachable).sum() * CELL_SIZE_M**2 > MAX_CUT_OFF_M2:
            return False
        away = distance_m(reachable, CELL_SIZE_M, exact=False)
        return all(away[each].min() <= MAX_APPROACH_M for each in cells)

    def _cells_of(self, box: F64) -> tuple[slice, slice]:
        low = np.maximum(self.grid.cells(box[0] + TOUCH_M), 0)
        high = np.maximum(self.grid.cells(box[1] - TOUCH_M), low)
        return slice(int(low[0]), int(high[0]) + 1), slice(int(low[1]), int(high[1]) + 1)

    def _walls(self) -> Bool:
        blocked = np.ones(self.grid.shape, dtype=bool)
        doors = [_around(door, HALF_WALL_M + CELL_SIZE_M, 0.0) for door in self.plan.doors]
        rects = [np.reshape(space.inner, (2, 2)) for space in self.plan.spaces]
        for lower, upper in (*rects, *(door[:, :2] for door in doors)):
            # Only the cells that lie wholly within the rectangle are free.
            low, high = self.grid.cells(lower + CELL_SIZE_M * 0.999), self.grid.cells(upper)
            blocked[low[0] : high[0], low[1] : high[1]] = False
        return blocked


def _around(opening: Opening, reach: float, bottom: float) -> F64:
    """The box (2, 3) in front of and behind an opening, from ``bottom`` to its top."""
    x, y = opening.centre
    half = (opening.width / 2, reach) if opening.axis == 0 else (reach, opening.width / 2)
    lower = (x - half[0], y - half[1], bottom)
    return np.array([lower, (x + half[0], y + half[1], opening.top)])


def _gate_points(plan: FloorPlan) -> list[tuple[float, float]]:
    """Points just inside both rooms of every door: all must stay reachable from the first."""
    points = []
    for door in plan.doors:
        x, y = door.centre
        for off in (-(HALF_WALL_M + 0.5), HALF_WALL_M + 0.5):
            points.append((x, y + off) if door.axis == 0 else (x + off, y))
    return points


@dataclass(frozen=True, slots=True)
class Placer:
    """Places models in one room of a layout; each method tries until a place is free, else None."""

    layout: RoomLayout
    draw: Sampler
    space: int

    @property
    def inner(self) -> Rect:
        """The room's rectangle between its walls, metres."""
        return self.layout.plan.spaces[self.space].inner

    def _drawn(self, candidates: Iterable[Candidate]) -> Iterator[Model]:
        """Each candidate with its probability; placing one draws, too, before the next."""
        for probability, make in candidates:
            if self.draw.chance(probability):
                yield make(self.draw)

    def along_walls(self, *candidates: Candidate) -> list[PlacedModel]:
        """Each candidate, with its probability, against a wall; returns those that fit."""
        placed = [self.against_wall(model) for model in self._drawn(candidates)]
        return [item for item in placed if item is not None]

    def on_tops(self, supports: Sequence[PlacedModel], *candidates: Candidate) -> None:
        """Each candidate, with its probability, on a random support with free space."""
        for model in self._drawn(candidates if supports else ()):
            self.on_any(supports, model)

    def on_any(self, supports: Sequence[PlacedModel], model: Model) -> bool:
        """On the first of the supports, in random order, that has free space."""
        order = self.draw.rng.permutation(len(supports))
        return any(self.on_top(model, supports[index]) is not None for index in order)

    def on_walls(self, *candidates: Candidate) -> None:
        """Each candidate, with its probability, on a wall at about eye height."""
        for model in self._drawn(candidates):
            self.hanging(model)

    def hanging(self, model: Model) -> PlacedModel | None:
        """On a wall, its middle at about eye height."""
        centre = self.draw.uniform(1.25, 1.5)
        return self.against_wall(model, z=max(centre - float(model.upper[2]) / 2, 0.7))

    def against_wall(self, model: Model, *, z: float = 0.0) -> PlacedModel | None:
        """With its back to a wall, at a random position; at height ``z`` if it hangs."""
        return self._at_wall(model, np.linspace(0.0, 1.0, SHARES), z)

    def in_corner(self, model: Model) -> PlacedModel | None:
        """With its back to one wall and a side to the next."""
        return self._at_wall(model, (0.0, 1.0), 0.0)

    def in_row(self, models: list[Model]) -> list[PlacedModel] | None:
        """Side by side with their backs to one wall, all or none."""
        places = [(side, share) for side in SIDES for share in (0.0, 0.25, 0.5, 0.75, 1.0)]
        return self._first(places, lambda side, share: self._row(models, side, share))

    def _at_wall(self, model: Model, shares: Iterable[float], z: float) -> PlacedModel | None:
        places = [(side, share) for side in SIDES for share in shares]
        row = self._first(places, lambda side, share: self._alone(model, side, share, z))
        return row[0] if row else None

    def _first(
        self, places: list[tuple[str, float]], placed_at: Callable[[str, float], list[PlacedModel]]
    ) -> list[PlacedModel] | None:
        """What fits at the first of the places, in random order, at which something does."""
        for index in self.draw.rng.permutation(len(places)):
            row = placed_at(*places[index])
            if row and self.layout.add(row):
                return row
        return None

    def _alone(self, model: Model, side: str, share: float, z: float) -> list[PlacedModel]:
        """The model at a share 0 to 1 of the way along a wall; empty if the wall is too short."""
        low, high = self._limits(_box(model, YAW_DEG[side]))
        if (high < low).any():
            return []
        along = 0 if side in ("south", "north") else 1
        at = low if side in ("west", "south") else high
        at[along] = (low + share * (high - low))[along]
        return [place(model, (float(at[0]), float(at[1]), z), YAW_DEG[side], self.space)]

    def _row(self, models: list[Model], side: str, share: float) -> list[PlacedModel]:
        """The row at a share 0 to 1 of the slack along a wall; empty if the wall is too short."""
        along = 0 if side in ("south", "north") else 1
        boxes = [_box(model, YAW_DEG[side]) for model in models]
        widths = [float(box[1, along] - box[0, along]) for box in boxes]
        start, end = self.inner[along], self.inner[along + 2]
        slack = end - start - 2 * WALL_GAP_M - sum(widths)
        if slack < 0:
            return []
        row, reached = [], start + WALL_GAP_M + share * slack
        for model, box, width in zip(models, boxes, widths, strict=True):
            at = self._limits(box)[0 if side in ("west", "south") else 1]
            at[along] = reached - box[0, along]
            reached += width
            row.append(place(model, (float(at[0]), float(at[1]), 0.0), YAW_DEG[side], self.space))
        return row

    def _limits(self, box: F64) -> tuple[F64, F64]:
        """Least and largest x, y (2,) in the room of a model with this box about its origin."""
        x0, y0, x1, y1 = self.inner
        low = np.array([x0, y0]) + WALL_GAP_M - box[0, :2]
        return low, np.array([x1, y1]) - WALL_GAP_M - box[1, :2]

    def in_middle(
        self, model: Model, around: list[tuple[Model, F64, float]]
    ) -> list[PlacedModel] | None:
        """Near the room's centre, with companions (model, local offset (3,), degrees)."""
        x0, y0, x1, y1 = self.inner
        for _ in range(TRIES):
            yaw_deg = self.draw.choice([0.0, 90.0])
            x = (x0 + x1) / 2 + self.draw.uniform(-0.2, 0.2) * (x1 - x0)
            y = (y0 + y1) / 2 + self.draw.uniform(-0.2, 0.2) * (y1 - y0)
            main = place(model, (x, y, 0.0), yaw_deg, self.space)
            group = [main, *(_relative(main, *companion) for companion in around)]
            if self.layout.add(group):
                return group
        return None

    def on_floor(self, *candidates: Candidate) -> None:
        """Each candidate, with its probability, anywhere on the floor, at any rotation."""
        x0, y0, x1, y1 = self.inner
        for model in self._drawn(candidates):
            for _ in range(TRIES):
                at = (self.draw.uniform(x0, x1), self.draw.uniform(y0, y1), 0.0)
                if self.layout.add([place(model, at, self.draw.uniform(0, 360), self.space)]):
                    break

    def on_top(
        self, model: Model, support: PlacedModel, *, yaw_deg: float | None = None
    ) -> PlacedModel | None:
        """On a top of the support, facing as it does, with some jitter of the rotation."""
        if not support.model.tops:
            return None
        wide = float(np.ptp(_box(model, 0.0)[:, 0]))
        jitter_deg = 25.0 if wide < WIDE_M else 4.0  # microwaves stand straight, cups do not
        for _ in range(TRIES):
            top = self.draw.choice(support.model.tops)
            turn_deg = self.draw.uniform(-jitter_deg, jitter_deg) if yaw_deg is None else yaw_deg
            box = _box(model, turn_deg)
            low = np.array([top.x_min, top.y_min]) - box[0, :2]
            high = np.array([top.x_max, top.y_max]) - box[1, :2]
            if (high < low).any():
                continue
            x, y = low + self.draw.rng.random(2) * (high - low)
            item = self.near(support, model, np.array([x, y, top.z]), turn_deg)
            if item is not None:
                return item
        return None

    def near(
        self, support: PlacedModel, model: Model, offset: F64, yaw_deg: float
    ) -> PlacedModel | None:
        """At an offset (3,) in the support's local frame, allowed to overlap it."""
        item = _relative(support, model, offset, yaw_deg)
        return item if self.layout.add([item], ignoring=[support.box]) else None
