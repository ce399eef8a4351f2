"""Cups, bowls and bottles, generously sized as the simulator's are."""

from __future__ import annotations

from onemap_simulator.generation.sampler import ModelFactory
from onemap_tools.train.variety.designs import bottles, bowls, cups, flasks, glasses

DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "cup": (
        cups.mug,
        cups.tea_cup,
        cups.espresso_cup,
        cups.travel_mug,
        cups.enamel_cup,
        glasses.tumbler,
        glasses.paper_cup,
        glasses.goblet,
    ),
    "bowl": (
        bowls.footed_bowl,
        bowls.salad_bowl,
        bowls.flared_bowl,
        bowls.wire_bowl,
        bowls.mixing_bowl,
        bowls.square_bowl,
    ),
    "bottle": (
        bottles.wine_bottle,
        bottles.water_bottle,
        bottles.milk_bottle,
        bottles.beer_bottle,
        bottles.liqueur_bottle,
        flasks.sports_bottle,
        flasks.spray_bottle,
        flasks.detergent_bottle,
        flasks.thermos,
    ),
}
