"""All designs by category, and which of them no training sees."""

from __future__ import annotations

from onemap_simulator.generation.sampler import ModelFactory
from onemap_tools.train.variety.designs import (
    armchairs,
    armchairs_framed,
    armchairs_shell,
    bath_textiles,
    baths,
    beds,
    beds_children,
    beds_framed,
    benches,
    bicycles,
    block_stools,
    bookcases,
    books,
    cased_clocks,
    chairs,
    coffee_tables,
    containers,
    desks,
    dining_chairs,
    dressers,
    fans,
    home_desks,
    kitchen_cabinets,
    kitchen_sinks,
    lamps,
    laptops,
    light_tables,
    low_dressers,
    low_tables,
    metal_chairs,
    mirrors,
    nightstands,
    office_chairs,
    office_desks,
    ovens,
    pedestal_tables,
    picture_groups,
    pillows,
    plank_benches,
    plants,
    playthings,
    radiators,
    refrigerators,
    shelves,
    showers,
    small_appliances,
    small_plants,
    sofas,
    sofas_framed,
    sofas_modern,
    stools,
    table_lamps,
    tables,
    tableware,
    televisions,
    textiles,
    toilets,
    tube_televisions,
    vases,
    wall_clocks,
    wall_pictures,
    wardrobes,
    washbasins,
    washing_machines,
)

Designs = dict[str, tuple[ModelFactory, ...]]

HELD_OUT_EACH = 5  # of a category's designs, one in so many is for the validation style alone
HELD_OUT_PLACE = 2  # its place among them
MODULES = (
    armchairs,
    armchairs_framed,
    armchairs_shell,
    bath_textiles,
    baths,
    beds,
    beds_children,
    beds_framed,
    benches,
    bicycles,
    block_stools,
    bookcases,
    books,
    cased_clocks,
    chairs,
    coffee_tables,
    containers,
    desks,
    dining_chairs,
    dressers,
    fans,
    home_desks,
    kitchen_cabinets,
    kitchen_sinks,
    lamps,
    laptops,
    light_tables,
    low_dressers,
    low_tables,
    metal_chairs,
    mirrors,
    nightstands,
    office_chairs,
    office_desks,
    ovens,
    pedestal_tables,
    picture_groups,
    pillows,
    plank_benches,
    plants,
    playthings,
    radiators,
    refrigerators,
    shelves,
    showers,
    small_appliances,
    small_plants,
    sofas,
    sofas_framed,
    sofas_modern,
    stools,
    table_lamps,
    tables,
    tableware,
    televisions,
    textiles,
    toilets,
    tube_televisions,
    vases,
    wall_clocks,
    wall_pictures,
    wardrobes,
    washbasins,
    washing_machines,
)


def all_designs() -> Designs:
    """Every design; a category's stand in the order of the modules."""
    joined: dict[str, list[ModelFactory]] = {}
    for module in MODULES:
        for category, makers in module.DESIGNS.items():
            joined.setdefault(category, []).extend(makers)
    return {category: tuple(makers) for category, makers in sorted(joined.items())}


def _is_held_out(place: int) -> bool:
    return place % HELD_OUT_EACH == HELD_OUT_PLACE


def _chosen(*, held_out: bool) -> Designs:
    return {
        category: tuple(m for i, m in enumerate(makers) if _is_held_out(i) == held_out)
        for category, makers in all_designs().items()
    }


TRAINING = _chosen(held_out=False)
VALIDATION = _chosen(held_out=True)
