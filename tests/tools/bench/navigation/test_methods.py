"""The switches of the methods, and the exploration of the baselines."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_planner.config import PlannerConfig
from onemap_planner.policy.explore import explore
from onemap_planner.world.candidates import Consensus
from onemap_shared.grid import GridSpec
from onemap_shared.messages import SearchView
from onemap_tools.bench.navigation.choices import Method
from onemap_tools.bench.navigation.methods import (
    NO_CONSENSUS,
    merged,
    planner_config,
    search_method,
    without_rivals,
    without_similarity,
)


def test_onemap_is_what_the_planner_does() -> None:
    assert search_method(Method.ONEMAP, 0.1).exploration is explore
    assert not search_method(Method.ONEMAP, 0.1).forgets
    assert search_method(Method.ONEMAP_RESET, 0.1).forgets
    config = planner_config(PlannerConfig(), 120.0)
    assert config.explore.object_limit_s == 120.0
    assert search_method(Method.ONEMAP, 0.1).consensus == Consensus()


@pytest.mark.parametrize("method", sorted(NO_CONSENSUS))
def test_without_consensus_any_detection_counts(method: Method) -> None:
    assert search_method(method, 0.1).consensus == Consensus(0.0, 0.0)


def test_a_value_map_is_each_episode_s_own() -> None:
    first, second = (search_method(Method.VLFM, 0.1) for _ in range(2))
    assert first.forgets
    assert first.value_map is not None
    assert first.value_map is not second.value_map
    assert search_method(Method.VLFM, 0.1).exploration is not explore


def test_without_similarity_no_cell_is_better_than_another() -> None:
    similarity = np.array([[0.9, np.nan], [0.1, 0.4]], np.float32)
    zeros = np.zeros((2, 2), np.uint8)
    view = SearchView("bed", 1, 1, 1, GridSpec(0.1, (0, 0), (2, 2)), zeros, zeros, similarity)
    changed = without_similarity(view)
    np.testing.assert_array_equal(changed.similarity, [[0, np.nan], [0, 0]])
    assert changed.rival.size == without_rivals(view).rival.size == 0


def test_changes_keep_what_they_do_not_name() -> None:
    assert merged({"a": {"b": 1, "c": 2}, "d": 3}, {"a": {"b": 5}}) == {
        "a": {"b": 5, "c": 2},
        "d": 3,
    }
    with pytest.raises(KeyError):
        merged({}, {"a": {"b": 1}})
