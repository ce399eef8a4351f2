"""Finds as a planner sends them."""

from __future__ import annotations

from typing import Any

from onemap_shared.messages import ObjectFind

PICTURE = b"\xff\xd8 a JPEG \xff\xd9"


def object_find(
    name: str = "bed", x_m: float = 0.0, y_m: float = 0.0, **changes: Any
) -> ObjectFind:
    """A find at this place, with a picture."""
    values: dict[str, Any] = {
        "name": name,
        "position_m": (x_m, y_m, 0.4),
        "extent_m": (x_m - 1, y_m - 1, x_m + 1, y_m + 1),
        "score": 0.9,
        "stamp_ns": 100,
        "search_id": "s1",
        "box_px": (1.0, 2.0, 30.0, 40.0),
        "picture": PICTURE,
    }
    return ObjectFind(**(values | changes))
