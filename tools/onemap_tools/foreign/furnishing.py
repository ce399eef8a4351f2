"""Puts pieces into the slots of a floor plan and makes the scene of an apartment."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.scene.scene import Room
from onemap_tools.foreign.apartment_plan import ApartmentPlan, PlannedRoom, Slot
from onemap_tools.foreign.building import building, side_frame
from onemap_tools.foreign.finish import FinishedPart
from onemap_tools.foreign.finish_picker import FinishPicker
from onemap_tools.foreign.lit_scene import AreaLight, LitScene, PlacedObject, lit_scene
from onemap_tools.foreign.shapes.catalogue import ForeignPiece, build_piece

GAP_M = 0.02  # between a piece and the wall behind it
AMBIENT = (0.34, 0.33, 0.32)
LAMP_COLOUR = (1.3, 1.0, 0.62)
BULB_M = 0.08  # half the size of a lamp's light


@dataclass(frozen=True, slots=True)
class PlacedPiece:
    """A piece in the map: its shape, middle x, y, lower z in metres, yaw; and its own axes."""

    slot: Slot
    room: str
    shape: int
    piece: ForeignPiece
    x: float
    y: float
    z: float
    yaw: float

    @property
    def parts(self) -> tuple[FinishedPart, ...]:
        """The parts in map coordinates; the piece turns about the middle of its rectangle."""
        lower, upper = self.piece.bounds
        middle = (lower + upper) / 2
        return tuple(
            FinishedPart(
                part.mesh.at(-float(middle[0]), -float(middle[1]))
                .turned(self.yaw)
                .at(self.x, self.y, self.z),
                part.uv,
                part.finish,
            )
            for part in self.piece.parts
        )

    @property
    def bounds(self) -> tuple[F64, F64]:
        """Lower and upper corner (3,) in the map, metres."""
        points = np.concatenate([part.mesh.vertices for part in self.parts])
        return points.min(axis=0), points.max(axis=0)


class ShapeRota:
    """Gives every slot the allowed shape that was used least, so that all shapes are shown."""

    def __init__(self) -> None:
        self._used: Counter[tuple[str, int]] = Counter()

    def take(self, slot: Slot) -> int:
        """The shape for a slot, the lowest of the least used."""
        shape = min(slot.shapes, key=lambda index: (self._used[slot.category, index], index))
        self._used[slot.category, shape] += 1
        return shape


def furnish(plan: ApartmentPlan, rota: ShapeRota, seed: tuple[int, ...]) -> list[PlacedPiece]:
    """A piece for every slot; colours and sizes by the seed."""
    placed: list[PlacedPiece] = []
    for room in plan.rooms:
        here: list[PlacedPiece] = []
        for number, slot in enumerate(room.slots):
            rng = np.random.default_rng([*seed, len(placed), number])
            shape = rota.take(slot)
            piece = build_piece(slot.category, shape, FinishPicker(rng, plan.palette))
            here.append(_place(slot, room, shape, piece, here))
        placed += here
    return placed


def apartment(plan: ApartmentPlan, rota: ShapeRota, seed: tuple[int, ...]) -> LitScene:
    """The furnished apartment as a scene, lamps and windows shining."""
    look = FinishPicker(np.random.default_rng([*seed, 999_983]), plan.palette)
    objects, lights = building(plan, look)
    pieces = furnish(plan, rota, seed)
    objects += [PlacedObject(p.slot.category, p.room, p.parts) for p in pieces]
    rooms = tuple(Room(room.kind, room.bounds_m) for room in plan.rooms)
    return lit_scene(
        plan.name,
        objects,
        [*lights, *_lamp_lights(pieces)],
        ambient=AMBIENT,
        rooms=rooms,
        start=plan.start,
    )


def _place(
    slot: Slot, room: PlannedRoom, shape: int, piece: ForeignPiece, before: list[PlacedPiece]
) -> PlacedPiece:
    lower, upper = piece.bounds
    depth = float(upper[1] - lower[1])
    if slot.on:
        carrier = next(p for p in reversed(before) if p.slot.category == slot.on)
        x, y, z = _on_top(carrier, slot)
        return PlacedPiece(
            slot, room.kind, shape, piece, x, y, z, carrier.yaw + np.radians(slot.turn_deg)
        )
    if slot.side is None:
        x0, y0, _, _ = room.bounds_m
        yaw = float(np.radians(slot.turn_deg))
        return PlacedPiece(slot, room.kind, shape, piece, x0 + slot.at, y0 + slot.across, 0.0, yaw)
    start, along, normal, _ = side_frame(room, slot.side)
    gap = 0.002 if slot.height_m else GAP_M
    middle = start + along * slot.at + normal * (depth / 2 + gap)
    yaw = float(np.arctan2(normal[1], normal[0]) + np.pi / 2)
    x, y = (float(v) for v in middle)
    hangs_m = float(upper[2] - lower[2]) if slot.category == "curtain" else 0.0
    return PlacedPiece(slot, room.kind, shape, piece, x, y, slot.height_m - hangs_m, yaw)


def _on_top(carrier: PlacedPiece, slot: Slot) -> tuple[float, float, float]:
    """Where the slot lies on the carrier: map x, y, and the height of its surface there."""
    lower, upper = carrier.piece.bounds
    middle = (lower + upper) / 2
    local = middle[:2] + (slot.at, slot.across)
    z = surface_height(carrier.piece, float(local[0]), float(local[1]))
    c, s = np.cos(carrier.yaw), np.sin(carrier.yaw)
    x = carrier.x + c * slot.at - s * slot.across
    y = carrier.y + s * slot.at + c * slot.across
    return float(x), float(y), carrier.z + z


def surface_height(piece: ForeignPiece, x: float, y: float) -> float:
    """Height in metres of the highest surface of a piece above (x, y), 0 beside it."""
    best = 0.0
    for part in piece.parts:
        corners = part.mesh.vertices[part.mesh.faces]
        a, b, c = (corners[:, k, :2] for k in range(3))
        ab, ac, ap = b - a, c - a, np.array([x, y]) - a
        area = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
        safe = np.where(np.abs(area) < 1e-12, 1.0, area)
        v = (ap[:, 0] * ac[:, 1] - ap[:, 1] * ac[:, 0]) / safe
        w = (ab[:, 0] * ap[:, 1] - ab[:, 1] * ap[:, 0]) / safe
        inside = (np.abs(area) >= 1e-12) & (v >= 0) & (w >= 0) & (v + w <= 1)
        z = corners[:, 0, 2] + v * (corners[:, 1, 2] - corners[:, 0, 2])
        z = z + w * (corners[:, 2, 2] - corners[:, 0, 2])
        best = max(best, float(z[inside].max(initial=0.0)))
    return best


def _lamp_lights(pieces: list[PlacedPiece]) -> Iterator[AreaLight]:
    """A light in the shade of every lamp."""
    for placed in pieces:
        if placed.slot.category != "lamp":
            continue
        shades = [part for part in placed.parts if part.finish.glow > 0]
        points = np.concatenate([part.mesh.vertices for part in shades])
        x, y, z = (float(v) for v in (points.min(axis=0) + points.max(axis=0)) / 2)
        yield AreaLight((x, y, z), (BULB_M, BULB_M, BULB_M), LAMP_COLOUR)
