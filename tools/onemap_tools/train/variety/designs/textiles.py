"""Rugs and curtains."""

from __future__ import annotations

from onemap_simulator.generation.sampler import ModelFactory
from onemap_tools.train.variety.designs import curtains, rugs

DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "rug": (
        rugs.round_rug,
        rugs.oval_rug,
        rugs.runner,
        rugs.hide,
        rugs.fringed_rug,
        rugs.patchwork_rug,
        rugs.shaggy_rug,
    ),
    "curtain": (
        curtains.gathered_pair,
        curtains.tied_back,
        curtains.sheer,
        curtains.blind,
        curtains.cafe_curtain,
        curtains.ring_curtain,
    ),
}
