"""Small kitchen appliances, from their own modules: microwaves, kettles, toasters."""

from __future__ import annotations

from onemap_simulator.generation.sampler import ModelFactory
from onemap_tools.train.variety.designs.kettles import glass_kettle, gooseneck, jug, retro_kettle
from onemap_tools.train.variety.designs.microwaves import (
    dials,
    glass_front,
    keypad,
    retro_microwave,
)
from onemap_tools.train.variety.designs.old_toasters import flap_toaster, rounded_toaster
from onemap_tools.train.variety.designs.special_microwaves import framed_microwave, open_microwave
from onemap_tools.train.variety.designs.stove_kettles import enamel_kettle, whistling
from onemap_tools.train.variety.designs.toaster_parts import CATEGORY
from onemap_tools.train.variety.designs.toasters import boxy_toaster, four_slot, long_slot

DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "microwave": (keypad, dials, glass_front, retro_microwave, open_microwave, framed_microwave),
    "kettle": (jug, gooseneck, whistling, glass_kettle, retro_kettle, enamel_kettle),
    CATEGORY: (rounded_toaster, four_slot, long_slot, boxy_toaster, flap_toaster),
}
