"""What is trained on, what the calibration is fitted on and what is reported stay apart."""

from __future__ import annotations

import pickle

import pytest

from onemap_simulator.generation import textures
from onemap_simulator.generation.style import HELD_OUT
from onemap_tools.train.variety import surfaces
from onemap_tools.train.variety.kinds import VALIDATION, VARIED, Variety


def test_training_and_validation_share_no_texture_no_warp_and_no_design() -> None:
    assert not set(VARIED.surfaces) & set(VALIDATION.surfaces)
    assert not set(VARIED.warps) & set(VALIDATION.warps)
    assert set(VARIED.surfaces) | set(VALIDATION.surfaces) == set(surfaces.FAMILIES)
    for category, makers in VARIED.designs.items():
        assert not set(makers) & set(VALIDATION.designs[category])
    assert VALIDATION.own_camera
    assert not VARIED.own_camera


def test_neither_uses_a_texture_of_the_held_out_style() -> None:
    held_out = {*HELD_OUT.woods, *HELD_OUT.fabrics, *HELD_OUT.walls, *HELD_OUT.floors}
    own = {*VARIED.style.woods, *VARIED.style.fabrics, *VARIED.style.walls, *VARIED.style.floors}
    shared = held_out & own
    assert shared <= {"plaster"}  # as in the simulator's two styles
    assert not (held_out - shared) & set(surfaces.FAMILIES)
    assert not {"dots", "zigzag", "herringbone", "burl", "terrazzo"} & set(surfaces.FAMILIES)
    assert held_out <= set(textures.FAMILIES)


@pytest.mark.parametrize("variety", [VARIED, VALIDATION])
def test_a_variety_reaches_the_processes_that_render(variety: Variety) -> None:
    assert pickle.loads(pickle.dumps(variety)) == variety
