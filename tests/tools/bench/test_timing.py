"""The benchmarks of time: what they draw is right, and all that they report is measured."""

from __future__ import annotations

from typing import Any

import pytest

from onemap_tools.bench import fusion, query
from onemap_tools.bench.options import FusionBench, QueryBench


def untold(_line: str) -> None:
    """Progress that nobody reads."""


def test_fusing_is_measured_with_its_memory() -> None:
    result = fusion.run(FusionBench(frames=2), untold)
    assert (result["frames"], result["image"], result["features"]) == (2, "640x480", "24x24x768")
    assert 0 < result["min_ms"] <= result["p50_ms"] <= result["p95_ms"]
    assert min(result["cpu_min_ms"], result["observe_p50_ms"], result["absorb_p50_ms"]) > 0
    assert result["cells"] > 1000
    assert 0 < result["map_bytes"] < result["peak_process_bytes"]
    assert result["device"] == "cpu"


@pytest.mark.parametrize(("dtype", "value_bytes"), [("float32", 4), ("float16", 2)])
def test_all_times_of_a_query_are_measured(dtype: Any, value_bytes: int) -> None:
    result = query.run(QueryBench(cells=5000, feature_dtype=dtype), untold)
    times = [value for name, value in result.items() if name.endswith(("_ms", "_per_frame"))]
    assert len(times) == 7
    assert all(value > 0 for value in times)
    assert result["map_bytes"] > result["table_bytes"]
    assert result["table_bytes"] == 5000 * query.CHANNELS * value_bytes
