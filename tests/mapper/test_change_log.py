"""What changed since a number, against a list of all changes."""

from __future__ import annotations

import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_mapper.belief.tiles import AREA, ChangeLog


@given(
    marks=st.lists(st.lists(st.integers(0, 4 * AREA - 1), max_size=6), max_size=12),
    since=st.integers(0, 14),
)
@settings(max_examples=60, deadline=None)
def test_rows_since_are_those_that_were_marked(marks: list[list[int]], since: int) -> None:
    log = ChangeLog()
    for count, rows in enumerate(marks):
        log.grow(1 + min(max([0, *rows]) // AREA, 3))  # it never shrinks
        log.mark(torch.tensor(rows, dtype=torch.int64))
        assert log.number == count + 1
    expected = sorted({row for rows in marks[since:] for row in rows})
    assert log.rows_since(since).tolist() == expected
    assert log.covers(since) == (since <= len(marks))


def test_a_change_of_everything_ends_what_can_be_told() -> None:
    log = ChangeLog()
    log.grow(1)
    log.mark(torch.tensor([3]))
    assert log.covers(0)
    log.mark_everything()
    assert not log.covers(1)
    assert log.covers(log.number)
    log.mark(torch.tensor([5]))
    assert log.rows_since(2).tolist() == [5]
    assert log.nbytes >= 8 * AREA
