"""What the attacks measured: a table for people and a JSON line for programs."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field

HELD, BROKEN, SKIPPED = "held", "broken", "skipped"


@dataclass(frozen=True, slots=True)
class ChaosResult:
    """One row of the table; ``test``: what was tried, ``limit``: what may happen at most."""

    test: str
    limit: str
    measured: str
    verdict: str


@dataclass(slots=True)
class Attack:
    """Records what one test measured; ``share``: of an attack's full number of attempts."""

    rows: list[ChaosResult] = field(default_factory=list)
    share: float = 1.0

    def attempts(self, full: int) -> int:
        """How many attempts are made where ``make chaos`` makes ``full``."""
        return max(1, round(self.share * full))

    def holds(self, test: str, *, limit: str, measured: object, held: bool) -> None:
        """Record a row of the table; fails the test unless the limit was held."""
        self.rows.append(ChaosResult(test, limit, str(measured), HELD if held else BROKEN))
        assert held, f"{test}: {measured}, the limit is {limit}"

    def hold_all(self, rows: Sequence[ChaosResult]) -> None:
        """Record several rows at once; fails the test unless all limits were held."""
        self.rows += rows
        broken = [f"{row.test}: {row.measured}" for row in rows if row.verdict != HELD]
        assert not broken, "; ".join(broken)


def table_lines(rows: Sequence[ChaosResult]) -> list[str]:
    """The table, with columns as wide as their longest entry."""
    head = ChaosResult("test", "limit", "measured", "verdict")
    cells = [list(asdict(row).values()) for row in (head, *rows)]
    widths = [max(len(row[column]) for row in cells) for column in range(len(cells[0]))]
    lines = [
        " | ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in cells
    ]
    return [lines[0], "-+-".join("-" * width for width in widths), *lines[1:]]


def json_line(rows: Sequence[ChaosResult]) -> str:
    """All rows and their counts as one JSON object."""
    counts = {verdict: sum(row.verdict == verdict for row in rows) for verdict in _VERDICTS}
    return json.dumps({**counts, "results": [asdict(row) for row in rows]})


_VERDICTS = (HELD, BROKEN, SKIPPED)
