"""The planner's layers, read from its imports: nothing imports upwards, or in circles."""

from __future__ import annotations

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


def test_no_imports_go_in_circles() -> None:
    assert floors(PACKAGE, modules(ROOT)) > 1  # raises if there is a circle
