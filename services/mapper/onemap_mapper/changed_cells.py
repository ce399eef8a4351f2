"""The cells of a map that changed since a moment, copied: what a difference of views is made of."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from onemap_mapper.belief_map import BeliefMap
from onemap_mapper.map_version import NO_SLOT, floor_bits, observed_bits
from onemap_mapper.transfers import to_host
from onemap_shared.geometry import I32, I64, U8
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Occupancy


@dataclass(frozen=True, slots=True)
class ChangedCells:
    """Cells that changed between two states of a map, as they are in the later one; on the host.

    since: number of the earlier change, None: all cells that anything is known of; number: of the
    later one; places (tiles, 2): where each tile of the map lies, world cell // 64. By cell, in
    ascending order of rows: rows (n,) of the map's tiles; slots (n,), NO_SLOT where nothing is
    observed; occupancy, values of ``Occupancy``; layers, bits of ``Layer``.
    """

    revision: int
    sequence: int
    stamp_ns: int
    grid: GridSpec
    since: int | None
    number: int
    places: I64
    rows: I64
    slots: I32
    occupancy: U8
    layers: U8


def changed_cells(belief: BeliefMap, since: int | None, robot: int = 0) -> ChangedCells:
    """What changed for a robot after the change ``since``; all if the map cannot tell, or for None.

    Takes the time of what changed, not of the map, unless it is everything.
    """
    if since is None or not belief.changes.covers(since):
        since, rows = None, _known_rows(belief)
    else:
        rows = belief.changes.rows_since(since)
    slots = belief.slots.values[rows]
    observed = slots[slots != NO_SLOT].long()
    driving = belief.occupancy
    floor = torch.stack([driving.assumed.values[rows], driving.clear.values[rows]])
    layers = floor_bits(*to_host(floor))
    slots_of_rows: I32 = to_host(slots)
    confidences = to_host(belief.store.confidences(observed))
    layers[slots_of_rows != NO_SLOT] |= observed_bits(
        confidences, belief.params.explored_variance, robot
    )
    history = belief.history(robot)
    return ChangedCells(
        revision=belief.revision,
        sequence=history.sequence,
        stamp_ns=history.stamp_ns,
        grid=belief.grid,
        since=since,
        number=belief.changes.number,
        places=belief.tiles.places(),
        rows=to_host(rows),
        slots=slots_of_rows,
        occupancy=to_host(belief.occupancy.states.values[rows]),
        layers=layers,
    )


def _known_rows(belief: BeliefMap) -> Tensor:
    known = belief.occupancy.states.values != Occupancy.UNKNOWN
    known |= belief.slots.values != NO_SLOT
    known |= belief.occupancy.assumed.values
    return torch.nonzero(known).squeeze(1)
