"""What an image of the map shows."""

from __future__ import annotations

from enum import Enum


class MapLayer(str, Enum):
    """A layer of the map."""

    OCCUPANCY = "occupancy"
    OBSERVED = "observed"
    EXPLORED = "explored"
    SEARCHED = "searched"
    SIMILARITY = "similarity"
