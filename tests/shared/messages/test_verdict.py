"""Verdicts of the map."""

from __future__ import annotations

import pytest

from onemap_shared.messages import NO_VERDICT, MapVerdict, Verdict


def test_the_share_is_of_what_could_be_looked_at() -> None:
    assert MapVerdict(Verdict.FOUND, 6.0, 2.0).looked_share == pytest.approx(0.75)
    assert NO_VERDICT.looked_share == 0.0


def test_a_verdict_reads_as_it_travels() -> None:
    assert [str(each) for each in Verdict] == ["found", "not_here", "not_looked_yet"]
