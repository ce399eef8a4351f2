"""What a search method does differently from OneMap: the switches of the lockstep simulation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from onemap_planner.policy.explore import explore
from onemap_planner.policy.step import Exploration
from onemap_planner.world.candidates import CONSENSUS, Consensus
from onemap_shared.messages import FeatureField, SearchView, TextEmbeddings


class ValueMap(Protocol):
    """Scores of cells for one object, from all frames since the last ``clear``."""

    def clear(self) -> None:
        """Forget all frames."""

    def add(self, field: FeatureField, query: TextEmbeddings) -> None:
        """Take in a frame for the query's first text."""

    def view(self, view: SearchView) -> SearchView:
        """The view with these scores in place of the similarity."""


@dataclass(frozen=True, slots=True)
class SearchMethod:
    """exploration: where to drive while nothing is approached; consensus: when detector and map
    agree; view: changes what the planner
    sees of the map, None: nothing; value_map: scores cells in place of the belief map; forgets:
    the map and what the planner knows of it are cleared for each object."""

    exploration: Exploration = explore
    consensus: Consensus = CONSENSUS
    view: Callable[[SearchView], SearchView] | None = None
    value_map: ValueMap | None = None
    forgets: bool = False


ONEMAP = SearchMethod()
