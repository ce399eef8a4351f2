"""Messages, services that answer, and a gateway on an in-memory router."""

from __future__ import annotations

import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import anyio
import cv2
import numpy as np
from fastapi import FastAPI
from fastapi.sse import ServerSentEvent
from starlette.testclient import TestClient

from onemap_gateway.bus.live_state import LiveState
from onemap_gateway.bus.rpc import RpcClient
from onemap_gateway.bus.state_cache import StateCache
from onemap_gateway.config import GatewayConfig
from onemap_gateway.http.app import create_app
from onemap_gateway.http.context import GatewayContext, Paces
from onemap_shared import keys
from onemap_shared import messages as m
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import pose_2d
from onemap_shared.grid import GridSpec
from onemap_shared.names import normalised
from onemap_shared.places import room_at
from onemap_shared.transport import RequestRejected
from tests.memory_bus import MemoryRouter

GRID = GridSpec(0.1, (-10, -5), (40, 30))
STAMP_NS = 1_767_225_600_000_000_000
PICTURE = b"\xff\xd8 a JPEG \xff\xd9"
QUICK = Paces(2.0, live_period_s=0.02, poll_s=0.01, ask_planner_s=0.05)
WAIT_S = 60.0  # far more than any message needs; a failure, not a pace


def rgbd(sequence: int = 1) -> m.RgbdFrame:
    rgb = np.zeros((24, 32, 3), np.uint8)
    rgb[:, :16] = (200, 0, 0)
    depth = np.full((24, 32), 1500, np.uint16)
    return m.RgbdFrame(sequence, STAMP_NS, rgb, depth, Intrinsics(30, 30, 16, 12), np.eye(4))


def odometry(x_m: float, y_m: float, yaw_rad: float = 0.0, sequence: int = 1) -> m.Odometry:
    return m.Odometry(sequence, STAMP_NS, pose_2d(x_m, y_m, yaw_rad), 0.3, 0.0)


def command(frame_ns: int = STAMP_NS) -> m.VelocityCommand:
    return m.VelocityCommand(1, STAMP_NS, 0.2, 0.0, planner="p1", frame_ns=frame_ns)


def detections(*names: str, sequence: int = 1) -> m.Detections:
    boxes = np.tile(np.array([[4, 6, 20, 18]], np.float32), (len(names), 1))
    scores, nothing = np.full(len(names), 0.8, np.float32), np.zeros((0, 3), np.float32)
    owner = np.zeros(0, np.int32)
    return m.Detections(sequence, STAMP_NS, "fake", names, boxes, scores, nothing, owner)


def revision(
    number: int, frames_fused: int | None = None, objects_version: int = 4
) -> m.MapRevision:
    fused = number if frames_fused is None else frames_fused
    numbers = (fused, 100, 1000, 12.0, 5.0, objects_version)
    return m.MapRevision(number, number, STAMP_NS, "fake-1", "fake", *numbers)


def planned_path(*points: tuple[float, float]) -> m.PlannedPath:
    points_m = np.array(points, np.float32).reshape(-1, 2)
    frontiers = np.array([[1.0, 1.0]], np.float32), np.array([0.5], np.float32)
    regions = np.zeros((0, 2), np.float32), np.zeros(0, np.float32)
    return m.PlannedPath(
        STAMP_NS, "frontier", "the best", points_m, points_m[-1:], *frontiers, *regions
    )


def heartbeat(
    service: str,
    progress: int = 1,
    *,
    ready: bool = True,
    problem: str = "",
    instance: str = "i1",
) -> m.Heartbeat:
    return m.Heartbeat(
        service, instance, STAMP_NS, progress, ready, problem, {"frames per second": 9.5}
    )


def find_result(name: str, x_m: float, y_m: float) -> m.ObjectResult:
    place = (x_m, y_m)
    return m.ObjectResult(
        name, m.SearchState.FOUND, "seen", (*place, 0.4), 0.9, 12.0, 3.5, place, place
    )


CHOICE = m.GoalChoice(
    2,
    "going to the unexplored space behind the sofa: it promises most",
    (
        m.GoalOption("frontier", (0.6, 0.4), 0.5556, 1.2346, 0.52, chosen=True),
        m.GoalOption("region", (1.5, 1.2), 0.61, 5.0, 0.41, chosen=False),
    ),
    3,
)


def search(
    search_id: str = "s1",
    state: m.SearchState = m.SearchState.EXPLORING,
    objects: tuple[str, ...] = ("sofa",),
    updated_ns: int = STAMP_NS,
) -> m.SearchStatus:
    reason = "looking around"
    return m.SearchStatus(search_id, state, objects, 0, reason, (), STAMP_NS, updated_ns, 0.0)


STEPS = (
    m.SearchStep(
        0.0, m.SearchState.EXPLORING, "sofa", "looking around for a sofa", (-0.6, 0.5),
        "frontier", (1.2, 1.2),
    ),
    m.SearchStep(
        6.0, m.SearchState.APPROACHING, "sofa", "walking up to what looks like a sofa", (0.6, 0.5),
        "detection", (1.0, 1.0),
    ),
    m.SearchStep(10.0, m.SearchState.FOUND, "", "found 1 of 1", (1.4, 0.5), "", ()),
)  # fmt: skip
PLACES = np.array([(t, -0.6 + t / 5, 0.5) for t in range(11)], np.float32)


def past_search(search_id: str = "s0") -> m.SearchStatus:
    """A search that found the sofa in ten seconds."""
    ended = search(search_id, m.SearchState.FOUND, updated_ns=STAMP_NS + 10**10)
    result = replace(find_result("sofa", 1.0, 1.0), frame_ns=STAMP_NS + 10**9)
    ended = replace(ended, elapsed_s=10.0, path_length_m=2.0)
    return replace(ended, reason="found 1 of 1", results=(result,))


def search_view(text: str = "", number: int = 7) -> m.SearchView:
    """Free floor with a wall along its right side (largest x) and unknown above it (largest y)."""
    occupancy = np.zeros(GRID.shape, np.uint8)
    occupancy[10:30, 5:20] = m.Occupancy.FREE
    occupancy[30, 5:20] = m.Occupancy.OCCUPIED
    layers = (occupancy > 0).astype(np.uint8)
    similarity = np.zeros((0, 0), np.float32)
    if text:
        similarity = np.full(GRID.shape, np.nan, np.float32)
        similarity[10:30, 5:20] = 0.01
        similarity[12:15, 15:18] = 0.9
    tops_dm = np.zeros(GRID.shape, np.uint8)
    tops_dm[30, 5:15], tops_dm[30, 15:20] = 8, 22  # a low wall, half of it up to the ceiling
    known = (text, number, number, STAMP_NS, GRID, occupancy, layers, similarity)
    return m.SearchView(*known, tops_dm=tops_dm)


def map_places(*places: m.Place) -> m.MapPlaces:
    """An L around a table, with a part beyond it, and another room that parted from it."""
    ids = np.full(GRID.shape, m.NO_ROOM, np.int32)
    ids[10:30, 5:10] = ids[10:16, 10:20] = ids[34, 6] = 0
    ids[12:14, 6:8] = m.NO_ROOM
    ids[20:30, 11:20] = 3
    rooms = tuple(
        room_at(ids, GRID, place.inside_m) if place.inside_m else m.NO_ROOM for place in places
    )
    changes = (m.RoomChange(5, (0,), (0, 3)),)
    return m.MapPlaces(len(places), 7, places, rooms, GRID, ids, changes)


def saved_map(name: str) -> m.SavedMap:
    return m.SavedMap(name, 2048, STAMP_NS, "fake-1", "fake", 0.1, 315, 7)


def kept_object(object_id: str = "3f9a12c4", name: str = "bed") -> m.KeptObject:
    return m.KeptObject(
        object_id, name, (3.42, -1.15, 0.41), (2.5, -2.1, 4.4, -0.3), 0.93, 2, "s1", STAMP_NS,
        STAMP_NS + 10**9, (4.0, 6.0, 20.0, 18.0), len(PICTURE), (0.1, 0.7),
    )  # fmt: skip


def members(*services: str) -> frozenset[tuple[str, str]]:
    """One process of each service, as the bus names them."""
    return frozenset((service, "1") for service in services)


def full_state() -> LiveState:
    """A state with one message of every stream."""
    state = LiveState()
    status = replace(search(), results=(find_result("sofa", 1.0, 2.0),))
    for message in (
        status,
        rgbd(),
        odometry(1.0, 2.0, 0.5),
        detections("sofa"),
        revision(3),
        planned_path((1, 2), (3, 4)),
        command(),
        heartbeat("mapper"),
    ):
        state = state.with_message(message, 1.0)
    return state


@dataclass
class FakeMapper:
    """Answers as a mapper with one small map; knows the words in ``vocabulary``, has no kite."""

    router: MemoryRouter
    vocabulary: frozenset[str] = frozenset({"sofa", "kettle", "kite"})
    saved: list[str] = field(default_factory=list)
    objects: list[m.KeptObject] = field(default_factory=list)
    picture: bytes = PICTURE
    asked: list[m.SimilarityRequest] = field(default_factory=list)
    images: list[bytes] = field(default_factory=list)
    image_problem: RequestRejected | None = None
    merged: list[m.MapMerge] = field(default_factory=list)
    loaded: list[str] = field(default_factory=list)
    cleared: int = 0
    places: tuple[str, ...] = ("Kitchen", "Ada's den")
    asked_places: int = 0

    def __post_init__(self) -> None:
        self.bus = self.router.bus("mapper")
        serve = self.bus.serve
        serve(keys.MAP_SIMILARITY, self.similarity)
        serve(keys.MAP_IMAGE_SIMILARITY, self._image_similarity)
        serve(keys.MAP_SEARCH_VIEW, self._view)
        serve(keys.MAP_SAVE, self._save)
        serve(keys.MAP_LOAD, self._load)
        serve(keys.MAP_LIST, self._list)
        serve(keys.MAP_DELETE, self._delete)
        serve(keys.MAP_MERGE, self._merge)
        serve(keys.MAP_CLEAR, self._clear)
        serve(keys.MAP_PLACES, self._places)
        serve(keys.MAP_OBJECTS, lambda _: m.ObjectList(tuple(self.objects), 1))
        serve(keys.MAP_OBJECT, self._object)
        serve(keys.MAP_FORGET, self._forget)

    def _places(self, _request: m.PlacesRequest) -> m.MapPlaces:
        self.asked_places += 1
        return map_places(*(m.Place(name, inside_m=(0.0, 0.0)) for name in self.places))

    def _check(self, text: str) -> None:
        if text not in self.vocabulary:
            words = {"words": [{"word": text, "did_you_mean": ["curb"]}]}
            raise RequestRejected("unknown_word", f"the encoder does not know {text!r}", words)

    def _image_similarity(self, request: m.ImageSimilarityRequest) -> m.SimilarityReply:
        if self.image_problem is not None:
            raise self.image_problem
        self.images.append(request.image)
        reply = self.similarity(replace(request.query, text="sofa"))
        return replace(reply, text=request.query.text, calibrated=False)

    def similarity(self, request: m.SimilarityRequest) -> m.SimilarityReply:
        self._check(request.text)
        self.asked.append(request)
        absent = request.text == "kite"
        count = 0 if absent else min(request.max_regions, 2)
        grid = search_view(request.text).similarity if request.include_grid else None
        return m.SimilarityReply(
            text=request.text,
            revision=7,
            stamp_ns=STAMP_NS,
            encoder_id="fake-1",
            centres_m=np.array([[0.35, 1.15], [1, 1]], np.float32)[:count],
            extents_m=np.array([[0.2, 1.0, 0.5, 1.3], [1, 1, 2, 2]], np.float32)[:count],
            scores=np.array([0.9, 0.2], np.float32)[:count],
            variances=np.array([0.1, np.inf], np.float32)[:count],
            grid=GRID,
            scores_grid=np.zeros((0, 0), np.float32) if grid is None else grid,
            best_score=0.199 if absent else 0.9,
            floor=0.2,
            outline_points_m=np.array([[0.2, 1], [0.5, 1], [0.5, 1.3]], np.float32)[: 3 * count],
            outline_owner=np.zeros(3 if count else 0, np.int32),
            last_seen_ns=np.array([STAMP_NS, 0], np.int64)[:count],
            best_views=np.array([[1.0, 2.0, 0.5], [np.nan] * 3], np.float32)[:count],
            verdict=m.MapVerdict(
                m.Verdict.NOT_LOOKED_YET if absent else m.Verdict.FOUND, 6.0, 2.0, 1, (1.5, 0.5)
            ),
            heights_m=np.array([[0.1, 0.9], [np.nan] * 2], np.float32)[:count],
            calibrated=True,
        )

    def _view(self, request: m.SearchViewRequest) -> m.SearchView:
        if request.text:
            self._check(request.text)
        return search_view(request.text)

    def _save(self, request: m.MapFile) -> m.MapSummary:
        created = request.name not in self.saved
        if created:
            self.saved.append(request.name)
        return replace(self._summary(f"maps/{request.name}"), created=created)

    def _load(self, request: m.MapFile) -> m.MapSummary:
        self.loaded.append(request.name)
        return self._used(request.name)

    def _clear(self, _request: m.MapClear) -> m.MapSummary:
        self.cleared += 1
        return self._summary("")

    def _used(self, name: str) -> m.MapSummary:
        self._require(name)
        return self._summary(f"maps/{name}")

    def _merge(self, request: m.MapMerge) -> m.MapSummary:
        self.merged.append(request)
        return self._used(request.name)

    def _list(self, request: m.MapListRequest) -> m.MapList:
        if request.name:
            self._require(request.name)
            return m.MapList((saved_map(request.name),))
        return m.MapList(tuple(map(saved_map, reversed(self.saved))), 4)

    def _delete(self, request: m.MapFile) -> m.SavedMap:
        self._require(request.name)
        self.saved.remove(request.name)
        return saved_map(request.name)

    def _object(self, request: m.ObjectId) -> m.PicturedObject:
        for kept in self.objects:
            if kept.object_id == request.object_id:
                return m.PicturedObject(kept, self.picture if kept.picture_bytes else b"")
        raise RequestRejected("unknown_object", f"there is no object {request.object_id!r}")

    def _forget(self, request: m.ObjectId) -> m.KeptObject:
        kept = self._object(request).kept
        self.objects.remove(kept)
        return kept

    def _require(self, name: str) -> None:
        if name not in self.saved:
            raise RequestRejected("unknown_map", f"there is no map {name!r}")

    def _summary(self, path: str) -> m.MapSummary:
        return m.MapSummary(path, "fake-1", "fake", 0.1, 315, 7, 2048)


class NamingMapper(FakeMapper):
    """Keeps places, and suggests a name for the room 3."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.named: dict[str, m.Place] = {}
        self.bus.serve(keys.MAP_CHANGE_PLACES, self._change)

    def _places(self, _request: m.PlacesRequest) -> m.MapPlaces:
        kitchen = m.Place("kitchen", inside_m=(1.5, 1.0), suggested=True)
        return map_places(*self.named.values(), *(() if "kitchen" in self.named else (kitchen,)))

    def _change(self, request: m.PlacesChange) -> m.MapPlaces:
        if request.all_others:
            self.named.clear()
        self.named |= {normalised(place.name): place for place in request.named}
        for name in map(normalised, request.forgotten):
            if self.named.pop(name, None) is None:
                raise RequestRejected("no_such_place", f"there is no place {name!r}")
        return self._places(m.PlacesRequest())


@dataclass
class FakePlanner:
    """Answers as a planner; ``move`` lets its search change state."""

    router: MemoryRouter
    status: m.SearchStatus | None = None
    past: list[m.SearchStatus] = field(default_factory=list)
    tick_ns: int = 1  # of its wall clock between two states
    requests: list[m.SearchRequest] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.bus = self.router.bus("planner")
        self._publisher = self.bus.publish(keys.SEARCH_STATE)
        self.bus.serve(keys.SEARCH_START, self._start)
        self.bus.serve(keys.SEARCH_GET, self._get)
        self.bus.serve(keys.SEARCH_CANCEL, self._cancel)
        self.bus.serve(keys.SEARCH_LIST, self._list)
        self.bus.serve(keys.SEARCH_RECORD, self._record)

    def move(self, state: m.SearchState, reason: str = "so it is") -> None:
        assert self.status is not None
        self.status = replace(
            self.status,
            state=state,
            reason=reason,
            updated_ns=self.status.updated_ns + self.tick_ns,
            elapsed_s=self.status.elapsed_s + 0.1,
        )
        self._publisher.put(self.status)

    def _start(self, request: m.SearchRequest) -> m.SearchStatus:
        if self.status is not None and self.status.active:
            raise RequestRejected("conflict", "another search is under way")
        if "flurb" in request.objects:
            words = {"words": [{"word": "flurb", "did_you_mean": ["curb"]}], "status": 200}
            raise RequestRejected(
                "unknown_word", "'flurb' (did you mean 'curb'?) is no word", words
            )
        places = {"": request.place_m, "kitchen": (0.0, 0.0), m.BACK: (0.5, -1.5)}
        if (place_m := places.get(normalised(request.place))) is None:
            raise RequestRejected("unknown_place", f"there is no place {request.place!r}")
        self.requests.append(request)
        if self.status is not None:
            self.past.insert(0, self.status)
        number = int(self.past[0].search_id[1:]) + 1 if self.past else 1
        self.status = replace(
            search(f"s{number}", objects=request.objects),
            kind=request.kind,
            place_m=place_m,
            details=request.details,
            stay_out=request.stay_out,
            continues=request.continues,
        )
        self._publisher.put(self.status)
        return self.status

    def _get(self, request: m.SearchId) -> m.SearchStatus:
        for status in ([self.status] if self.status else []) + self.past:
            if request.search_id in ("", status.search_id):
                return status
        raise RequestRejected("unknown_search", f"no search {request.search_id!r}")

    def _list(self, _request: m.SearchListRequest) -> m.SearchList:
        return m.SearchList((*([self.status] if self.status else []), *self.past), 2)

    def _record(self, request: m.SearchId) -> m.SearchRecord:
        """Ten seconds along y = 0.5 to a frontier, then to the sofa."""
        return m.SearchRecord(self._get(request), STEPS, 4, PLACES)

    def _cancel(self, request: m.SearchId) -> m.SearchStatus:
        if self._get(request).active:
            self.move(m.SearchState.CANCELLED, "cancelled by the user")
        return self._get(request)


def decoded(data: bytes) -> np.ndarray:
    """The RGB image of a PNG or JPEG."""
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB))


def state_reached(cache: StateCache, condition: Callable[[LiveState], bool]) -> bool:
    """Whether the cached state satisfies ``condition`` before ``WAIT_S`` has passed."""
    deadline_s = time.monotonic() + WAIT_S
    while not condition(cache.state):
        if time.monotonic() > deadline_s:
            return False
        time.sleep(0.005)
    return True


def refuse_constant(constant: str) -> None:
    """For ``json.loads``, which takes NaN and infinity."""
    raise AssertionError(f"{constant} is no JSON")


async def next_event(events: AsyncIterator[ServerSentEvent]) -> tuple[str, dict[str, Any]]:
    """Name and data of the next event."""
    with anyio.fail_after(WAIT_S):
        event = await events.__anext__()
    assert event.event is not None
    return event.event, event.data


@contextmanager
def gateway_on(
    router: MemoryRouter, config: GatewayConfig | None = None, paces: Paces = QUICK
) -> Iterator[GatewayContext]:
    """A gateway on ``router``, without HTTP."""
    bus = router.bus("gateway")
    cache = StateCache(bus)
    try:
        yield GatewayContext(cache, RpcClient(bus), config or GatewayConfig(), paces=paces)
    finally:
        cache.begin_close()  # its threads end by themselves
        bus.close()


@contextmanager
def client_on(
    router: MemoryRouter, config: GatewayConfig | None = None, paces: Paces = QUICK
) -> Iterator[TestClient]:
    """A client of a gateway on ``router``."""
    with gateway_on(router, config, paces) as gateway:
        yield client_of(gateway)


def client_of(gateway: GatewayContext) -> TestClient:
    app: FastAPI = create_app(gateway)
    return TestClient(app, base_url="http://localhost:8080")
