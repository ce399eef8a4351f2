"""Where a thing goes: against a wall, in a corner, on something, around something."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.floor_plan import SIDES, Rect
from onemap_simulator.generation.mesh import rotation
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.room_layout import Placed, Site, place
from onemap_simulator.generation.sampler import Pick

# Degrees that turn a model's back (+y) to each side of a room.
TURN = {"north": 0.0, "west": 90.0, "south": 180.0, "east": 270.0}
WALL_GAP_M = 0.02
TRIES = 14
WIDE_M = 0.3
SHARES = 9  # places tried along one wall


@dataclass(frozen=True, slots=True)
class Arranger:
    """Tries places in one room of a site until one is free."""

    site: Site
    pick: Pick
    space: int

    @property
    def inner(self) -> Rect:
        """The room's rectangle between its walls, metres."""
        return self.site.plan.spaces[self.space].inner

    def against_wall(
        self, model: Model, *, z: float = 0.0, sides: tuple[str, ...] = SIDES
    ) -> Placed | None:
        """Its back to a wall, at a random position; at height ``z`` if it hangs."""
        places = [(side, share) for side in sides for share in np.linspace(0.0, 1.0, SHARES)]
        for index in self.pick.rng.permutation(len(places)):
            side, share = places[index]
            thing = self.at_wall(model, side, float(share), z)
            if thing is not None and self.site.add([thing]):
                return thing
        return None

    def in_corner(self, model: Model) -> Placed | None:
        """Its back to a wall and one side to the next."""
        corners = [(side, share) for side in SIDES for share in (0.0, 1.0)]
        for index in self.pick.rng.permutation(len(corners)):
            side, share = corners[index]
            thing = self.at_wall(model, side, share, 0.0)
            if thing is not None and self.site.add([thing]):
                return thing
        return None

    def at_wall(self, model: Model, side: str, share: float, z: float) -> Placed | None:
        """The model at a share 0 to 1 of the way along a wall, or None if the wall is too short."""
        turn = TURN[side]
        box = turned_box(model, turn)
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
        return place(model, (float(at[0]), float(at[1]), z), turn, self.space)

    def in_row(self, models: list[Model]) -> list[Placed] | None:
        """Side by side with their backs to one wall, all or none."""
        places = [(side, share) for side in SIDES for share in (0.0, 0.25, 0.5, 0.75, 1.0)]
        for index in self.pick.rng.permutation(len(places)):
            row = self._row(models, *places[index])
            if row and self.site.add(row):
                return row
        return None

    def _row(self, models: list[Model], side: str, share: float) -> list[Placed]:
        """The row at a share 0 to 1 of the slack along a wall; empty if the wall is too short."""
        x0, y0, x1, y1 = self.inner
        along = 0 if side in ("south", "north") else 1
        boxes = [turned_box(model, TURN[side]) for model in models]
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
            row.append(place(model, (float(x), float(y), 0.0), TURN[side], self.space))
        return row

    def in_middle(
        self, model: Model, around: list[tuple[Model, F64, float]]
    ) -> list[Placed] | None:
        """Near the room's centre, with companions at local offsets (3,) and turns."""
        x0, y0, x1, y1 = self.inner
        for _ in range(TRIES):
            turn = self.pick.one([0.0, 90.0])
            x = (x0 + x1) / 2 + self.pick.between(-0.2, 0.2) * (x1 - x0)
            y = (y0 + y1) / 2 + self.pick.between(-0.2, 0.2) * (y1 - y0)
            main = place(model, (x, y, 0.0), turn, self.space)
            group = [main, *(beside(main, *companion) for companion in around)]
            if self.site.add(group):
                return group
        return None

    def on_floor(self, model: Model) -> Placed | None:
        """Anywhere on the floor, turned freely."""
        x0, y0, x1, y1 = self.inner
        for _ in range(TRIES):
            at = (self.pick.between(x0, x1), self.pick.between(y0, y1), 0.0)
            thing = place(model, at, self.pick.between(0, 360), self.space)
            if self.site.add([thing]):
                return thing
        return None

    def on_top(self, model: Model, support: Placed, *, turn: float | None = None) -> Placed | None:
        """On one of the support's tops, facing as the support does, give or take some degrees."""
        if not support.model.tops:
            return None
        wide = float(np.ptp(turned_box(model, 0.0)[:, 0]))
        sway = 25.0 if wide < WIDE_M else 4.0  # a microwave stands straight, a cup does not
        for _ in range(TRIES):
            top = self.pick.one(support.model.tops)
            swing = self.pick.between(-sway, sway) if turn is None else turn
            box = turned_box(model, swing)
            low = np.array([top.x_min, top.y_min]) - box[0, :2]
            high = np.array([top.x_max, top.y_max]) - box[1, :2]
            if (high < low).any():
                continue
            x, y = low + self.pick.rng.random(2) * (high - low)
            thing = beside(support, model, np.array([x, y, top.z]), swing)
            if self.site.add([thing], ignoring=[support.box]):
                return thing
        return None

    def near(self, support: Placed, model: Model, offset: F64, turn: float) -> Placed | None:
        """At an offset (3,) in the support's local frame, allowed to overlap it."""
        thing = beside(support, model, offset, turn)
        return thing if self.site.add([thing], ignoring=[support.box]) else None


def beside(support: Placed, model: Model, offset: F64, turn: float) -> Placed:
    """The model at an offset (3,) and turn in the local frame of what is already placed."""
    x, y, z = rotation("z", support.turn) @ offset + support.at
    return place(model, (float(x), float(y), float(z)), support.turn + turn, support.space)


def turned_box(model: Model, turn: float) -> F64:
    """The model's box (2, 3) after turning by degrees about its origin."""
    return place(model, (0.0, 0.0, 0.0), turn, 0).box
