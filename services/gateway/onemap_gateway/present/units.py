"""Times and lengths as clients get them."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import datetime, timezone
from typing import Any

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
