"""Boxes, baskets, trash cans and suitcases."""

from __future__ import annotations

from onemap_simulator.generation.sampler import ModelFactory
from onemap_tools.train.variety.designs import (
    baskets,
    boxes,
    lying_suitcases,
    open_bins,
    suitcases,
    trash_cans,
)

DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "box": (
        boxes.open_carton,
        boxes.shoe_box,
        boxes.crate,
        boxes.gift_box,
        boxes.storage_box,
        boxes.moving_box,
        boxes.stacked_boxes,
        boxes.hat_box,
    ),
    "basket": (
        baskets.handle_basket,
        baskets.laundry_basket,
        baskets.rope_basket,
        baskets.wire_basket,
        baskets.hamper,
        baskets.washing_basket,
    ),
    "trash can": (
        trash_cans.pedal_bin,
        trash_cans.swing_bin,
        open_bins.wastepaper_basket,
        trash_cans.sensor_bin,
        trash_cans.wheelie_bin,
        open_bins.office_bin,
        trash_cans.push_bin,
    ),
    "suitcase": (
        suitcases.hard_shell,
        suitcases.soft_case,
        suitcases.vintage_case,
        suitcases.wheeled_duffel,
        lying_suitcases.lying_case,
        lying_suitcases.open_case,
    ),
}
