"""When a verdict is right, how thresholds are chosen, and what is reported."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from onemap_shared.messages import Verdict
from onemap_tools.bench.verdict_report import (
    VerdictOutcome,
    choose,
    draw_reliability,
    rates,
    summarise,
    table_lines,
)

SHOWN = VerdictOutcome(
    seed=2, stage=1.0, text="sofa", score=0.9, looked_share=0.95, present=True, shown=True,
    near=True, hidden_m2=0.1,
)  # fmt: skip
ABSENT = replace(SHOWN, text="kite", score=0.05, present=False, shown=False, near=False)
HIDDEN = replace(SHOWN, score=0.1, looked_share=0.3, shown=False, near=False, hidden_m2=20.0)
FOUND, NOT_HERE, NOT_YET = Verdict


def test_the_thresholds_make_the_verdict() -> None:
    assert SHOWN.verdict(0.9, 0.9) is FOUND
    assert ABSENT.verdict(0.5, 0.95) is NOT_HERE
    assert HIDDEN.verdict(0.5, 0.5) is NOT_YET


@pytest.mark.parametrize(
    ("outcome", "right"),
    [
        (SHOWN, {FOUND}),
        (replace(SHOWN, near=False), set()),  # it was shown, but the answer is elsewhere
        (ABSENT, {NOT_HERE}),
        (replace(ABSENT, hidden_m2=1.0), {NOT_HERE, NOT_YET}),  # neither seen nor hidden
        (replace(ABSENT, hidden_m2=3.0), {NOT_YET}),
        (HIDDEN, {NOT_YET}),
        (replace(HIDDEN, hidden_m2=0.0), {NOT_YET}),  # there, though all floor was seen
        (replace(HIDDEN, near=True), {FOUND, NOT_YET}),
    ],
)
def test_what_is_right_follows_from_the_truth(outcome: VerdictOutcome, right: set[Verdict]) -> None:
    assert {verdict for verdict in Verdict if outcome.is_right(verdict)} == right


def test_the_thresholds_are_those_of_the_least_errors() -> None:
    weak = replace(SHOWN, score=0.4)
    look_alike = replace(ABSENT, score=0.34)
    found_score, looked_share = choose([SHOWN, weak, ABSENT, look_alike, HIDDEN])
    assert 0.34 < found_score <= 0.4
    assert 0.3 < looked_share <= 0.95
    with pytest.raises(ValueError, match="even seeds"):
        choose([])


def test_rates_are_of_what_was_said() -> None:
    each = rates([SHOWN, replace(SHOWN, near=False), ABSENT], (0.5, 0.9))
    assert each["found"] == {"count": 2, "right": 0.5}
    assert each["not_here"] == {"count": 1, "right": 1.0}
    assert each["not_looked_yet"] == {"count": 0, "right": None}
    assert each["all"] == {"count": 3, "right": pytest.approx(0.667)}


def test_the_report_is_of_odd_seeds(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="needs matplotlib: pip install 'onemap[train]'")
    even = [SHOWN, ABSENT, HIDDEN]
    odd = [replace(one, seed=3, stage=0.5) for one in (*even, SHOWN)]
    result = summarise([*even, *odd], (0.5, 0.9))
    assert (result["apartments_chosen_on"], result["apartments_measured_on"]) == (1, 1)
    assert result["rates"]["all"] == {"count": 4, "right": 1.0}
    assert list(result["by_stage"]) == ["0.5"]
    assert result["reliability"]["found"] == [{"stated": 0.9, "right": 1.0, "count": 2.0}]
    assert "1.000 of 4" in table_lines(result)[-1]
    draw_reliability(result, tmp_path / "plot.png")
    assert (tmp_path / "plot.png").read_bytes().startswith(b"\x89PNG")
