"""Violations of WCAG and of good practice on a page, as axe-core finds them in the browser."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.gateway.static.chromium import Page

PACKAGE = "axe_playwright_python"  # carries axe.min.js; the rest of it is not used
# All rules that are on by default, and the one of WCAG 2.2 that is not.
RUN = """axe.run(document, {
  resultTypes: ["violations"],
  rules: { "target-size": { enabled: true } },
}).then(({ violations }) => violations.flatMap(({ id, nodes }) =>
  nodes.map(({ target, failureSummary }) => `${id}: ${target.join(" ")}: ${failureSummary}`)))"""


@cache
def _source() -> str:
    spec = find_spec(PACKAGE)
    if spec is None or spec.origin is None:
        pytest.skip(f"axe-core is not installed ({PACKAGE}, see requirements/axe.txt)")
    return (Path(spec.origin).parent / "axe.min.js").read_text(encoding="utf-8")


def violations(page: Page) -> list[str]:
    """Rule, element and advice of every violation on the page as it is shown now."""
    page.evaluate(f"{{{_source()}}}; null")
    found: list[str] = page.evaluate(RUN)
    return found
