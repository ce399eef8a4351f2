"""Random placement of models: against a wall, in a corner, on furniture, around a centre."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.floor_plan import SIDES, Rect
from onemap_simulator.generation.mesh import rotation
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.room_layout import PlacedModel, RoomLayout, place
from onemap_simulator.generation.sampler import Sampler

# Rotation in degrees that puts a model's back (+y) to each side of a room.
YAW_DEG = {"north": 0.0, "west": 90.0, "south": 180.0, "east": 270.0}
WALL_GAP_M = 0.02
TRIES = 14
WIDE_M = 0.3
SHARES = 9  # places tried along one wall


@dataclass(frozen=True, slots=True)
class Placer:
    """Places models in one room of a layout; each method tries until a place is free, else None."""

    layout: RoomLayout
    sampler: Sampler
    space: int

    @property
    def inner(self) -> Rect:
        """The room's rectangle between its walls, metres."""
        return self.layout.plan.spaces[self.space].inner

    def against_wall(
        self, model: Model, *, z: float = 0.0, sides: tuple[str, ...] = SIDES
    ) -> PlacedModel | None:
        """With its back to a wall, at a random position; at height ``z`` if it hangs."""
        places = [(side, share) for side in sides for share in np.linspace(0.0, 1.0, SHARES)]
        for index in self.sampler.rng.permutation(len(places)):
            side, share = places[index]
            item = self.at_wall(model, side, float(share), z)
            if item is not None and self.layout.add([item]):
                return item
        return None

    def in_corner(self, model: Model) -> PlacedModel | None:
        """With its back to one wall and a side to the next."""
        corners = [(side, share) for side in SIDES for share in (0.0, 1.0)]
        for index in self.sampler.rng.permutation(len(corners)):
            side, share = corners[index]
            item = self.at_wall(model, side, share, 0.0)
            if item is not None and self.layout.add([item]):
                return item
        return None

    def at_wall(self, model: Model, side: str, share: float, z: float) -> PlacedModel | None:
        """The model at a share 0 to 1 of the way along a wall, or None if the wall is too short."""
        yaw_deg = YAW_DEG[side]
        box = rotated_box(model, yaw_deg)
        x0, y0, x1, y1 = self.inner
        low = np.array([x0, y0]) + WALL_GAP_M - box[0, :2]
        high = np.array([x1, y1]) - WALL_GAP_M - box[1, :2]
        if (high < low).any():
            return None
        at = low + share * (high - low)
        if side in ("west", "east"):
            at[0] = low[0] if side == "west" else high[0]
        else:
            at[1] = low[1] if side == "south" else high[1]
        return place(model, (float(at[0]), float(at[1]), z), yaw_deg, self.space)

    def in_row(self, models: list[Model]) -> list[PlacedModel] | None:
        """Side by side with their backs to one wall, all or none."""
        places = [(side, share) for side in SIDES for share in (0.0, 0.25, 0.5, 0.75, 1.0)]
        for index in self.sampler.rng.permutation(len(places)):
            row = self._row(models, *places[index])
            if row and self.layout.add(row):
                return row
        return None

    def _row(self, models: list[Model], side: str, share: float) -> list[PlacedModel]:
        """The row at a share 0 to 1 of the slack along a wall; empty if the wall is too short."""
        x0, y0, x1, y1 = self.inner
        along = 0 if side in ("south", "north") else 1
        boxes = [rotated_box(model, YAW_DEG[side]) for model in models]
        widths = [float(box[1, along] - box[0, along]) for box in boxes]
        start, end = ((x0, x1), (y0, y1))[along]
        slack = end - start - 2 * WALL_GAP_M - sum(widths)
        if slack < 0:
            return []
        row, reached = [], start + WALL_GAP_M + share * slack
        for model, box, width in zip(models, boxes, widths, strict=True):
            offset = reached - box[0, along]
            reached += width
            back = {
                "west": x0 + WALL_GAP_M - box[0, 0],
                "south": y0 + WALL_GAP_M - box[0, 1],
                "east": x1 - WALL_GAP_M - box[1, 0],
                "north": y1 - WALL_GAP_M - box[1, 1],
            }[side]
            x, y = (offset, back) if along == 0 else (back, offset)
            row.append(place(model, (float(x), float(y), 0.0), YAW_DEG[side], self.space))
        return row

    def in_middle(
        self, model: Model, around: list[tuple[Model, F64, float]]
    ) -> list[PlacedModel] | None:
        """Near the room's centre, with companions (model, local offset (3,), degrees)."""
        x0, y0, x1, y1 = self.inner
        for _ in range(TRIES):
            yaw_deg = self.sampler.choice([0.0, 90.0])
            x = (x0 + x1) / 2 + self.sampler.uniform(-0.2, 0.2) * (x1 - x0)
            y = (y0 + y1) / 2 + self.sampler.uniform(-0.2, 0.2) * (y1 - y0)
            main = place(model, (x, y, 0.0), yaw_deg, self.space)
            group = [main, *(place_relative(main, *companion) for companion in around)]
            if self.layout.add(group):
                return group
        return None

    def on_floor(self, model: Model) -> PlacedModel | None:
        """Anywhere on the floor, at any rotation."""
        x0, y0, x1, y1 = self.inner
        for _ in range(TRIES):
            at = (self.sampler.uniform(x0, x1), self.sampler.uniform(y0, y1), 0.0)
            item = place(model, at, self.sampler.uniform(0, 360), self.space)
            if self.layout.add([item]):
                return item
        return None

    def on_top(
        self, model: Model, support: PlacedModel, *, yaw_deg: float | None = None
    ) -> PlacedModel | None:
        """On a support surface, facing as the support does, with some jitter of the rotation."""
        if not support.model.support_surfaces:
            return None
        wide = float(np.ptp(rotated_box(model, 0.0)[:, 0]))
        jitter_deg = 25.0 if wide < WIDE_M else 4.0  # microwaves stand straight, cups do not
        for _ in range(TRIES):
            top = self.sampler.choice(support.model.support_surfaces)
            turn_deg = self.sampler.uniform(-jitter_deg, jitter_deg) if yaw_deg is None else yaw_deg
            box = rotated_box(model, turn_deg)
            low = np.array([top.x_min, top.y_min]) - box[0, :2]
            high = np.array([top.x_max, top.y_max]) - box[1, :2]
            if (high < low).any():
                continue
            x, y = low + self.sampler.rng.random(2) * (high - low)
            item = place_relative(support, model, np.array([x, y, top.z]), turn_deg)
            if self.layout.add([item], ignoring=[support.box]):
                return item
        return None

    def near(
        self, support: PlacedModel, model: Model, offset: F64, yaw_deg: float
    ) -> PlacedModel | None:
        """At an offset (3,) in the support's local frame, allowed to overlap it."""
        item = place_relative(support, model, offset, yaw_deg)
        return item if self.layout.add([item], ignoring=[support.box]) else None


def place_relative(support: PlacedModel, model: Model, offset: F64, yaw_deg: float) -> PlacedModel:
    """The model at an offset (3,) and rotation in the local frame of a placed one."""
    x, y, z = rotation("z", support.yaw_deg) @ offset + support.position_m
    return place(model, (float(x), float(y), float(z)), support.yaw_deg + yaw_deg, support.space)


def rotated_box(model: Model, yaw_deg: float) -> F64:
    """The model's box (2, 3) after rotation about its origin."""
    return place(model, (0.0, 0.0, 0.0), yaw_deg, 0).box
