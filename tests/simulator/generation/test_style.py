from __future__ import annotations

from onemap_simulator.generation.style import HELD_OUT, TRAINING
from onemap_simulator.generation.textures import FAMILIES


def test_styles_name_known_families_and_held_out_shares_no_cloth_or_floor() -> None:
    for style in (TRAINING, HELD_OUT):
        names = {*style.woods, *style.fabrics, *style.walls, *style.floors}
        assert names <= set(FAMILIES)
    assert not set(TRAINING.fabrics) & set(HELD_OUT.fabrics)
    assert not set(TRAINING.floors) & set(HELD_OUT.floors)
    assert not set(TRAINING.woods) & set(HELD_OUT.woods)
