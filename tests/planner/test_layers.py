"""The planner's layers, read from its imports: nothing imports upwards, or in circles."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tests.structure import ROOT, Module, floors, modules, within

PACKAGE = "onemap_planner"
# From low to high. Each layer imports itself and those before it. Other modules directly in the
# package (threads, bus, configuration) are the highest.
ORDER = ("sentences", "world", "motion", "search", "policy", "service")


def layer(name: str) -> int:
    """Position in ``ORDER`` of the layer of a module, or of a name in it."""
    part = name.split(".")[1]
    return ORDER.index(part) if part in ORDER else len(ORDER) - 1


def upward(module: Module) -> list[str]:
    """Imports of the module that point to a higher layer."""
    return [
        f"{module.name}:{line} imports {name}"
        for name, line in module.imports
        if within(name, PACKAGE) and layer(name) > layer(module.name)
    ]


def test_nothing_imports_upwards() -> None:
    inside = [m for m in modules(ROOT) if m.name.startswith(f"{PACKAGE}.")]
    assert [broken for module in inside for broken in upward(module)] == []
    assert {m.name.split(".")[1] for m in inside} >= set(ORDER)


@pytest.mark.parametrize(
    ("name", "code"),
    [
        ("motion.path", "from onemap_planner.policy.goals import Goal"),
        ("world.costmap", "from onemap_planner.motion import path"),
        ("search.state_machine", "def f():\n    import onemap_planner.policy.goals"),
        ("policy.goals", "from onemap_planner.service import Planner"),
        ("policy.goals", "from onemap_planner import registry"),
    ],
)
def test_an_upward_import_is_seen(name: str, code: str) -> None:
    assert len(upward(Module(f"{PACKAGE}.{name}", Path("x.py"), ast.parse(code)))) == 1


def test_no_imports_go_in_circles() -> None:
    assert floors(PACKAGE, modules(ROOT)) > 1  # raises if there is a circle
