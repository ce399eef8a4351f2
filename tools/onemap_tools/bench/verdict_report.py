"""The report of a benchmark of verdicts: the thresholds, and how often each verdict is right."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from onemap_shared.messages import Verdict
from onemap_tools.train.evaluation.metrics import calibration_error, reliability

FOUND_SCORES = tuple(round(0.05 * step, 2) for step in range(5, 19))
LOOKED_SHARES = tuple(round(0.05 * step, 2) for step in range(10, 20))
# An object of this size may stand on so much floor, or not: between, both answers are right.
CERTAINLY_SEEN_M2, CERTAINLY_HIDDEN_M2 = 0.5, 2.0
BINS = 10


@dataclass(frozen=True, slots=True)
class VerdictOutcome:
    """One question to the map of one apartment at one stage of its exploration.

    score: of the best region; near: it lies near such an object. looked_share: as the map says.
    present: the apartment has one; shown: some image showed it well. hidden_m2: the largest part of
    the reachable floor that no image showed.
    """

    seed: int
    stage: float
    text: str
    score: float
    looked_share: float
    present: bool
    shown: bool
    near: bool
    hidden_m2: float

    def verdict(self, found_score: float, looked_share: float) -> Verdict:
        """What the map says with these thresholds."""
        if self.score >= found_score:
            return Verdict.FOUND
        looked = self.looked_share >= looked_share
        return Verdict.NOT_HERE if looked else Verdict.NOT_LOOKED_YET

    def is_right(self, verdict: Verdict) -> bool:
        """Whether that is so.

        Found: the best region is near such an object. Not here: there is none, and all floor was
        seen. Not looked yet: none was shown well, and some floor, or the one there is, was not.
        """
        if verdict is Verdict.FOUND:
            return self.near
        if verdict is Verdict.NOT_HERE:
            return not self.present and self.hidden_m2 < CERTAINLY_HIDDEN_M2
        return not self.shown and (self.present or self.hidden_m2 >= CERTAINLY_SEEN_M2)


Thresholds = tuple[float, float]  # found_score, looked_share


def summarise(outcomes: Sequence[VerdictOutcome], configured: Thresholds) -> dict[str, Any]:
    """The report. configured: the thresholds of the mapper, which the rates are of."""
    even = [one for one in outcomes if not one.seed % 2]
    odd = [one for one in outcomes if one.seed % 2]
    return {
        "benchmark": "verdicts",
        "apartments_chosen_on": len({one.seed for one in even}),
        "apartments_measured_on": len({one.seed for one in odd}),
        "chosen": dict(zip(("found_score", "looked_share"), choose(even), strict=True)),
        "configured": dict(zip(("found_score", "looked_share"), configured, strict=True)),
        "rates": rates(odd, configured),
        "by_stage": {
            f"{stage:g}": rates([one for one in odd if one.stage == stage], configured)
            for stage in sorted({one.stage for one in odd})
        },
        "reliability": reliabilities(odd, configured),
    }


def choose(outcomes: Sequence[VerdictOutcome]) -> Thresholds:
    """The thresholds with which the verdict that is wrong most often is right most often."""
    if not outcomes:
        raise ValueError("the thresholds are chosen on even seeds: name some with --seeds")

    def worst(thresholds: Thresholds) -> tuple[float, float]:
        each = rates(outcomes, thresholds)
        return min(each[str(v)]["right"] or 0.0 for v in Verdict), each["all"]["right"] or 0.0

    return max(product(FOUND_SCORES, LOOKED_SHARES), key=worst)


def rates(
    outcomes: Iterable[VerdictOutcome], thresholds: Thresholds
) -> dict[str, dict[str, float | None]]:
    """How often each verdict was given and right, and all of them together."""
    right: dict[str, list[bool]] = {name: [] for name in (*map(str, Verdict), "all")}
    for one in outcomes:
        verdict = one.verdict(*thresholds)
        for name in (str(verdict), "all"):
            right[name].append(one.is_right(verdict))
    return {
        name: {"count": len(flags), "right": round(float(np.mean(flags)), 3) if flags else None}
        for name, flags in right.items()
    }


def reliabilities(outcomes: Sequence[VerdictOutcome], thresholds: Thresholds) -> dict[str, Any]:
    """Share of right answers by score, where found, and by share looked at, where it is not."""
    found = [one for one in outcomes if one.score >= thresholds[0]]
    missing = [one for one in outcomes if one.score < thresholds[0]]
    rows = {
        "found": _bins([one.score for one in found], [one.near for one in found]),
        "not_here": _bins(
            [one.looked_share for one in missing],
            [one.is_right(Verdict.NOT_HERE) for one in missing],
        ),
    }
    return {**rows, "calibration_error": round(calibration_error(rows["found"]), 3)}


def _bins(stated: Sequence[float], right: Sequence[bool]) -> list[dict[str, float]]:
    probability = np.asarray(stated, np.float64)
    return [
        {name: round(value, 3) for name, value in row.items()}
        for row in reliability(probability, np.asarray(right, np.float64), BINS)
    ]


def table_lines(result: dict[str, Any]) -> list[str]:
    """The report as a table."""
    chosen, used = result["chosen"], result["configured"]
    rows = [
        f"chosen on {result['apartments_chosen_on']} apartments: found_score "
        f"{chosen['found_score']:g}, looked_share {chosen['looked_share']:g}",
        f"measured on {result['apartments_measured_on']} others with found_score "
        f"{used['found_score']:g}, looked_share {used['looked_share']:g}:",
        f"{'stage':>6}" + "".join(f"{name:>22}" for name in result["rates"]),
    ]
    for stage, each in [*result["by_stage"].items(), ("all", result["rates"])]:
        cells = [
            f"{'-' if rate['right'] is None else format(rate['right'], '.3f')} of {rate['count']}"
            for rate in each.values()
        ]
        rows.append(f"{stage:>6}" + "".join(f"{cell:>22}" for cell in cells))
    return rows


def draw_reliability(result: dict[str, Any], path: Path) -> None:
    """Write the reliability plot as a PNG."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 4.2), layout="constrained")
    titles = {
        "found": ("score of the best region", "found: share near such an object"),
        "not_here": ("share of the reachable area looked at", "share that is not here"),
    }
    for axes, (name, (stated, right)) in zip(figure.subplots(1, 2), titles.items(), strict=True):
        rows = result["reliability"][name]
        if name == "found":
            axes.plot([0, 1], [0, 1], color="grey", linestyle="--", label="as stated")
        axes.plot([r["stated"] for r in rows], [r["right"] for r in rows], marker="o")
        for row in rows:
            axes.annotate(f"{row['count']:.0f}", (row["stated"], row["right"]), fontsize=7)
        axes.set(xlabel=stated, ylabel=right, xlim=(0, 1), ylim=(0, 1.02))
    figure.savefig(path, dpi=110, metadata={"Software": None})
