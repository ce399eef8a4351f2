"""The rule of the verdict, and which frontier is best."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_mapper.query import verdicts
from onemap_shared.geometry import U8
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Layer, Occupancy, Verdict
from onemap_shared.sight import in_sight

GRID = GridSpec(0.1, (-20, -20), (60, 60))
FOUND = 0.3


def coverage(
    share: float, frontiers: tuple[tuple[float, float], ...] = (), unseen_m2: float = 5.0
) -> verdicts.FloorCoverage:
    return verdicts.FloorCoverage(
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
        (FOUND - 0.01, verdicts.LOOKED_SHARE, Verdict.NOT_HERE),
        (0.0, verdicts.LOOKED_SHARE - 0.01, Verdict.NOT_LOOKED_YET),
    ],
)
def test_score_and_coverage_make_the_verdict(score: float, share: float, verdict: Verdict) -> None:
    judged = verdicts.judge(score, coverage(share), worths=np.zeros(0), found_score=FOUND)
    assert judged.verdict is verdict
    assert judged.looked_share == pytest.approx(share)
    assert (judged.frontiers, judged.frontier_m) == (0, ())


def test_a_frontier_is_worth_more_with_more_behind_it_and_when_near() -> None:
    nothing = np.full(GRID.shape, np.nan, np.float32)
    seen = coverage(0.5, ((-1.0, 0.0), (3.0, 0.0)))
    near, far = verdicts.frontier_worths(seen, nothing, GRID, robot_xy_m=(-1.0, 0.0))
    assert near - far == pytest.approx(0.04 * 4.0)
    little = coverage(0.5, ((-1.0, 0.0),), unseen_m2=1.0)
    assert verdicts.frontier_worths(little, nothing, GRID, robot_xy_m=(-1.0, 0.0))[0] < near


FREE, OCCUPIED, UNKNOWN = Occupancy.FREE, Occupancy.OCCUPIED, Occupancy.UNKNOWN
SEEN = Layer.OBSERVED | Layer.EXPLORED


def flat(*, second_room: bool) -> tuple[U8, U8, GridSpec]:
    """Two rooms of 3 x 3 m beside each other with a door of 0.8 m; the first one was explored."""
    occupancy = np.full((66, 34), UNKNOWN, np.uint8)
    occupancy[1:65, 1:33] = OCCUPIED
    occupancy[2:32, 2:32] = FREE
    occupancy[32:34, 12:20] = FREE
    occupancy[34:64, 2:32] = FREE if second_room else UNKNOWN
    if not second_room:
        occupancy[34:, :] = UNKNOWN
    layers = np.where(occupancy != UNKNOWN, SEEN, 0).astype(np.uint8)
    return occupancy, layers, GridSpec(0.1, (-10, 5), (66, 34))


ROBOT_M = (0.5, 2.0)  # in the first room


def covered(
    occupancy: U8, layers: U8, grid: GridSpec, *, area: object = None
) -> verdicts.FloorCoverage:
    return verdicts.floor_coverage(
        occupancy,
        layers,
        grid,
        robot_xy_m=ROBOT_M,
        area=area,  # type: ignore[arg-type]
    )


def test_a_door_to_the_unknown_is_the_only_frontier() -> None:
    coverage = covered(*flat(second_room=False))
    (frontier,) = coverage.frontiers_m
    np.testing.assert_allclose(frontier, [2.35, 2.1], atol=0.1)  # the door
    assert coverage.unseen_m2[0] > 3.0  # a good part of a circle of 3 m behind it
    assert coverage.not_looked_m2 == pytest.approx(coverage.unseen_m2[0])
    assert 0.4 < coverage.share < 0.8


def test_floor_seen_only_from_afar_was_not_looked_at() -> None:
    occupancy, layers, grid = flat(second_room=True)
    layers[40:64, :] = np.where(layers[40:64, :] > 0, Layer.OBSERVED, 0)
    coverage = covered(occupancy, layers, grid)
    assert len(coverage.frontiers_m) == 0
    assert coverage.not_looked_m2 == pytest.approx(2.4 * 3.0, rel=0.2)


def test_only_the_area_that_was_asked_for_counts() -> None:
    occupancy, layers, grid = flat(second_room=False)
    first = np.zeros(grid.shape, bool)
    first[:30] = True
    assert covered(occupancy, layers, grid, area=first).share == 1.0
    assert len(covered(occupancy, layers, grid, area=first).frontiers_m) == 0
    nowhere = np.zeros(grid.shape, bool)
    assert covered(occupancy, layers, grid, area=nowhere).share == 0.0


def test_floor_that_is_not_connected_is_not_reachable() -> None:
    occupancy, layers, grid = flat(second_room=True)
    occupancy[32:34, 12:20] = OCCUPIED
    floor = verdicts.reachable_floor(occupancy, grid, ROBOT_M)
    assert floor[10, 10]
    assert not floor[50, 10]
    layers[36:, :] = 0  # what nobody can reach need not be looked at
    assert covered(occupancy, layers, grid).share == 1.0


def test_a_wall_hides_what_is_behind_it() -> None:
    occupancy = np.zeros((41, 41), np.uint8)
    occupancy[25, :] = OCCUPIED
    seen = in_sight(occupancy)
    assert seen[10, 20]
    assert not seen[0, 0]  # farther than 20 cells
    assert not seen[27:, :].any()
