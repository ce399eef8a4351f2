"""After the warm-up a planning step compiles nothing more."""

from __future__ import annotations

import pkgutil
from importlib import import_module

import onemap_planner
from onemap_planner.warm_up import warm_up
from onemap_tools.bench.navigation.planning import planning_times


def compiled_variants() -> dict[str, int]:
    """For each compiled function of the planner, for how many combinations of types."""
    found = {}
    for info in pkgutil.walk_packages(onemap_planner.__path__, "onemap_planner."):
        if info.name.startswith(("onemap_planner.motion.", "onemap_planner.world.")):
            for name, value in vars(import_module(info.name)).items():
                if hasattr(value, "signatures"):
                    found[f"{info.name}.{name}"] = len(value.signatures)
    return found


def test_a_planning_step_needs_no_further_compilation() -> None:
    warm_up()
    before = compiled_variants()
    assert len(before) - list(before.values()).count(0) >= 6  # others only call each other
    result = planning_times(10.0, 1, steps=12)
    assert compiled_variants() == before
    assert 0 < result["step_ms"][0] <= result["step_ms"][1]
    assert 0 < result["comparing_steps"] <= result["steps"] == 11
