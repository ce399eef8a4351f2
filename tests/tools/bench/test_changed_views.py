"""Views assembled from changes against whole views, over any sequence of what happens to a map."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_mapper.belief.cells import FeatureShare
from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.update import FrameUpdate, compute_update
from onemap_mapper.occupancy.evidence import OccupancyUpdate
from onemap_mapper.occupancy.heights import LEVELS
from onemap_mapper.query.replies import ViewReplies, search_view
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.similarity import TextQuery
from onemap_planner.world.map_view import AssembledView, with_changes
from onemap_shared import messages as m
from onemap_shared.geometry import F32
from onemap_shared.wire import decode, encode
from tests.mapper import scenes

CHANNELS = 16
LAYERS = ("occupancy", "layers", "similarity", "rival", "guidance")
REQUESTS = (
    m.SearchViewRequest("sofa", ("bed", "desk")),
    m.SearchViewRequest("bed"),
    m.SearchViewRequest("plain"),  # without calibration
    m.SearchViewRequest(),
)
STEPS = ("frame", "share", "drive", "reset", "clear", "reload", "words", "ask", "lost")


def unit_rows(rng: np.random.Generator, count: int) -> F32:
    rows = rng.normal(size=(count, CHANNELS))
    made: F32 = (rows / np.linalg.norm(rows, axis=1, keepdims=True)).astype(np.float32)
    return made


@functools.cache
def frames() -> tuple[FrameUpdate, ...]:
    """Frames of a room, and one of a place 30 m away."""
    rng = np.random.default_rng(0)
    places = [(0.1 * k - 0.3, 0.0, 1.3 * k) for k in range(4)] + [(30.0, -30.0, 0.0)]
    made = []
    for sequence, (x, y, yaw) in enumerate(places):
        features = unit_rows(rng, 48).reshape(6, 8, CHANNELS)
        boxes = tuple(
            scenes.Box(*((c[0] + x - x % 1, c[1] + y - y % 1, c[2]) for c in (box.low, box.high)))
            for box in scenes.ROOM
        )
        here = scenes.pose(x, y, yaw)
        field = scenes.field(sequence, here, boxes=boxes, features=features)
        made.append(compute_update(field, scenes.params()))
    return tuple(made)


class World:
    """A mapper without its threads, a caller that holds views, and what happens to both."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.maps = 0
        self.kept: dict[m.SearchViewRequest, AssembledView] = {}
        self.words()
        self.clear()

    def words(self) -> None:
        """Perception embeds all texts anew."""
        neutral = torch.from_numpy(unit_rows(self.rng, 3))
        self.queries = {
            name: TextQuery(
                name, torch.cat([own, neutral] if name != "plain" else [own]), temperature=20.0
            )
            for name in ("sofa", "bed", "desk", "plain")
            for own in [torch.from_numpy(unit_rows(self.rng, 1))]
        }

    def clear(self) -> None:
        """An empty map, as after clear and in a mapper that was started again."""
        self.belief = BeliefMap(scenes.params(), first_revision=int(self.rng.integers(0, 3)))
        self.reload()

    def reload(self) -> None:
        """The same map under another name, as it is loaded, or resumed by another mapper."""
        self.maps += 1
        self.scores = MapScores(self.belief)
        self.replies = ViewReplies(self.scores, f"map {self.maps}")

    def step(self, name: str) -> None:
        match name:
            case "frame":
                update = frames()[int(self.rng.integers(len(frames())))]
                self.belief.fuse(replace(update, sequence=self.belief.revision))
            case "share":
                self.put_in()
            case "drive" if self.belief.tiles.count:
                rows = np.unique(self.rng.integers(0, 4096 * self.belief.tiles.count, 50))
                evidence = np.zeros((len(rows), self.belief.params.levels + 1), np.int8)
                evidence[:, 0] = self.rng.integers(-3, 13, len(rows))
                clear, cells = self.rng.random(len(rows)) < 0.5, self.belief.tiles.cells(rows)
                frame = OccupancyUpdate(cells, evidence, clear, np.zeros_like(clear))
                self.belief.fuse_occupancy(frame, rows)
            case "reset":
                self.belief.reset_searched()
            case "clear":
                self.clear()
            case "reload":
                self.reload()
            case "words":
                self.words()
            case "ask" | "lost":
                request = REQUESTS[int(self.rng.integers(len(REQUESTS)))]
                self.ask(request, lost=name == "lost")

    def put_in(self) -> None:
        cells = np.unique(self.rng.integers(-90, 90, (int(self.rng.integers(1, 60)), 2)), axis=0)
        c = np.full(len(cells), float(self.rng.integers(1, 4)))
        heights = np.zeros((len(cells), LEVELS), np.float32)
        features = torch.from_numpy(unit_rows(self.rng, len(cells)))
        if self.belief.dimension == 0:
            self.belief.set_encoder("encoder-a", "space-a", CHANNELS)
        self.belief.put_in(
            FeatureShare(
                cells, features, c, c, heights, np.full((len(cells), 3), np.nan, np.float32)
            )
        )

    def ask(self, request: m.SearchViewRequest, *, lost: bool) -> None:
        """A reply travels to the caller, or is lost on the way."""
        names = (request.text, *request.rivals) if self.belief.store.count and request.text else ()
        queries = [self.queries[name] for name in names]
        kept = self.kept.get(request)
        question = m.ViewChangesRequest(
            request.text, request.rivals, m.NO_VIEW if kept is None else kept.key
        )
        changes = decode(m.ViewChanges, encode(self.replies.reply(question, queries)))
        if lost:
            return
        self.kept[request] = view = with_changes(kept, changes)
        whole = search_view(self.scores.of(queries), text=request.text)
        assert_same(view.whole(), whole)
        fresh = search_view(MapScores(self.belief).of(queries), text=request.text)
        np.testing.assert_allclose(view.whole().similarity, fresh.similarity, atol=1e-5)


def assert_same(view: m.SearchView, whole: m.SearchView) -> None:
    """Equal bit for bit."""
    for name in LAYERS:
        np.testing.assert_array_equal(getattr(view, name), getattr(whole, name), err_msg=name)
    for name in ("text", "revision", "sequence", "stamp_ns", "grid", "calibrated"):
        assert getattr(view, name) == getattr(whole, name)


@given(
    seed=st.integers(0, 2**16),
    steps=st.lists(st.sampled_from((*STEPS, "frame", "ask", "ask", "ask")), max_size=25),
)
@settings(max_examples=40, deadline=None)
def test_assembled_changes_are_the_whole_view(seed: int, steps: list[str]) -> None:
    """Grown, cleared and loaded maps, other words and lost replies."""
    world = World(seed)
    for name in steps:
        world.step(name)
    for request in REQUESTS:
        world.ask(request, lost=False)


def test_a_frame_changes_little_of_a_view() -> None:
    world, request = World(0), REQUESTS[0]
    for _ in range(30):
        world.put_in()
    world.ask(request, lost=False)
    world.belief.fuse(frames()[0])
    world.ask(request, lost=True)
    queries = [world.queries[name] for name in ("sofa", "bed", "desk")]
    have = world.kept[request].key
    changes = world.replies.reply(m.ViewChangesRequest("sofa", ("bed", "desk"), have), queries)
    assert changes.base == have
    assert len(frames()[0].cells) <= len(changes.layers) < 3 * len(frames()[0].cells)
    again = world.replies.reply(m.ViewChangesRequest("sofa", ("bed", "desk"), changes.key), queries)
    assert len(again.layers) == len(again.tiles) == 0
