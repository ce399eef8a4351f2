"""Figures that others published for HM3D, in percent, each with its source. None is ours."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class QuotedResult:
    """What a source says of an approach; metrics by the names of ``metrics.ratios_of``."""

    approach: str
    source: str
    metrics: Mapping[str, float]


PAPER = "OneMap paper, arXiv 2409.11764"

SINGLE_OBJECT = (
    QuotedResult(
        "PIRLNav, trained", f"{PAPER}, table I", {"sequence_sr": 64.1, "sequence_spl": 27.1}
    ),
    QuotedResult("ZSON, trained", f"{PAPER}, table I", {"sequence_sr": 25.5, "sequence_spl": 12.6}),
    QuotedResult("ESC", f"{PAPER}, table I", {"sequence_sr": 39.2, "sequence_spl": 22.3}),
    QuotedResult("VLFM", f"{PAPER}, table I", {"sequence_sr": 52.5, "sequence_spl": 30.4}),
    QuotedResult(
        "DWFE, frontiers by distance alone",
        "arXiv 2507.20021, abstract",
        {"sequence_sr": 61.1, "sequence_spl": 36.0},
    ),
    QuotedResult(
        "OneMap, the paper's",
        f"{PAPER}, tables I and II",
        {"sequence_sr": 55.8, "sequence_spl": 37.4, "wrong_claims": 19.5},
    ),
    QuotedResult(
        "OneMap without consensus, the paper's",
        f"{PAPER}, table II",
        {"sequence_sr": 48.2, "sequence_spl": 31.2, "wrong_claims": 26.6},
    ),
)

THREE_OBJECTS = (
    QuotedResult(
        "VLFM",
        f"{PAPER}, table III and figure 5",
        {
            "sequence_sr": 44.92,
            "sequence_spl": 19.90,
            "pr": 57.34,
            "ppl": 24.87,
            "spl_1": 27.50,
            "spl_2": 32.61,
            "spl_3": 29.13,
        },
    ),
    QuotedResult(
        "OneMap, the paper's",
        f"{PAPER}, table III and figure 5",
        {
            "sequence_sr": 54.24,
            "sequence_spl": 27.77,
            "pr": 65.54,
            "ppl": 32.68,
            "spl_1": 35.08,
            "spl_2": 37.44,
            "spl_3": 46.01,
        },
    ),
)
