"""Values as clients get them: JSON that browsers read, times, lengths."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from datetime import datetime, timezone
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


DECIMALS = 3  # of lengths in metres: millimetres


def rfc3339(time_ns: int) -> str:
    """Nanoseconds since 1970 as a time of RFC 3339 in UTC, cut to milliseconds."""
    seconds, rest_ns = divmod(time_ns, 10**9)
    moment = datetime.fromtimestamp(seconds, tz=timezone.utc)
    return f"{moment:%Y-%m-%dT%H:%M:%S}.{rest_ns // 10**6:03d}Z"


def millimetres(values: Iterable[Any]) -> Any:
    """Lengths in metres as a tuple of floats, rounded to millimetres."""
    # Any: pydantic checks the length that the schema of the reply promises
    return tuple(round(float(value), DECIMALS) for value in values)
