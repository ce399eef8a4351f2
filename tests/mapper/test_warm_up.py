"""After the start nothing is left to be compiled."""

from __future__ import annotations

import importlib
import pkgutil

import numpy as np
import pytest
import torch

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.update import compute_update
from onemap_mapper.warm_up import warm_up
from tests.mapper import scenes


def compiled_variants() -> dict[str, int]:
    """For each compiled function that others call, for how many combinations of types."""
    found = {}
    for part in ("frame", "occupancy", "belief"):
        folder = importlib.import_module(f"onemap_mapper.{part}")
        for info in pkgutil.iter_modules(folder.__path__, f"onemap_mapper.{part}."):
            for name, value in vars(importlib.import_module(info.name)).items():
                if hasattr(value, "signatures") and not name.startswith("_"):
                    found[name] = len(value.signatures)
    return found


@pytest.mark.parametrize("dtype", ["float16", "float32"])
@pytest.mark.parametrize("max_rows", [30, 240])
def test_a_frame_as_it_arrives_needs_no_further_compilation(max_rows: int, dtype: str) -> None:
    pytest.importorskip("numba", reason="numba is not installed")
    params = scenes.params(occupancy_max_rows=max_rows, feature_dtype=dtype)
    warm_up(params)
    before = compiled_variants()
    of_float32 = {"fuse_rows", "products"}
    unused = {name for name, variants in before.items() if variants == 0}
    of_float16 = {"half_products", "fuse_half_rows"}
    assert unused <= (of_float32 if dtype == "float16" else of_float16)
    belief = BeliefMap(params)
    for sequence in range(3):
        field = scenes.field(sequence, scenes.pose(0.1 * sequence))
        for array in (field.features, field.variance, field.depth_mm):
            array.flags.writeable = False  # as the bus delivers them
        belief.fuse(compute_update(field, params))
    empty = scenes.field(4, scenes.pose(), boxes=())
    assert not np.any(empty.depth_mm)
    belief.fuse(compute_update(empty, params))
    query = torch.ones((1, belief.dimension))
    belief.store.products(np.arange(belief.store.count), query)
    assert compiled_variants() == before


def test_without_compiled_functions_there_is_nothing_to_do() -> None:
    warm_up(scenes.params(compiled=False))
