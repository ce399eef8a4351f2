"""The coverage is computed once for the queries of a second."""

from __future__ import annotations

import pytest

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.update import compute_update
from onemap_mapper.query.verdicts import KEPT_S, CoverageCache
from tests.mapper import scenes


@pytest.fixture(scope="module")
def belief() -> BeliefMap:
    made = BeliefMap(scenes.params())
    made.fuse(compute_update(scenes.field(0, scenes.pose()), made.params))
    return made


class Time:
    """A clock that is set."""

    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def test_a_coverage_is_kept_for_a_second_and_then_made_anew(belief: BeliefMap) -> None:
    clock = Time()
    cache = CoverageCache(clock)
    first = cache.coverage(belief.version(), (), ())
    assert first.not_looked_m2 > 0
    clock.now_s = KEPT_S * 0.99
    assert cache.coverage(belief.version(), (), ()) is first
    clock.now_s = KEPT_S
    assert cache.coverage(belief.version(), (), ()) is not first


def test_each_area_has_its_own(belief: BeliefMap) -> None:
    cache = CoverageCache(Time())
    whole = cache.coverage(belief.version(), (), ())
    area_m = (0.0, -1.0, 2.0, 1.0)
    part = cache.coverage(belief.version(), area_m, ())
    assert part.looked_m2 + part.not_looked_m2 <= 4.0 + 1e-6
    assert whole.looked_m2 + whole.not_looked_m2 > 4.0
