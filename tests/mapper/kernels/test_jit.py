"""Compiled functions: kept on disk where that is possible, plain functions without numba."""

from __future__ import annotations

import runpy
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from onemap_mapper import jit

MODULE = """
from onemap_mapper.jit import compiled

@compiled
def total(values):
    result = 0.0
    for value in values:
        result += value
    return result
"""


def doubled(value: float) -> float:
    return 2 * value


def test_without_numba_a_function_stays_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jit, "numba", None)
    assert jit.compiled(doubled) is doubled
    assert jit.compiled_fast(doubled) is doubled


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


def test_the_code_is_kept_where_the_environment_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    numba = pytest.importorskip("numba", reason="numba is not installed")
    folder, module = tmp_path / "cache", tmp_path / "module.py"
    module.write_text(MODULE, encoding="utf-8")
    monkeypatch.setattr(numba.core.config, "CACHE_DIR", str(folder))  # NUMBA_CACHE_DIR
    for hits in (0, 1):  # the second process finds what the first compiled
        total = runpy.run_path(str(module))["total"]
        assert total(np.arange(4.0)) == 6.0
        assert sum(total.stats.cache_hits.values()) == hits
    assert len(list(folder.rglob("*.nbc"))) == 1


def test_a_compilation_is_announced_once_and_loading_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    numba = pytest.importorskip("numba", reason="numba is not installed")
    folder, module = tmp_path / "cache", tmp_path / "module.py"
    module.write_text(MODULE, encoding="utf-8")
    monkeypatch.setattr(numba.core.config, "CACHE_DIR", str(folder))
    said: list[str] = []
    for _process in range(2):  # the second finds what the first compiled
        total = runpy.run_path(str(module))["total"]
        with jit.on_compilation(said.append):
            total(np.arange(4.0))
            total(np.arange(4.0, dtype=np.float32))
    assert said == [f"compiling the map's kernels, once; cached in {total.stats.cache_path}"]
    assert str(folder) in said[0]


@pytest.mark.parametrize(
    ("missing", "says"),
    [
        ("", "compiled with numba"),
        ("No module named 'numba'", "No module named 'numba'; pip install numba"),
    ],
)
def test_the_log_says_why_frames_take_longer(
    missing: str, says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(jit, "MISSING", missing)
    assert says in jit.described()


def test_arithmetic_keeps_its_order() -> None:
    @jit.compiled
    def total(values: Any) -> Any:
        result = np.float32(0)
        for value in values:
            result += value
        return result

    values = np.array([1e8, 1.0, -1e8, 1.0], np.float32)
    assert total(values) == np.float32(1.0)  # in order; 2 if it were reordered
