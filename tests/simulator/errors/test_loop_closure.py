from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64, pose_2d
from onemap_simulator.errors.loop_closure import LoopClosureParams, LoopClosures

PARAMS = LoopClosureParams(radius_m=1.0, min_way_m=8.0)


def circle(turns: float, backwards_after: float = np.inf) -> list[F64]:
    """Poses around a circle of 10 m, every 0.1 m; the heading is reversed after so many turns."""
    radius = 10 / (2 * np.pi)
    poses = []
    for k in range(round(100 * turns) + 1):
        angle = 2 * np.pi * k / 100
        flip = np.pi if k / 100 > backwards_after else 0.0
        x, y = radius * np.cos(angle), radius * np.sin(angle)
        poses.append(pose_2d(x, y, angle + np.pi / 2 + flip))
    return poses


def closures(poses: list[F64], params: LoopClosureParams = PARAMS) -> list[int]:
    known = LoopClosures(params)
    closed = [k for k, pose in enumerate(poses) if known.closes(pose)]
    assert known.count == len(closed)
    return closed


def test_a_loop_closes_once_where_it_comes_back_to_its_start() -> None:
    (first,) = closures(circle(1.2))
    assert 85 <= first <= 95  # within 1 m of the start, which is 10 m of way ago
    again = closures(circle(3))
    assert len(again) == 3  # the next only after 8 m
    assert min(np.diff(again)) >= 80


def test_neither_a_short_way_nor_another_view_closes_a_loop() -> None:
    there_and_back = [pose_2d(x, 0.0, 0.0) for x in (*np.arange(0, 3, 0.1), *np.arange(3, 0, -0.1))]
    assert closures(there_and_back) == []
    assert closures(circle(1.2, backwards_after=0.5)) == []
