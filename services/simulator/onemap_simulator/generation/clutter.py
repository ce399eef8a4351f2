"""Small objects on furniture, objects on walls, curtains, and categories still missing."""

from __future__ import annotations

from collections.abc import Sequence

from onemap_simulator.generation.floor_plan import HALF_WALL_M, FloorPlan, Opening
from onemap_simulator.generation.furniture import (
    containers,
    electronics,
    plants,
    playthings,
    seating,
    storage,
    tables,
    tableware,
)
from onemap_simulator.generation.furniture.appliances import (
    kettle,
    microwave,
    refrigerator,
    toaster,
)
from onemap_simulator.generation.furniture.bathroom import towel, washing_machine
from onemap_simulator.generation.furniture.fittings import curtain
from onemap_simulator.generation.furniture.sleep import pillow
from onemap_simulator.generation.furniture.wall_decor import clock, mirror, picture
from onemap_simulator.generation.mesh import rotation
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.placement import Placer
from onemap_simulator.generation.room_layout import PlacedModel, RoomLayout, place
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_simulator.generation.structure import facing_yaw_deg

Candidate = tuple[float, ModelFactory]  # probability, factory


def place_on(
    placer: Placer, supports: Sequence[PlacedModel], candidates: Sequence[Candidate]
) -> None:
    """Place each candidate, with its probability, on a random support with free space."""
    for probability, make in candidates:
        if supports and placer.sampler.chance(probability):
            _place_on_any(placer, supports, make(placer.sampler))


def _place_on_any(placer: Placer, supports: Sequence[PlacedModel], model: Model) -> bool:
    order = placer.sampler.rng.permutation(len(supports))
    return any(placer.on_top(model, supports[index]) is not None for index in order)


def hang_on_walls(placer: Placer, candidates: Sequence[Candidate]) -> None:
    """Hang each candidate, with its probability, on a wall at about eye height."""
    for probability, make in candidates:
        if placer.sampler.chance(probability):
            _hang_on_wall(placer, make(placer.sampler))


def _hang_on_wall(placer: Placer, model: Model) -> bool:
    height = float(model.upper[2])
    centre = placer.sampler.uniform(1.25, 1.5)
    return placer.against_wall(model, z=max(centre - height / 2, 0.7)) is not None


def add_missing(layout: RoomLayout, sampler: Sampler) -> None:
    """Add most of the categories that are missing, in rooms where they are usual."""
    everywhere = tuple({space.kind for space in layout.plan.spaces})
    for category, make, kinds, how in _EXTRAS:
        have = {item.model.category for item in layout.placed}
        if category in have or sampler.chance(0.1):
            continue
        allowed = [i for i, s in enumerate(layout.plan.spaces) if s.kind in (kinds or everywhere)]
        model = make(sampler)
        for index in sampler.rng.permutation(allowed):
            placer = Placer(layout, sampler, int(index))
            here = [
                item
                for item in layout.placed
                if item.space == index and item.model.support_surfaces and _suits(category, item)
            ]
            if how == "top" and _place_on_any(placer, here, model):
                break
            if how == "wall" and _hang_on_wall(placer, model):
                break
            if how == "floor" and placer.against_wall(model) is not None:
                break


def _suits(category: str, support: PlacedModel) -> bool:
    """Whether the category is usual on the support: pillows on soft furniture only, cups not."""
    soft = support.model.category in ("sofa", "armchair", "bed")
    return category == "teddy bear" or soft == (category == "pillow")


_DAY = ("living room", "study", "dining room")
_LIVED_IN = (*_DAY, "bedroom")

# Category, factory, kinds of room (empty: any), and where: floor (at a wall), top or wall.
_EXTRAS: tuple[tuple[str, ModelFactory, tuple[str, ...], str], ...] = (
    ("refrigerator", refrigerator, ("kitchen", "dining room", "hallway"), "floor"),
    ("wardrobe", storage.wardrobe, ("bedroom", "hallway", "study"), "floor"),
    ("sofa", seating.sofa, ("living room", "study", "bedroom"), "floor"),
    ("coffee table", tables.coffee_table, ("living room", "study"), "floor"),
    ("bicycle", playthings.bicycle, ("hallway", *_LIVED_IN), "floor"),
    ("washing machine", washing_machine, ("kitchen", "bathroom", "hallway"), "floor"),
    ("desk", tables.desk, _LIVED_IN, "floor"),
    ("bookcase", storage.bookcase, (*_LIVED_IN, "hallway"), "floor"),
    ("dresser", storage.dresser, (*_LIVED_IN, "hallway"), "floor"),
    ("armchair", seating.armchair, _LIVED_IN, "floor"),
    ("shelf", storage.shelf, (), "floor"),
    ("bench", seating.bench, (*_LIVED_IN, "hallway"), "floor"),
    ("stool", seating.stool, (*_LIVED_IN, "kitchen", "hallway"), "floor"),
    ("chair", seating.chair, (*_LIVED_IN, "kitchen"), "floor"),
    ("nightstand", storage.nightstand, ("bedroom",), "floor"),
    ("radiator", electronics.radiator, (), "floor"),
    ("guitar", playthings.guitar, _LIVED_IN, "floor"),
    ("suitcase", containers.suitcase, ("bedroom", "hallway", "study", "living room"), "floor"),
    ("basket", containers.basket, (), "floor"),
    ("box", containers.cardboard_box, (), "floor"),
    ("trash can", containers.trash_can, (), "floor"),
    ("ball", playthings.ball, _LIVED_IN, "floor"),
    ("lamp", electronics.floor_lamp, _LIVED_IN, "floor"),
    ("fan", electronics.standing_fan, _LIVED_IN, "floor"),
    ("potted plant", plants.floor_plant, (), "floor"),
    ("laptop", electronics.laptop, (*_LIVED_IN, "kitchen"), "top"),
    ("microwave", microwave, ("kitchen", "dining room"), "top"),
    ("kettle", kettle, ("kitchen", "dining room", "living room"), "top"),
    ("toaster", toaster, ("kitchen", "dining room", "living room"), "top"),
    ("teddy bear", playthings.teddy_bear, _LIVED_IN, "top"),
    ("pillow", pillow, ("bedroom", "living room"), "top"),
    ("vase", plants.vase, (), "top"),
    ("bottle", tableware.bottle, (), "top"),
    ("bowl", tableware.bowl, (), "top"),
    ("cup", tableware.cup, (), "top"),
    ("book", tableware.book, (), "top"),
    ("fan", electronics.table_fan, (), "top"),
    ("lamp", electronics.table_lamp, (), "top"),
    ("towel", towel, ("bathroom", "kitchen"), "wall"),
    ("mirror", mirror, (), "wall"),
    ("clock", clock, (), "wall"),
    ("picture", picture, (), "wall"),
    ("television", lambda p: electronics.television(p, hanging=True), _LIVED_IN, "wall"),
)


def hang_curtains(layout: RoomLayout, sampler: Sampler) -> None:
    """Hang a pair of curtains at most windows, to the floor or to just below the sill."""
    plan = layout.plan
    for hole in plan.windows:
        kind = plan.spaces[hole.spaces[0]].kind
        if kind in ("bathroom", "kitchen") or sampler.chance(0.3):
            continue
        long = curtain(sampler, sampler.size(0.3, 0.45), hole.top + 0.06)
        short = curtain(sampler, sampler.size(0.3, 0.45), hole.top - hole.sill + 0.2)
        for model in (long, short) if sampler.chance(0.6) else (short,):
            pair = _beside_window(model, hole, plan)
            hung = [layout.add([item], ignoring=layout.window_boxes) for item in pair]
            if all(hung):
                break


def _beside_window(model: Model, hole: Opening, plan: FloorPlan) -> list[PlacedModel]:
    """The same curtain left and right of a window, its rod above the window."""
    space = hole.spaces[0]
    yaw_deg = facing_yaw_deg(hole, plan, space)
    pair = []
    for side in (-1, 1):
        offset = (side * (hole.width / 2 + float(model.upper[0]) - 0.16), -HALF_WALL_M - 0.14, 0.0)
        x, y, _ = rotation("z", yaw_deg) @ offset
        at = (hole.centre[0] + x, hole.centre[1] + y, hole.top + 0.15 - float(model.upper[2]))
        pair.append(place(model, at, yaw_deg, space))
    return pair
