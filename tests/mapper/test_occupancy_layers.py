"""The layers that frames change, by the compiled code and by torch."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from onemap_mapper.belief.tiles import AREA
from onemap_mapper.occupancy.evidence import OccupancyLayers, OccupancyUpdate
from onemap_mapper.transfers import CPU
from onemap_shared.messages import Occupancy
from tests.mapper import scenes

LEVELS = scenes.params().levels
NAMES = ("evidence", "clear", "assumed", "states", "settled")


def new_layers(*, compiled: bool) -> OccupancyLayers:
    made = OccupancyLayers(scenes.params(compiled=compiled), CPU)
    for layer in made.layers:
        layer.grow(1)
    return made


def random_frame(rng: np.random.Generator, rows: torch.Tensor) -> OccupancyUpdate:
    """Mostly a little evidence, as of real frames, some at the ends of int8."""
    evidence = rng.choice(
        np.array([-128, -4, -1, 0, 0, 2, 4, 127], np.int8), (len(rows), LEVELS + 1)
    )
    empty = rng.random(len(rows)) < 0.5  # columns that no point lies in
    evidence[empty] = np.minimum(evidence[empty], 0)
    clear, blind = rng.random((2, len(rows))) < 0.5
    return OccupancyUpdate.of_arrays(np.zeros((len(rows), 2), np.int64), evidence, clear, blind)


def column_frame(*evidence: int, clear: bool = False) -> OccupancyUpdate:
    """A frame of one cell, with the evidence of the lowest voxel, of those above, of the top."""
    low, middle, top = evidence
    column = np.array([[low, *[middle] * (LEVELS - 2), top, 0]], np.int8)
    clear_blind = (np.array([clear]), np.array([False]))
    return OccupancyUpdate.of_arrays(np.zeros((1, 2), np.int64), column, *clear_blind)


@pytest.mark.parametrize("compiled", [True, False])
def test_floor_from_which_something_went_unseen_is_assumed(compiled: bool) -> None:
    layers, row = new_layers(compiled=compiled), torch.tensor([7])
    layers.add(row, column_frame(0, 0, 0, clear=True))
    layers.add(row, column_frame(4, 4, 4))
    told = []
    upper_half, floor = column_frame(0, 0, -1), column_frame(0, 0, 0, clear=True)
    for frame in (upper_half, upper_half, floor):
        different, _ = layers.add(row, frame)
        state, assumed = (layer.values[7] for layer in (layers.states, layers.assumed))
        told.append((int(state), bool(assumed), bool(different)))
    occupied, free = int(Occupancy.OCCUPIED), int(Occupancy.FREE)
    assert told == [(occupied, False, False), (free, True, True), (free, False, True)]


@given(seed=st.integers(0, 2**16), frames=st.integers(1, 12), cells=st.integers(0, 40))
def test_the_compiled_layers_are_those_of_torch(seed: int, frames: int, cells: int) -> None:
    rng = np.random.default_rng(seed)
    fast, slow = new_layers(compiled=True), new_layers(compiled=False)
    for _ in range(frames):
        rows = torch.from_numpy(rng.permutation(50)[:cells])
        frame = random_frame(rng, rows)
        twice = torch.from_numpy(rng.integers(0, AREA, 9)).repeat(2)
        for mine, its in zip(fast.add(rows, frame), slow.add(rows, frame), strict=True):
            assert torch.equal(mine, its)
        marked = [set(twice[each.assume(twice)].tolist()) for each in (fast, slow)]
        assert marked[0] == marked[1]
        for name in NAMES:
            assert torch.equal(getattr(fast, name).values, getattr(slow, name).values)
        assert torch.equal(fast.known_rows, slow.known_rows)
