"""Python client of OneMap: ask where something is, send the robot, keep maps.

from onemap import Client

with Client() as client:
    print(client.query("sofa").regions)
"""

from __future__ import annotations

from onemap.client import (
    Client,
    MapFiles,
    QueryOptions,
)
from onemap.connection import DEFAULT_URL, InvalidSetting, OneMapError, Retry, Unreachable
from onemap.place_replies import ChangedRooms, MapPlace, PlaceListReply
from onemap.replies import (
    LookedArea,
    MapContent,
    MapObject,
    MapPose,
    MapStatistics,
    QueryResult,
    Region,
    ServiceHealth,
    StoredMap,
    StreamHealth,
    SystemStatus,
)
from onemap.search_replies import (
    Choice,
    ChoiceOption,
    FindEvidence,
    ObjectOutcome,
    ReplayStep,
    SearchCoverage,
    SearchReplay,
    SearchSnapshot,
)
from onemap.searches import (
    NO_LIMITS,
    RemoteSearch,
    RemoteSearches,
    SearchChanged,
    SearchEvent,
    SearchInterrupted,
    SearchLimits,
)

__all__ = [
    "DEFAULT_URL",
    "NO_LIMITS",
    "ChangedRooms",
    "Choice",
    "ChoiceOption",
    "Client",
    "FindEvidence",
    "InvalidSetting",
    "LookedArea",
    "MapContent",
    "MapFiles",
    "MapObject",
    "MapPlace",
    "MapPose",
    "MapStatistics",
    "ObjectOutcome",
    "OneMapError",
    "PlaceListReply",
    "QueryOptions",
    "QueryResult",
    "Region",
    "RemoteSearch",
    "RemoteSearches",
    "ReplayStep",
    "Retry",
    "SearchChanged",
    "SearchCoverage",
    "SearchEvent",
    "SearchInterrupted",
    "SearchLimits",
    "SearchReplay",
    "SearchSnapshot",
    "ServiceHealth",
    "StoredMap",
    "StreamHealth",
    "SystemStatus",
    "Unreachable",
]
