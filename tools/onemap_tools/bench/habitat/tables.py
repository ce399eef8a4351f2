"""The paper's tables with a run's figures and their intervals, in Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from onemap_tools.bench.habitat.quoted import SINGLE_OBJECT, THREE_OBJECTS, QuotedResult

SINGLE_COLUMNS = {"sequence_sr": "SR", "sequence_spl": "SPL", "wrong_claims": "wrong claims"}
SEQUENCE_COLUMNS = {"sequence_sr": "SR", "sequence_spl": "SPL", "pr": "PR", "ppl": "PPL"}


def paper_tables(result: Mapping[str, Any]) -> str:
    """One table for single objects; two for sequences: the whole, and SPL by position.

    Figures of others are quoted from their sources, from other runs and perhaps other episodes.
    """
    longest = result["objects_per_episode"]
    heading = (
        f"{result['about']} Percent, with 95 % bootstrap intervals over episodes where the figures "
        "are of this run; the others are quoted.\n"
    )
    if longest == 1:
        return heading + _table("Single objects", SINGLE_COLUMNS, SINGLE_OBJECT, result)
    quoted = THREE_OBJECTS if longest == 3 else ()
    positions = {f"spl_{k}": f"SPL of object {k}" for k in range(1, longest + 1)}
    whole = _table(f"Sequences of {longest} objects", SEQUENCE_COLUMNS, quoted, result)
    return heading + whole + _table("SPL by position", positions, quoted, result)


def _table(
    title: str,
    columns: Mapping[str, str],
    quoted: Sequence[QuotedResult],
    result: Mapping[str, Any],
) -> str:
    own = [_percent(result["metrics"].get(name)) for name in columns]
    rows = [
        ["approach", *columns.values(), "source"],
        ["---"] * (len(columns) + 2),
        *([each.approach, *_figures(each, columns), each.source] for each in quoted),
        [f"**{result['method']}, {result['features']}**", *own, "this run"],
    ]
    lines = "".join(f"| {' | '.join(row)} |\n" for row in rows)
    return f"\n## {title}\n\n{lines}"


def _figures(quoted: QuotedResult, columns: Mapping[str, str]) -> list[str]:
    return [str(quoted.metrics[name]) if name in quoted.metrics else "" for name in columns]


def _percent(estimate: Mapping[str, float | None] | None) -> str:
    values = [estimate[name] for name in ("value", "low", "high")] if estimate else []
    known = [100 * value for value in values if value is not None]
    if len(known) < 3:
        return "-"
    return f"{known[0]:.1f} [{known[1]:.1f}, {known[2]:.1f}]"
