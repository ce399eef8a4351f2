"""The benchmark of queries measures all that it reports."""

from __future__ import annotations

import pytest
import torch

from onemap_mapper.params import MapParams
from onemap_mapper.query.similarity import ScoreCache, TextQuery
from onemap_tools.bench.query_time import CHANNELS, QueryTimeOptions, Unasked, run
from onemap_tools.bench.query_waits import Dtype, map_of


@pytest.mark.parametrize(("dtype", "value_bytes"), [("float32", 4), ("float16", 2)])
def test_all_times_are_measured(dtype: Dtype, value_bytes: int) -> None:
    result = run(QueryTimeOptions(cells=5000, feature_dtype=dtype, wait_frames=2))
    times = [value for name, value in result.items() if name.endswith(("_ms", "_per_frame"))]
    assert len(times) == 8
    assert all(value > 0 for value in times)
    assert result["table_bytes"] == 5000 * CHANNELS * value_bytes
    assert result["calibrated_over_read"] > 0
    for way in ("frame_waits", "with_a_held_lock"):
        assert result[way]["queries"] > 0
        assert 0 <= result[way]["p50_ms"] <= result[way]["p95_ms"] <= result[way]["max_ms"]
        assert result[way]["query_holds_ms"] > 0


def test_waits_are_measured_only_if_asked_for() -> None:
    assert "frame_waits" not in run(QueryTimeOptions(cells=5000, wait_frames=0))


def test_scores_of_a_query_that_is_timed_are_not_kept() -> None:
    store = map_of(5000, CHANNELS, MapParams(), 0).store
    like = TextQuery("chair", torch.ones((1, CHANNELS)) / CHANNELS**0.5, 50.0)
    cache, unasked = ScoreCache(), Unasked()
    for _ in range(3):
        query = unasked.query(like)
        assert cache.serials([query]) == (0,)
        cache.scores(query, store, 1)
        assert cache.serials([query]) != (0,)
