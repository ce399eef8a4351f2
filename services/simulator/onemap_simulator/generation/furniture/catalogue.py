"""Every category that stands, hangs or lies in an apartment, as functions that draw one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from onemap_simulator.generation.furniture import (
    appliances,
    bathroom,
    containers,
    electronics,
    fittings,
    kitchen,
    plants,
    playthings,
    seating,
    sleep,
    storage,
    tables,
    tableware,
    wall_decor,
)
from onemap_simulator.generation.model import Material, Model
from onemap_simulator.generation.sampler import Pick

Maker = Callable[[Pick], Model]


def kitchen_look(pick: Pick) -> tuple[Material, Material, Material]:
    """Body, worktop and handles that all cabinets of one kitchen share."""
    worktop = pick.wood() if pick.chance(0.5) else pick.of("marble", 0.8, pick.colour())
    return (pick.wood(), worktop, pick.metal())


def _kitchen_cabinet(pick: Pick) -> Model:
    make = pick.one([kitchen.kitchen_cabinet, kitchen.wall_cabinet])
    return make(pick, pick.size(0.5, 0.9), kitchen_look(pick))


def _sink(pick: Pick) -> Model:
    if pick.chance(0.5):
        return bathroom.bathroom_sink(pick)
    return kitchen.kitchen_sink(pick, pick.size(0.6, 0.8), kitchen_look(pick))


def _door(pick: Pick) -> Model:
    return fittings.door(pick, pick.size(0.95, 1.1), ("left", 0.0))


# By category; a category with several makers is made by any of them.
MAKERS: Mapping[str, tuple[Maker, ...]] = {
    "door": (_door,),
    "window": (lambda pick: fittings.window(pick, pick.size(1.0, 1.7), pick.size(1.0, 1.3)),),
    "curtain": (lambda pick: fittings.curtain(pick, pick.size(0.35, 0.6), 2.0),),
    "rug": (lambda pick: fittings.rug(pick, pick.size(1.2, 2.2), pick.size(0.8, 1.4)),),
    "sofa": (seating.sofa,),
    "armchair": (seating.armchair,),
    "chair": (seating.chair,),
    "stool": (seating.stool,),
    "bench": (seating.bench,),
    "table": (tables.table,),
    "coffee table": (tables.coffee_table,),
    "desk": (tables.desk,),
    "bookcase": (storage.bookcase,),
    "wardrobe": (storage.wardrobe,),
    "dresser": (storage.dresser,),
    "nightstand": (storage.nightstand,),
    "kitchen cabinet": (_kitchen_cabinet,),
    "shelf": (storage.shelf,),
    "bed": (sleep.bed,),
    "pillow": (sleep.pillow,),
    "refrigerator": (appliances.refrigerator,),
    "oven": (appliances.oven,),
    "sink": (_sink,),
    "microwave": (appliances.microwave,),
    "kettle": (appliances.kettle,),
    "toaster": (appliances.toaster,),
    "dishwasher": (lambda pick: appliances.dishwasher(pick, kitchen_look(pick)[1]),),
    "toilet": (bathroom.toilet,),
    "bathtub": (bathroom.bathtub,),
    "shower": (bathroom.shower,),
    "washing machine": (bathroom.washing_machine,),
    "towel": (bathroom.towel,),
    "mirror": (wall_decor.mirror,),
    "television": (
        partial(electronics.television, hanging=False),
        partial(electronics.television, hanging=True),
    ),
    "laptop": (electronics.laptop,),
    "lamp": (electronics.table_lamp, electronics.floor_lamp),
    "radiator": (electronics.radiator,),
    "fan": (electronics.standing_fan, electronics.table_fan),
    "potted plant": (plants.floor_plant, plants.small_plant),
    "vase": (plants.vase,),
    "bottle": (tableware.bottle,),
    "cup": (tableware.cup,),
    "bowl": (tableware.bowl,),
    "book": (tableware.book,),
    "clock": (wall_decor.clock,),
    "picture": (wall_decor.picture,),
    "box": (containers.cardboard_box,),
    "basket": (containers.basket,),
    "trash can": (containers.trash_can,),
    "suitcase": (containers.suitcase,),
    "bicycle": (playthings.bicycle,),
    "guitar": (playthings.guitar,),
    "teddy bear": (playthings.teddy_bear,),
    "ball": (playthings.ball,),
}
