"""The changes of a map, read from its revisions."""

from __future__ import annotations

import pytest

from onemap_shared.messages import MapRevision
from onemap_tools.bag.map_history import StepKind, map_steps

N, F, R, G = StepKind.NEW_MAP, StepKind.FUSE, StepKind.RESET, StepKind.GAP


def revision(number: int, frames: int) -> MapRevision:
    return MapRevision(number, frames, frames, "a", "b", frames, 10, 100, 1.0, 1.0)


@pytest.mark.parametrize(
    ("announced", "steps"),
    [
        ([], []),
        ([(1, 1), (2, 2)], [N, F, F]),
        ([(0, 0), (1, 1)], [N, N, F]),
        ([(7, 0), (8, 1), (9, 1), (10, 2)], [N, F, R, F]),
        ([(8, 5), (9, 6)], [G, F]),
        ([(8, 5), (9, 0), (10, 1)], [G, N, F]),
        ([(1, 1), (1, 1), (2, 2)], [N, F, F]),
        ([(1, 1), (3, 3)], [N, F, G, F]),
        ([(1, 1), (3, 2)], [N, F, G, F]),
        ([(4, 0), (5, 1), (6, 40)], [N, F, G, F]),
        ([(8, 0), (9, 1), (1, 1), (2, 2)], [N, F, N, F, F]),
        ([(1, 1), (2, 2), (9, 2)], [N, F, F, G]),
    ],
)
def test_steps(announced: list[tuple[int, int]], steps: list[StepKind]) -> None:
    made = list(map_steps(revision(*each) for each in announced))
    assert [step.kind for step in made] == steps
