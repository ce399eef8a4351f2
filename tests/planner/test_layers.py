"""The planner's layers, read from its imports: nothing imports upwards, and chains stay short."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

PACKAGE = "onemap_planner"
ROOT = Path(__file__).parents[2] / "services" / "planner" / PACKAGE
# From low to high. Each layer imports itself and those before it. The modules directly in the
# package (threads, bus, configuration) are the highest.
ORDER = ("world", "motion", "search", "policy", "")
MAX_FLOORS = 10  # longest chain of imports inside the package


def modules() -> dict[str, Path]:
    """Dotted name within the package -> file."""
    files = (path for path in ROOT.rglob("*.py") if path.name != "__init__.py")
    return {".".join(path.relative_to(ROOT).with_suffix("").parts): path for path in files}


def imported(source: str, names: frozenset[str]) -> Iterator[str]:
    """Modules of the package, of those named, that the source imports."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and node.module:
            full = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Import):
            full = [alias.name for alias in node.names]
        else:
            continue
        for name in full:
            inside = name.removeprefix(f"{PACKAGE}.")
            if inside != name and inside in names:
                yield inside


def layer(name: str) -> int:
    """Position of the module's layer in ``ORDER``."""
    return ORDER.index(name.rpartition(".")[0])


def upward(name: str, source: str, names: frozenset[str]) -> list[str]:
    """Imports of the module that point to a higher layer."""
    return [
        f"{name} imports {other}" for other in imported(source, names) if layer(other) > layer(name)
    ]


def test_nothing_imports_upwards() -> None:
    files = modules()
    names = frozenset(files)
    broken = [b for name, path in files.items() for b in upward(name, path.read_text(), names)]
    assert broken == []


@pytest.mark.parametrize(
    ("name", "source"),
    [
        ("motion.path", "from onemap_planner.policy.goals import Goal"),
        ("world.costmap", "from onemap_planner.motion import path"),
        ("search.phases", "def f():\n    import onemap_planner.policy.goals"),
        ("policy.goals", "from onemap_planner.service import Planner"),
    ],
)
def test_an_upward_import_is_seen(name: str, source: str) -> None:
    assert len(upward(name, source, frozenset(modules()))) == 1


def test_chains_of_imports_stay_short() -> None:
    files = modules()
    names = frozenset(files)
    below = {name: set(imported(path.read_text(), names)) for name, path in files.items()}

    @cache
    def chain(name: str) -> tuple[str, ...]:
        return (name, *max((chain(other) for other in below[name]), key=len, default=()))

    longest = max((chain(name) for name in files), key=len)
    assert len(longest) <= MAX_FLOORS, " > ".join(longest)
