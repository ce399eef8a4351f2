"""The rule of the verdict, and which frontier is best."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_mapper.query.verdicts import (
    LOOKED_SHARE,
    FloorCoverage,
    area_mask,
    frontier_worths,
    judge,
)
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Verdict

GRID = GridSpec(0.1, (-20, -20), (60, 60))
FOUND = 0.3


def coverage(
    share: float, frontiers: tuple[tuple[float, float], ...] = (), unseen_m2: float = 5.0
) -> FloorCoverage:
    return FloorCoverage(
        10.0 * share,
        10.0 * (1 - share),
        np.array(frontiers).reshape(-1, 2),
        np.full(len(frontiers), unseen_m2),
        np.zeros(GRID.shape, bool),
    )


@pytest.mark.parametrize(
    ("score", "share", "verdict"),
    [
        (FOUND, 0.0, Verdict.FOUND),
        (1.0, 1.0, Verdict.FOUND),
        (FOUND - 0.01, LOOKED_SHARE, Verdict.NOT_HERE),
        (0.0, LOOKED_SHARE - 0.01, Verdict.NOT_LOOKED_YET),
    ],
)
def test_score_and_coverage_make_the_verdict(score: float, share: float, verdict: Verdict) -> None:
    judged = judge(score, coverage(share), worths=np.zeros(0), found_score=FOUND)
    assert judged.verdict is verdict
    assert judged.looked_share == pytest.approx(share)
    assert (judged.frontiers, judged.frontier_m) == (0, ())


def test_a_frontier_is_worth_more_with_more_behind_it_and_when_near() -> None:
    nothing = np.full(GRID.shape, np.nan, np.float32)
    seen = coverage(0.5, ((-1.0, 0.0), (3.0, 0.0)))
    near, far = frontier_worths(seen, nothing, GRID, robot_xy_m=(-1.0, 0.0))
    assert near - far == pytest.approx(0.04 * 4.0)
    little = coverage(0.5, ((-1.0, 0.0),), unseen_m2=1.0)
    assert frontier_worths(little, nothing, GRID, robot_xy_m=(-1.0, 0.0))[0] < near


def test_a_frontier_among_what_is_like_the_object_is_worth_more() -> None:
    cosines = np.linspace(-1, 1, 3600, dtype=np.float32).reshape(GRID.shape)  # grows with x
    seen = coverage(0.5, ((-1.5, 0.0), (3.5, 0.0)))
    unlike, like = frontier_worths(seen, cosines, GRID, robot_xy_m=())
    assert like > 1.5 * unlike


def test_an_area_has_the_cells_whose_centres_lie_in_it() -> None:
    mask = area_mask(GRID, (0.0, 1.0, 0.3, 1.2))
    assert mask is not None
    np.testing.assert_array_equal(
        np.argwhere(mask), [(x, y) for x in (20, 21, 22) for y in (30, 31)]
    )
    assert area_mask(GRID, ()) is None
