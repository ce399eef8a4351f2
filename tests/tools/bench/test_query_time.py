"""The benchmark of queries measures all that it reports."""

from __future__ import annotations

import pytest

from onemap_tools.bench.query_time import CHANNELS, QueryTimeOptions, run


@pytest.mark.parametrize(("dtype", "value_bytes"), [("float32", 4), ("float16", 2)])
def test_all_times_are_measured(dtype: str, value_bytes: int) -> None:
    result = run(QueryTimeOptions(cells=5000, feature_dtype=dtype))
    times = [value for name, value in result.items() if name.endswith(("_ms", "_per_frame"))]
    assert len(times) == 7
    assert all(value > 0 for value in times)
    assert result["table_bytes"] == 5000 * CHANNELS * value_bytes
    assert result["calibrated_over_read"] > 0
