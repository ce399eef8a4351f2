"""One object of several of its class, named by what only it has: a neighbour, a room, a colour.

The truth is the scene's geometry. Outlines are the objects' boxes, seen from above; a neighbour is
one within ``NEXT_TO_M`` in the same room, and every other instance is clearly no neighbour.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from math import inf

import numpy as np

from onemap_shared.geometry import F32, F64
from onemap_shared.messages import Detail, Place, Relation, RelationKind
from onemap_shared.messages.details import NEXT_TO_M
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.ground_truth.truth import horizontal_distances
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.scene.scene import Room, Scene
from onemap_tools.bench.options import GoalsName
from onemap_tools.judgement import ObjectSummary

CLEARLY_NOT_M = 1.5  # of every other instance from every such anchor, walls or none
APART_M = 1.0  # between the one that is meant and the others: no two that touch
ON_M = 0.05  # the base of what stands on another thing, at most above that thing's highest point
RAISED_M = 0.2  # the base of what stands on another thing, at least above that thing's base
# Things of any colour in homes, and paints that nobody takes for one another; RGB.
PAINTED = frozenset({"armchair", "bed", "bench", "chair", "dresser", "sofa", "stool", "wardrobe"})
PAINTS = {
    "red": (180, 30, 30),
    "yellow": (220, 190, 30),
    "green": (40, 140, 60),
    "blue": (40, 70, 180),
    "purple": (120, 50, 150),
    "white": (235, 235, 230),
}


@dataclass(frozen=True, slots=True)
class DescribedObject:
    """The object of index ``meant`` in the scene: the only ``noun`` of which ``detail`` holds.

    phrase: both in words; places: what the detail names.
    """

    noun: str
    phrase: str
    detail: Detail
    meant: int
    places: tuple[Place, ...] = ()

    def marked(self, scene: Scene) -> Scene:
        """The scene for the ground truth: the meant object's category is the phrase."""
        objects = list(scene.objects)
        objects[self.meant] = replace(objects[self.meant], category=self.phrase)
        return replace(scene, objects=tuple(objects))

    def is_meant(self, scene: Scene, place: tuple[float, ...]) -> bool:
        """Whether the meant one is the nearest of its class to a place (x, y, ...), metres."""
        return self.nearest(scene, place) == self.meant

    def nearest(self, scene: Scene, place: tuple[float, ...]) -> int:
        """The object of the class that is nearest to a place (x, y, ...), metres."""
        triangles = scene.vertices[scene.faces].astype(np.float64)
        away_m = {
            index: horizontal_distances(
                triangles[scene.face_object == index], np.array(place[:2])
            ).min()
            for index, thing in enumerate(scene.objects)
            if thing.category == self.noun
        }
        return min(away_m, key=away_m.__getitem__)

    def judged(self, scene: Scene, summary: ObjectSummary) -> ObjectSummary:
        """A claim of another one is wrong, however near to the right one the robot stopped."""
        if not summary.claimed or self.is_meant(scene, summary.position_m):
            return summary
        return replace(summary, goal_distance_m=inf)


def _box(scene: Scene, index: int) -> F32:
    """Box (2, 3) around an object: the least and the largest x, y, z."""
    points = scene.vertices[scene.faces[scene.face_object == index]].reshape(-1, 3)
    return np.stack([points.min(axis=0), points.max(axis=0)])


def described_objects(
    scene: Scene, simulator: SimulatorConfig, goals: GoalsName, nouns: frozenset[str]
) -> list[DescribedObject]:
    """All objects that one property tells from at least one other of their class."""
    finders = {"relations": _related, "rooms": _in_rooms, "colours": _coloured}
    return list(finders[goals](_Things(scene, nouns), scene, simulator))


def painted(scene: Scene, seed: int) -> Scene:
    """The scene with each instance of the classes of ``PAINTED`` in another colour, by the seed."""
    things = _Things(scene, PAINTED)
    face_texture, textures = scene.face_texture.copy(), list(scene.textures)
    for noun, _ in things.several():
        for index, colour in _colours(things, noun, seed):
            face_texture[scene.face_object == index] = len(textures)
            textures.append(np.full((2, 2, 3), PAINTS[colour], np.uint8))
    return replace(scene, face_texture=face_texture, textures=tuple(textures))


def draw_order(found: list[DescribedObject], rng: np.random.Generator) -> list[DescribedObject]:
    """In random order: first the kind of relation, then the class, then the description."""
    ranks: dict[object, float] = {}

    def rank(each: DescribedObject) -> tuple[float, ...]:
        keys = (tuple(relation.kind for relation in each.detail.relations), each.noun, each.phrase)
        return tuple(ranks.setdefault(key, float(rng.random())) for key in keys)

    return sorted(found, key=rank)


class _Things:
    """Boxes (2, 3) and rooms of the objects of some classes."""

    def __init__(self, scene: Scene, nouns: frozenset[str]) -> None:
        self.boxes: dict[int, F64] = {}
        self.rooms: dict[int, int] = {}
        self.of_class: dict[str, list[int]] = {}
        for index, thing in enumerate(scene.objects):
            if thing.category in nouns:
                self.boxes[index] = box = _box(scene, index).astype(np.float64)
                self.rooms[index] = _room_at(scene.rooms, box[:, :2].mean(axis=0))
                self.of_class.setdefault(thing.category, []).append(index)

    def several(self) -> Iterator[tuple[str, list[int]]]:
        """Classes of at least two instances."""
        return ((name, found) for name, found in self.of_class.items() if len(found) > 1)

    def gap_m(self, one: int, other: int) -> float:
        """Between two boxes, seen from above; 0 where they overlap."""
        (low, high), (least, most) = self.boxes[one][:, :2], self.boxes[other][:, :2]
        return float(np.linalg.norm(np.maximum(np.maximum(low - most, least - high), 0.0)))

    def alone(self, meant: list[int], instances: list[int]) -> bool:
        """Whether exactly one is meant, and no other instance is close to it."""
        return len(meant) == 1 and all(
            self.gap_m(meant[0], other) >= APART_M for other in instances if other != meant[0]
        )

    def is_on(self, one: int, other: int) -> bool:
        """Whether the middle of one stands within the outline of the other and above its base."""
        middle, base = self.boxes[one][:, :2].mean(axis=0), self.boxes[one][0, 2]
        low, high = self.boxes[other]
        inside = (low[:2] < middle).all() and (middle < high[:2]).all()
        return bool(inside and low[2] + RAISED_M < base <= high[2] + ON_M)

    def is_next_to(self, one: int, other: int) -> bool:
        """Whether one is a neighbour of the other, in the same room."""
        return self.rooms[one] == self.rooms[other] and self.gap_m(one, other) <= NEXT_TO_M


def _room_at(rooms: tuple[Room, ...], place: F64) -> int:
    """Index of the room that holds a place (2,), -1 without one."""
    bounds = [np.reshape(room.bounds_m, (2, 2)) for room in rooms]
    held = (k for k, (low, high) in enumerate(bounds) if ((low <= place) & (place <= high)).all())
    return next(held, -1)


def _related(things: _Things, _: Scene, __: SimulatorConfig) -> Iterator[DescribedObject]:
    for (noun, instances), (anchor, anchors) in product(things.several(), things.of_class.items()):
        if anchor == noun:
            continue
        pairs = list(product(instances, anchors))
        holds = {
            RelationKind.ON: [one for one, other in pairs if things.is_on(one, other)],
            RelationKind.UNDER: [one for one, other in pairs if things.is_on(other, one)],
            RelationKind.NEXT_TO: [one for one, other in pairs if things.is_next_to(one, other)],
        }
        if holds[RelationKind.ON] or holds[RelationKind.UNDER]:
            del holds[RelationKind.NEXT_TO]  # nobody says so of what stands on it
        for kind, found in holds.items():
            meant = sorted(set(found))
            clear = kind is not RelationKind.NEXT_TO or all(
                things.gap_m(one, other) > CLEARLY_NOT_M for one, other in pairs if one not in meant
            )
            if things.alone(meant, instances) and clear:
                phrase = f"{noun} {kind.words} the {anchor}"
                detail = Detail(relations=(Relation(kind, (anchor,)),))
                yield DescribedObject(noun, phrase, detail, meant[0])


def _colours(things: _Things, noun: str, seed: int) -> Iterator[tuple[int, str]]:
    """Each instance of a class and its colour; the last ones keep theirs if there are too many."""
    rng = np.random.default_rng((seed, *noun.encode()))
    return zip(things.of_class[noun], rng.permutation(list(PAINTS)).tolist(), strict=False)


def _coloured(things: _Things, _: Scene, simulator: SimulatorConfig) -> Iterator[DescribedObject]:
    for noun, instances in things.several():
        if noun in PAINTED and len(instances) <= len(PAINTS):
            for index, colour in _colours(things, noun, simulator.seed):
                if things.alone([index], instances):
                    yield DescribedObject(noun, f"{colour} {noun}", Detail(colour), index)


def _in_rooms(
    things: _Things, scene: Scene, simulator: SimulatorConfig
) -> Iterator[DescribedObject]:
    kinds = Counter(room.kind for room in scene.rooms)
    collision = CollisionMap.of(scene, simulator.robot.height_m)
    centres = collision.grid.centres(np.argwhere(np.ones(collision.grid.shape, bool)))
    for index, room in enumerate(scene.rooms):
        if kinds[room.kind] > 1:
            continue
        low, high = np.reshape(room.bounds_m, (2, 2))
        inside = ((centres > low) & (centres < high)).all(axis=1)
        x, y = centres[int(np.where(inside, collision.clearance.ravel(), -1.0).argmax())].tolist()
        for noun, instances in things.several():
            meant = [one for one in instances if things.rooms[one] == index]
            if things.alone(meant, instances):
                detail = Detail(inside=(room.kind,))
                place = Place(room.kind, inside_m=(x, y))
                phrase = f"{noun} in the {room.kind}"
                yield DescribedObject(noun, phrase, detail, meant[0], (place,))
