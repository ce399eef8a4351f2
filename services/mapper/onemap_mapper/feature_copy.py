"""A copy of all features of a map that changes: only what changed is copied again."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from onemap_mapper.belief_map import BeliefMap
from onemap_mapper.feature_table import CellFeatures
from onemap_mapper.neutral_cosines import NOTHING_KNOWN
from onemap_mapper.snapshot import feature_dtype
from onemap_mapper.transfers import to_host
from onemap_shared.geometry import I64


@dataclass(frozen=True, slots=True)
class FeatureCopy:
    """Features (count, D) of all slots of ``belief`` at a revision, in its precision.

    Rows that were half written when they were copied are stale at any later revision.
    """

    belief: BeliefMap | None = None
    revision: int = NOTHING_KNOWN[0]
    features: NDArray = field(default_factory=lambda: np.zeros((0, 0), np.float32))

    def stale(self, belief: BeliefMap) -> I64:
        """Ascending slots (n,) of a map, as it is now, whose features are not in the copy."""
        store = belief.store
        if self.belief is not belief or self.features.shape[1] != store.dimension:
            return np.arange(store.count)
        return store.changed_since(self.revision, len(self.features))

    def updated(
        self, table: CellFeatures, stale: I64, belief: BeliefMap, *, revision: int, dimension: int
    ) -> FeatureCopy:
        """The copy with the features of the stale slots, from a table of that revision of the map.

        Nothing else of the map is read: it may change meanwhile. The array may be the same one.
        """
        features, dtype = self.features, feature_dtype(belief)
        if features.shape != (table.count, dimension) or features.dtype != dtype:
            features = np.zeros((table.count, dimension), dtype)
            if self.features.shape[1] == dimension:
                kept = min(len(self.features), table.count)
                features[:kept] = self.features[:kept]
        for rows, part in table.chunks(stale):
            features[stale[rows]] = to_host(part)
        return FeatureCopy(belief, revision, features)
