"""All keys on the bus, with the types and the delivery that belong to them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Generic, TypeVar

from onemap_shared import messages as m

NAMESPACE = r"^[A-Za-z0-9_-]+(/[A-Za-z0-9_-]+)*$"  # of a robot; its keys begin with it

M = TypeVar("M")
Q = TypeVar("Q")
R = TypeVar("R")


class Delivery(Enum):
    """How a topic travels."""

    FRAME = "frame"  # large and frequent: low priority, dropped when the link is full
    STATE = "state"  # small: reliable in practice, dropped only under congestion
    COMMAND = "command"  # a session of its own, real-time priority, express


@dataclass(frozen=True, slots=True)
class Topic(Generic[M]):
    """A stream of messages of one type. Latched: late joiners get the last one.

    receipts: on which the stage that works on the messages says which one it took.
    """

    key: str
    message: type[M]
    delivery: Delivery = Delivery.STATE
    latched: bool = False
    receipts: Topic[m.FrameReceipt] | None = None


@dataclass(frozen=True, slots=True)
class Procedure(Generic[Q, R]):
    """A question of type Q that one service answers with an R.

    A request that waited for its turn longer than its caller waits for the reply is refused, and
    never carried out; stale_after_s: a shorter limit. parallel: requests that are served at once,
    by a handler that allows it. to_all: every process that serves it is asked, and one that does
    not refuse answers for all. delivery: COMMAND travels as commands do, and is carried out
    however late, as a stop is. aged: the request after it waited so many seconds for its turn.
    """

    key: str
    request: type[Q]
    reply: type[R]
    stale_after_s: float | None = None
    parallel: int = 1
    to_all: bool = False
    delivery: Delivery = Delivery.STATE
    aged: Callable[[Q, float], Q] = lambda request, _: request


RGBD_RECEIPTS = Topic("perception/rgbd_receipts/v1", m.FrameReceipt)
ROBOT_RGBD = Topic("robot/rgbd/v1", m.RgbdFrame, Delivery.FRAME, receipts=RGBD_RECEIPTS)
ROBOT_ODOMETRY = Topic("robot/odometry/v1", m.Odometry)
ROBOT_CMD_VEL = Topic("robot/cmd_vel/v1", m.VelocityCommand, Delivery.COMMAND)
ROBOT_TRUTH = Procedure("robot/truth/v1", m.TruthRequest, m.Truth)

FIELD_RECEIPTS = Topic("map/field_receipts/v1", m.FrameReceipt)
FIELD = Topic("perception/field/v1", m.FeatureField, Delivery.FRAME, receipts=FIELD_RECEIPTS)
DETECTIONS = Topic("perception/detections/v1", m.Detections)
EMBED_TEXT = Procedure("perception/embed_text/v1", m.TextRequest, m.TextEmbeddings)
EMBED_IMAGE = Procedure("perception/embed_image/v1", m.ImageRequest, m.TextEmbeddings)

MAP_REVISION = Topic("map/revision/v1", m.MapRevision, latched=True)
# A known text must not wait for new ones, which wait for perception.
MAP_SIMILARITY = Procedure("map/similarity/v1", m.SimilarityRequest, m.SimilarityReply, parallel=32)
MAP_IMAGE_SIMILARITY = Procedure(
    "map/image_similarity/v1", m.ImageSimilarityRequest, m.SimilarityReply, parallel=4
)
MAP_SEARCH_VIEW = Procedure("map/search_view/v1", m.SearchViewRequest, m.SearchView)
# The same view as the cells that changed since the caller's last one: what a planner asks for.
MAP_VIEW_CHANGES = Procedure("map/view_changes/v1", m.ViewChangesRequest, m.ViewChanges)
MAP_SEARCH_RESET = Procedure("map/search_reset/v1", m.SearchReset, m.MapSummary)
MAP_SAVE = Procedure("map/save/v1", m.MapFile, m.MapSummary)
MAP_LOAD = Procedure("map/load/v1", m.MapFile, m.MapSummary)
MAP_LIST = Procedure("map/list/v1", m.MapListRequest, m.MapList)
MAP_DELETE = Procedure("map/delete/v1", m.MapFile, m.SavedMap)
MAP_MERGE = Procedure("map/merge/v1", m.MapMerge, m.MapSummary)
MAP_CLEAR = Procedure("map/clear/v1", m.MapClear, m.MapSummary)
MAP_PLACES = Procedure("map/places/v1", m.PlacesRequest, m.MapPlaces)
MAP_CHANGE_PLACES = Procedure("map/change_places/v1", m.PlacesChange, m.MapPlaces)
MAP_REMEMBER = Procedure("map/remember/v1", m.ObjectFind, m.KeptObject)
MAP_OBJECTS = Procedure("map/objects/v1", m.ObjectListRequest, m.ObjectList)
MAP_OBJECT = Procedure("map/object/v1", m.ObjectId, m.PicturedObject)
MAP_FORGET = Procedure("map/forget/v1", m.ObjectId, m.KeptObject)

SEARCH_STATE = Topic("search/state/v1", m.SearchStatus, latched=True)
SEARCH_PATH = Topic("search/path/v1", m.PlannedPath)
SEARCH_START = Procedure(
    "search/start/v1",
    m.SearchRequest,
    m.SearchStatus,
    stale_after_s=0.5,
    aged=m.SearchRequest.aged,
)
SEARCH_CANCEL = Procedure(
    "search/cancel/v1", m.SearchId, m.SearchStatus, to_all=True, delivery=Delivery.COMMAND
)
SEARCH_GET = Procedure("search/get/v1", m.SearchId, m.SearchStatus)
SEARCH_LIST = Procedure("search/list/v1", m.SearchListRequest, m.SearchList)
SEARCH_RECORD = Procedure("search/record/v1", m.SearchId, m.SearchRecord)


def heartbeat(service: str) -> Topic[m.Heartbeat]:
    """The heartbeat topic of a service."""
    return Topic(f"health/{service}/heartbeat/v1", m.Heartbeat)


ALL_HEARTBEATS = Topic("health/*/heartbeat/v1", m.Heartbeat)


def liveliness(service: str, instance: str) -> str:
    """The key of a process's liveliness token."""
    return f"health/{service}/alive/{instance}"


def router_probe(instance: str) -> str:
    """The key of the question that a router asks itself, to see whether it routes."""
    return f"health/router/probe/{instance}"


def member_of(key: str) -> tuple[str, str]:
    """Service and instance in the key of a liveliness token, with or without a namespace."""
    parts = key.split("/")
    return parts[-3], parts[-1]


ALL_LIVELINESS = "health/*/alive/*"


@dataclass(frozen=True, slots=True)
class Access:
    """What one role does on the bus, and nothing else where the router controls access.

    names: of the processes of this role, as in their heartbeats and liveliness tokens.
    """

    names: tuple[str, ...]
    publishes: tuple[Topic[Any], ...] = ()
    subscribes: tuple[Topic[Any], ...] = ()
    serves: tuple[Procedure[Any, Any], ...] = ()
    calls: tuple[Procedure[Any, Any], ...] = ()


QUERIES = (MAP_SIMILARITY, MAP_IMAGE_SIMILARITY, MAP_SEARCH_VIEW)
FILES = (MAP_SAVE, MAP_LOAD, MAP_LIST, MAP_DELETE, MAP_MERGE, MAP_CLEAR)
OBJECTS = (MAP_OBJECTS, MAP_OBJECT, MAP_FORGET)
PLACES = (MAP_PLACES, MAP_CHANGE_PLACES)
SEARCHES = (SEARCH_START, SEARCH_CANCEL, SEARCH_GET, SEARCH_LIST, SEARCH_RECORD)
WATCHED = (
    *(ROBOT_RGBD, ROBOT_ODOMETRY, ROBOT_CMD_VEL),
    *(DETECTIONS, MAP_REVISION, SEARCH_STATE, SEARCH_PATH, ALL_HEARTBEATS),
)

# The roles by the names of their certificates. tests/shared/test_keys.py reads what each service
# uses, so that a key that is missing here fails before a router refuses it.
ROLES: Mapping[str, Access] = {
    "robot": Access(
        names=("simulator", "replay", "ros2", "robot"),
        publishes=(ROBOT_RGBD, ROBOT_ODOMETRY),
        # beside commands and receipts: what ROS 2 is shown, and the searches that it starts
        subscribes=(
            *(ROBOT_CMD_VEL, RGBD_RECEIPTS, MAP_REVISION, SEARCH_STATE, SEARCH_PATH),
            ALL_HEARTBEATS,
        ),
        serves=(ROBOT_TRUTH,),
        calls=(MAP_SEARCH_VIEW, MAP_OBJECTS, MAP_PLACES, SEARCH_START, SEARCH_CANCEL),
    ),
    "perception": Access(
        names=("perception",),
        publishes=(FIELD, DETECTIONS, RGBD_RECEIPTS),
        subscribes=(ROBOT_RGBD, SEARCH_STATE, FIELD_RECEIPTS),
        serves=(EMBED_TEXT, EMBED_IMAGE),
    ),
    "mapper": Access(
        names=("mapper",),
        publishes=(MAP_REVISION, FIELD_RECEIPTS),
        subscribes=(FIELD,),
        serves=(
            *(*QUERIES, *FILES, *OBJECTS, *PLACES),
            *(MAP_VIEW_CHANGES, MAP_SEARCH_RESET, MAP_REMEMBER),
        ),
        calls=(EMBED_TEXT, EMBED_IMAGE),
    ),
    "planner": Access(
        names=("planner",),
        publishes=(ROBOT_CMD_VEL, SEARCH_STATE, SEARCH_PATH),
        subscribes=(ROBOT_ODOMETRY, MAP_REVISION, DETECTIONS),
        serves=SEARCHES,
        calls=(
            *(EMBED_TEXT, MAP_SEARCH_VIEW, MAP_VIEW_CHANGES, MAP_SEARCH_RESET, MAP_REMEMBER),
            *(MAP_OBJECTS, MAP_PLACES),
        ),
    ),
    "gateway": Access(
        names=("gateway",),
        subscribes=WATCHED,
        calls=(EMBED_TEXT, *QUERIES, *FILES, *OBJECTS, *PLACES, *SEARCHES),
    ),
    # status, doctor, recorder, viewer and demo look; changes go through the gateway
    "tools": Access(
        names=("doctor", "status", "demo", "recorder", "viewer"),
        subscribes=(*WATCHED, FIELD),
        calls=(MAP_SEARCH_VIEW, MAP_OBJECTS),
    ),
}
