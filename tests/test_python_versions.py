"""Which versions of Python are named: by the package, by the checkers, by make."""

from __future__ import annotations

import re

from tests.structure import ROOT

PROJECT = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")


def found(pattern: str, text: str) -> list[tuple[int, int]]:
    """The versions, major and minor, that the pattern finds."""
    return [(int(major), int(minor)) for major, minor in re.findall(pattern, text)]


def test_types_and_style_are_checked_for_the_oldest_python_that_is_promised() -> None:
    (oldest,) = found(r'requires-python = ">=(\d)\.(\d+)"', PROJECT)
    listed = found(r"Python :: (\d)\.(\d+)", PROJECT)
    assert min(listed) == oldest
    assert found(r'python_version = "(\d)\.(\d+)"', PROJECT) == [oldest]
    assert found(r'target-version = "py(\d)(\d+)"', PROJECT) == [oldest]


def test_make_asks_for_a_python_that_the_package_lists_and_says_which() -> None:
    (needed,) = found(r"sys\.version_info < \((\d), (\d+)\)", MAKEFILE)
    assert needed in found(r"Python :: (\d)\.(\d+)", PROJECT)
    assert f"Python {needed[0]}.{needed[1]} or newer is needed" in MAKEFILE
    for page in ("README.md", "docs/quickstart.md", "CONTRIBUTING.md"):
        assert f"Python {needed[0]}.{needed[1]} or" in (ROOT / page).read_text(encoding="utf-8")
