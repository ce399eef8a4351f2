"""The pictures of the set; and that nothing that trains can see them."""

from __future__ import annotations

import ast
import json
import subprocess
import sys

import numpy as np
import pytest

from onemap_tools.foreign import frames
from onemap_tools.foreign.frames import (
    FOREIGN_SEED,
    NO_CLASS,
    ForeignSetSpec,
    foreign_frames,
    render_foreign,
)
from tests.structure import ROOT, modules, within

FOREIGN = "onemap_tools.foreign"
TINY = ForeignSetSpec(1, 2, 32, 24)
# Only figures may look at the set, and who writes it out for people.
READERS = ("onemap_tools.bench.foreign", "onemap_tools.bench.foreign_command")
WRITERS = ("onemap_tools.cli.scene",)


def test_nothing_that_trains_or_generates_imports_the_set() -> None:
    readers = {
        module.name
        for module in modules(ROOT)
        if not within(module.name, FOREIGN) and any(within(n, FOREIGN) for n, _ in module.imports)
    }
    assert readers == {*READERS, *WRITERS}
    for module in modules(ROOT):
        if any(within(name, reader) for reader in READERS for name, _ in module.imports):
            assert within(module.name, "onemap_tools.bench"), module.name


def test_the_seed_is_written_in_one_place() -> None:
    places = {
        module.name
        for module in modules(ROOT)
        for node in ast.walk(module.tree)
        if isinstance(node, ast.Constant) and node.value == FOREIGN_SEED
    }
    assert places == {frames.__name__}


def test_the_set_is_made_without_the_training_furniture() -> None:
    """Not even through another module: measured in a process of its own."""
    names = [module.name for module in modules(ROOT) if within(module.name, FOREIGN)]
    code = f"import {', '.join(names)}; import json, sys; print(json.dumps(sorted(sys.modules)))"
    command = [sys.executable, "-c", code]
    result = subprocess.run(command, capture_output=True, text=True, check=True)
    loaded = json.loads(result.stdout)
    assert set(names) <= set(loaded)
    forbidden = ("onemap_simulator.generation", "onemap_tools.train")
    assert [name for name in loaded if any(within(name, scope) for scope in forbidden)] == []


@pytest.mark.slow
@pytest.mark.timeout(600)  # four apartments: seconds alone, minutes on a busy machine
def test_pictures_are_functions_of_the_seed_in_any_number_of_processes() -> None:
    words = ("wall", "sofa", "floor")
    parts = list(foreign_frames(words, TINY, 2))
    assert [len(part) for part in parts] == [TINY.pictures] * 3
    first, again = parts[0], render_foreign(TINY.scenes[0], words, TINY)
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.rgb, other.rgb)
        np.testing.assert_array_equal(one.label, other.label)
        assert one.rgb.shape == (24, 32, 3)
        assert set(np.unique(one.label)) <= {0, 1, 2, NO_CLASS}
    assert (first[0].rgb != first[1].rgb).any()
