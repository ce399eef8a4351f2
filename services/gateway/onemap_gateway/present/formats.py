"""JSON as browsers read it: without NaN and infinity, which Python writes and they refuse."""

from __future__ import annotations

import json
from collections.abc import Mapping
from math import isfinite
from typing import Any


def finite(value: Any) -> Any:
    """``value`` with None for every number that JSON does not have."""
    if isinstance(value, float):
        return value if isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: finite(item) for key, item in value.items()}
    return [finite(item) for item in value] if isinstance(value, list | tuple) else value


def json_text(value: Any) -> str:
    """The JSON of a document; ASCII only, because it may quote text that is not valid Unicode."""
    return json.dumps(finite(value), allow_nan=False)
