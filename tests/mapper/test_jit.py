"""Compiled functions: kept on disk, announced, none left to compile after the start."""

from __future__ import annotations

import importlib
import logging
import pkgutil
import runpy
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numba
import numpy as np
import pytest
import torch

from onemap_mapper import warm_up as module
from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.config import MapperConfig
from onemap_mapper.frame.update import compute_update
from onemap_mapper.warm_up import warm_up
from onemap_shared import jit, keys
from onemap_shared.clock import SystemClock
from onemap_shared.runner import StartReport
from tests.mapper import scenes
from tests.memory_bus import MemoryRouter

MODULE = """
from onemap_shared.jit import compiled

@compiled
def total(values):
    result = 0.0
    for value in values:
        result += value
    return result
"""


def doubled(value: float) -> float:
    return 2 * value


def test_without_a_folder_for_its_code_a_function_is_compiled_all_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = []

    def njit(*, cache: bool = False, **_options: Any) -> Any:
        def compile_it(function: Any) -> Any:
            if cache:
                raise RuntimeError("cannot cache function: no locator available")
            made.append(function)
            return function

        return compile_it

    monkeypatch.setattr(jit, "numba", SimpleNamespace(njit=njit))
    assert jit.compiled(doubled)(2.5) == 5.0
    assert made == [doubled]


def test_a_compilation_is_announced_once_and_loading_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, module = tmp_path / "cache", tmp_path / "module.py"
    module.write_text(MODULE, encoding="utf-8")
    monkeypatch.setattr(numba.core.config, "CACHE_DIR", str(folder))
    said: list[str] = []
    for _process in range(2):  # the second finds what the first compiled
        total = runpy.run_path(str(module))["total"]
        with jit.on_compilation(said.append):
            total(np.arange(4.0))
            total(np.arange(4.0, dtype=np.float32))
    assert said == [f"compiling kernels, once; cached in {total.stats.cache_path}"]
    assert str(folder) in said[0]


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
    params = scenes.params(occupancy_max_rows=max_rows, feature_dtype=dtype)
    warm_up(params)
    before = compiled_variants()
    of_float32, of_both = {"fuse_rows", "products"}, {"half_value", "half_bits"}
    unused = {name for name, variants in before.items() if variants == 0}
    of_float16 = {"half_products", "fuse_half_rows"}
    assert unused <= of_both | (of_float32 if dtype == "float16" else of_float16)
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


def test_a_first_start_says_in_log_and_heartbeat_that_it_compiles(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(module, "warm_up", lambda _config: numba.njit(doubled)(2.5))
    router = MemoryRouter()
    bus = router.bus("mapper")
    told = [
        client.subscribe(keys.heartbeat("mapper"))
        for client in (router.bus("gateway"), router.bus("gateway").sibling("robot2"))
    ]
    with caplog.at_level(logging.INFO, "onemap.mapper"):
        start = StartReport("mapper", SystemClock())
        start.add(bus)
        start.add(bus.sibling("robot2"))
        module.prepare(MapperConfig(), start)
    beat, other = (beats.take(0.0) for beats in told)
    assert beat is not None
    assert other is not None
    assert beat.starting
    assert other.starting
    announced, prepared = caplog.messages
    assert beat.problem.startswith(announced)
    assert announced.startswith("compiling kernels")
    assert "the first frame was prepared in" in prepared
