"""Python client of OneMap: ask where something is, send the robot, keep maps.

from onemap import Client

with Client() as client:
    print(client.query("sofa").regions)
"""

from __future__ import annotations

from onemap.choices import Choice, ChoiceOption
from onemap.client import Client
from onemap.connection import DEFAULT_URL
from onemap.endings import FindEvidence, SearchCoverage
from onemap.errors import InvalidSetting, OneMapError, Unreachable
from onemap.events import SearchChanged, SearchEvent, SearchInterrupted
from onemap.map_files import MapFiles
from onemap.map_objects import MapObject
from onemap.queries import LookedArea, QueryOptions, QueryResult, Region
from onemap.remote_search import NO_LIMITS, RemoteSearch, RemoteSearches, Retry, SearchLimits
from onemap.replies import (
    MapContent,
    MapStatistics,
    ObjectOutcome,
    SearchSnapshot,
    ServiceHealth,
    StoredMap,
    StreamHealth,
    SystemStatus,
)
from onemap.standing_queries import QueryEvent, QueryInterrupted

__all__ = [
    "DEFAULT_URL",
    "NO_LIMITS",
    "Choice",
    "ChoiceOption",
    "Client",
    "FindEvidence",
    "InvalidSetting",
    "LookedArea",
    "MapContent",
    "MapFiles",
    "MapObject",
    "MapStatistics",
    "ObjectOutcome",
    "OneMapError",
    "QueryEvent",
    "QueryInterrupted",
    "QueryOptions",
    "QueryResult",
    "Region",
    "RemoteSearch",
    "RemoteSearches",
    "Retry",
    "SearchChanged",
    "SearchCoverage",
    "SearchEvent",
    "SearchInterrupted",
    "SearchLimits",
    "SearchSnapshot",
    "ServiceHealth",
    "StoredMap",
    "StreamHealth",
    "SystemStatus",
    "Unreachable",
]
