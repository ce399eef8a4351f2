"""What is known of where a robot can drive, per cell of a map."""

from __future__ import annotations

import torch
from torch import Tensor

from onemap_mapper.kernels import jit
from onemap_mapper.kernels.evidence_rows import Layers, add_evidence, assume_floor
from onemap_mapper.occupancy import (
    MAX_EVIDENCE,
    MIN_EVIDENCE,
    OCCUPIED_THRESHOLD,
    SETTLED_EVIDENCE,
    OccupancyUpdate,
    accumulated_evidence,
    occupancy_states,
    settled_states,
    unseen_gone,
)
from onemap_mapper.params import OccupancyParams
from onemap_mapper.tiles import TileLayer
from onemap_shared.messages import Occupancy

LIMITS = (MIN_EVIDENCE, MAX_EVIDENCE, OCCUPIED_THRESHOLD, SETTLED_EVIDENCE)
STATES = (int(Occupancy.UNKNOWN), int(Occupancy.FREE), int(Occupancy.OCCUPIED))


class OccupancyLayers:
    """Layers of one map, on its device, by rows of its tiles; what changes them names the rows.

    evidence (rows, levels + 1) int8 and clear (rows,) bool as in ``OccupancyUpdate``; assumed
    (rows,) bool: clear, though no camera saw the floor, or not since something stood there that
    no ray went through; states (rows,) uint8, values of
    ``Occupancy``, and of them in settled (rows,) what lasted.
    """

    def __init__(self, params: OccupancyParams, device: torch.device) -> None:
        self._compiled = jit.usable(wanted=params.compiled, device=device)
        self.evidence = TileLayer(torch.int8, 0, (params.levels + 1,), device)
        self.clear = TileLayer(torch.bool, 0, (), device)
        self.assumed = TileLayer(torch.bool, 0, (), device)
        self.states = TileLayer(torch.uint8, Occupancy.UNKNOWN, (), device)
        self.settled = TileLayer(torch.uint8, Occupancy.UNKNOWN, (), device)

    @property
    def layers(self) -> tuple[TileLayer, ...]:
        """All of them, to be grown and measured."""
        return (self.evidence, self.clear, self.assumed, self.states, self.settled)

    @property
    def known_rows(self) -> Tensor:
        """Ascending rows (n,) with any evidence, or with floor."""
        known = self.clear.values | self.evidence.values.any(dim=1)
        return torch.nonzero(known).squeeze(1)

    def add(self, rows: Tensor, frame: OccupancyUpdate) -> tuple[Tensor, Tensor]:
        """Add a frame's evidence to cells, by their distinct rows (n,).

        Returns (n,) bool twice: which cells look different now, and in which something stands that
        did not, or the other way round.
        """
        if self._compiled:
            arrays = (rows.numpy(), frame.evidence.contiguous().numpy(), frame.clear.numpy())
            settled = self.settled.values.numpy()
            masks = add_evidence(self._arrays(), settled, arrays, LIMITS, STATES)
            return torch.from_numpy(masks[0]), torch.from_numpy(masks[1])
        had = self.evidence.values[rows]
        evidence = accumulated_evidence(had, frame.evidence)
        clear = self.clear.values[rows] | frame.clear
        unseen = clear & unseen_gone(had, frame.evidence, evidence)
        assumed = (self.assumed.values[rows] | unseen) & ~frame.clear
        different, states = self._put(rows, evidence, clear, assumed)
        before = self.settled.values[rows]
        self.settled.values[rows] = after = settled_states(before, evidence, states)
        return different, (before != Occupancy.UNKNOWN) & (after != before)

    def assume(self, rows: Tensor) -> Tensor:
        """Take floor for free, by rows (n,); returns which cells look different now (n,) bool."""
        if self._compiled:
            return torch.from_numpy(assume_floor(self._arrays(), rows.numpy(), LIMITS, STATES))
        evidence, clear = self.evidence.values[rows], self.clear.values[rows]
        assumed = self.assumed.values[rows] | ~clear
        return self._put(rows, evidence, torch.ones_like(clear), assumed)[0]

    def put(self, rows: Tensor, evidence: Tensor, clear: Tensor) -> Tensor:
        """Replace what is known of cells, by rows (n,); returns which look different now (n,)."""
        return self._put(rows, evidence, clear, self.assumed.values[rows] & clear)[0]

    def _put(
        self, rows: Tensor, evidence: Tensor, clear: Tensor, assumed: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Set what is known of cells; which look different now (n,) bool, and their states (n,)."""
        states = occupancy_states(evidence, clear)
        different = self.states.values[rows] != states
        different |= self.assumed.values[rows] != assumed
        different |= self.clear.values[rows] != clear
        self.evidence.values[rows] = evidence
        self.clear.values[rows] = clear
        self.assumed.values[rows] = assumed
        self.states.values[rows] = states
        return different, states

    def _arrays(self) -> Layers:
        evidence, clear, assumed, states = (
            layer.values.numpy() for layer in (self.evidence, self.clear, self.assumed, self.states)
        )
        return evidence, clear, assumed, states
