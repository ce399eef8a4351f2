"""Metrics on hand-made results, and what the intervals cover."""

from __future__ import annotations

import json

import numpy as np
import pytest

from onemap_tools.bench.navigation.metrics import (
    Ratio,
    estimate,
    estimates,
    progress_by_path_length,
    resampling_weights,
    sequence_spl,
    summary,
)
from onemap_tools.bench.navigation.records import Failure
from tests.tools.bench.navigation.records import episode, failed, found

ALL = episode(0, found("bed", 4, 8), found("sofa", 2, 2), found("desk", 3, 4), contacts=2)
TWO = episode(1, found("bed", 2, 2), found("sofa", 3, 6), failed("fan", 4, Failure.WRONG_OBJECT))
GAP = episode(2, failed("bed", 9, Failure.NEVER_IN_VIEW), found("sofa", 1, 2), found("fan", 1, 1))


def values() -> dict[str, float | None]:
    return {name: each.value for name, each in estimates([ALL, TWO, GAP], seed=1).items()}


def test_success_and_spl_per_object_are_means_over_all_objects() -> None:
    assert values()["sr"] == pytest.approx(7 / 9, abs=1e-4)
    spl = 0.5 + 1 + 0.75 + 1 + 0.5 + 0.5 + 1
    assert values()["spl"] == pytest.approx(spl / 9, abs=1e-4)
    assert values()["wrong_claims"] == pytest.approx(1 / 9, abs=1e-4)
    assert values()["path_m"] == pytest.approx(38 / 9, abs=1e-4)


def test_a_sequence_counts_if_all_of_it_was_found() -> None:
    assert values()["sequence_sr"] == pytest.approx(1 / 3, abs=1e-4)
    assert sequence_spl(ALL) == pytest.approx(9 / 14)
    assert sequence_spl(TWO) == 0.0


def test_progress_ends_with_the_first_failure() -> None:
    assert values()["pr"] == pytest.approx((1 + 2 / 3 + 0) / 3, abs=1e-4)
    # The path to the wrong object counts, what came before it was found on the shortest.
    assert progress_by_path_length(TWO) == pytest.approx(2 / 3 * 5 / 12)
    assert progress_by_path_length(GAP) == 0.0


def test_spl_by_position_is_given_that_all_before_were_found() -> None:
    assert values()["spl_1"] == pytest.approx((0.5 + 1 + 0) / 3, abs=1e-4)
    assert values()["spl_2"] == pytest.approx((1 + 0.5) / 2, abs=1e-4)
    assert values()["spl_3"] == pytest.approx((0.75 + 0) / 2, abs=1e-4)
    assert values()["spl_third_over_first"] == pytest.approx(0.375 / 0.5, abs=1e-4)


def test_the_summary_counts_the_reasons_and_is_json() -> None:
    document = summary([ALL, TWO, GAP], seed=1)
    assert (document["episodes"], document["objects"], document["contacts"]) == (3, 9, 2)
    assert document["failures"][Failure.WRONG_OBJECT.value] == 1
    assert document["failures"][Failure.NEVER_IN_VIEW.value] == 1
    assert sum(document["failures"].values()) == 2
    json.dumps(document, allow_nan=False)
    assert document == summary([ALL, TWO, GAP], seed=1)


def test_without_a_case_there_is_no_value() -> None:
    single = estimates([episode(0, failed("bed", 1, Failure.STUCK), found("sofa", 1, 1))], seed=1)
    assert single["spl_2"].value is None
    assert str(single["spl_2"]) == "-"
    assert "spl_3" not in single


def test_intervals_cover_the_truth_about_as_often_as_they_say() -> None:
    rng, covered = np.random.default_rng(3), 0
    for trial in range(200):
        ratio = Ratio((rng.random(60) < 0.7).astype(float), np.ones(60))
        found_share = estimate(ratio.of(resampling_weights(60, trial)), 0.7)
        assert found_share.low is not None
        assert found_share.high is not None
        covered += found_share.low <= 0.7 <= found_share.high
    assert 0.88 <= covered / 200 <= 0.99
