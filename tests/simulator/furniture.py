"""The factories of every category but walls, floors and ceilings, for tests of all models."""

from __future__ import annotations

from collections.abc import Mapping
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
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler


def _kitchen_cabinet(sampler: Sampler) -> Model:
    make = sampler.choice([kitchen.kitchen_cabinet, kitchen.wall_cabinet])
    return make(sampler, sampler.size(0.5, 0.9), kitchen.kitchen_look(sampler))


def _sink(sampler: Sampler) -> Model:
    if sampler.chance(0.5):
        return bathroom.bathroom_sink(sampler)
    return kitchen.kitchen_sink(sampler, sampler.size(0.6, 0.8), kitchen.kitchen_look(sampler))


def _door(sampler: Sampler) -> Model:
    return fittings.door(sampler, sampler.size(0.95, 1.1), ("left", 0.0))


# By category; of several factories any is chosen.
FACTORIES: Mapping[str, tuple[ModelFactory, ...]] = {
    "door": (_door,),
    "window": (
        lambda sampler: fittings.window(sampler, sampler.size(1.0, 1.7), sampler.size(1.0, 1.3)),
    ),
    "curtain": (lambda sampler: fittings.curtain(sampler, sampler.size(0.35, 0.6), 2.0),),
    "rug": (lambda sampler: fittings.rug(sampler, sampler.size(1.2, 2.2), sampler.size(0.8, 1.4)),),
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
    "dishwasher": (
        lambda sampler: appliances.dishwasher(sampler, kitchen.kitchen_look(sampler)[1]),
    ),
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
