"""Scores while the map changes: each answer is that of one whole revision."""

from __future__ import annotations

import functools
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_mapper.belief import cells as cells_module
from onemap_mapper.belief.cells import FeatureShare
from onemap_mapper.belief.features import FeatureTable
from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.update import FrameUpdate, compute_update
from onemap_mapper.occupancy.heights import LEVELS
from onemap_mapper.query import scores as scores_module
from onemap_mapper.query.replies import search_view
from onemap_mapper.query.scores import MapScores, ScoredVersion
from onemap_mapper.query.similarity import ScoreCache, TextQuery
from onemap_shared.geometry import F32, I64
from tests.mapper import scenes

CHANNELS = 16
NEUTRAL = torch.eye(CHANNELS)[:3]


def unit_rows(rng: np.random.Generator, count: int) -> F32:
    rows = rng.normal(size=(count, CHANNELS))
    made: F32 = (rows / np.linalg.norm(rows, axis=1, keepdims=True)).astype(np.float32)
    return made


def text(rng: np.random.Generator, name: str, *, calibrated: bool = True) -> TextQuery:
    """A text that three neutral words compete with, or none."""
    own = torch.from_numpy(unit_rows(rng, 1))
    concepts = torch.cat([own, NEUTRAL]) if calibrated else own
    return TextQuery(name, concepts, 20.0)


class ChangingMap:
    """A map with three texts, and what their scores are at each revision that it had."""

    def __init__(self, seed: int, dtype: str = "float32") -> None:
        self.rng = np.random.default_rng(seed)
        self.belief = BeliefMap(scenes.params(feature_dtype=dtype))
        self.belief.set_encoder("encoder-a", "space-a", CHANNELS)
        self.texts = [text(self.rng, name, calibrated=name != "c") for name in "abc"]
        self.expected: dict[int, list[F32]] = {}
        for _ in range(3):
            self.change()

    def change(self) -> None:
        """Fuse cells, new ones and known ones."""
        cells = np.unique(self.rng.integers(0, 8, (int(self.rng.integers(1, 40)), 2)), axis=0)
        features = torch.from_numpy(unit_rows(self.rng, len(cells)))
        c = np.ones(len(cells))
        heights = np.zeros((len(cells), LEVELS), np.float32)
        self.belief.put_in(
            FeatureShare(
                cells, features, c, c, heights, np.full((len(cells), 3), np.nan, np.float32)
            )
        )
        found = ScoreCache().scores_of_all(self.texts, self.belief.store, self.belief.revision)
        self.expected[self.belief.revision] = [
            self.belief.shared_version().to_grid(each.scores) for each in found
        ]

    def check(self, answer: ScoredVersion, asked: list[int]) -> None:
        """The answer is that of the revision that it names."""
        expected = self.expected[answer.version.revision]
        for k, found in zip(asked, answer.texts, strict=True):
            scores = answer.version.to_grid(found.scores)
            np.testing.assert_allclose(scores, expected[k], atol=1e-5)


def test_a_cell_takes_few_bytes_besides_its_feature() -> None:
    """What is kept of it, copied for a reader, and derived for queries."""
    cells = np.argwhere(np.ones((128, 128), bool))
    count, belief = len(cells), BeliefMap(scenes.params(feature_dtype="float16"))
    belief.set_encoder("encoder-a", "space-a", CHANNELS)
    ones = np.ones(count)
    features, heights = torch.ones(count, CHANNELS), np.zeros((count, LEVELS), np.float32)
    belief.put_in(
        FeatureShare(
            cells, features, ones, ones, heights, np.full((len(cells), 3), np.nan, np.float32)
        )
    )
    cache, asked = ScoreCache(), text(np.random.default_rng(0), "a text")
    cache.sums_of(asked).of(belief.store, belief.revision, slice(None))
    weights = cache.nbytes
    cache.scores_of_all([asked], belief.store, belief.revision)
    besides = belief.memory_bytes - sum(block.nbytes for block in belief.store.blocks)
    assert besides <= 161 * count
    assert belief.version().nbytes <= 97 * count
    assert weights <= 9 * count
    assert cache.nbytes - weights <= 8 * count


class Interrupting:
    """A lock, and reads of features, between which something else happens now and then."""

    def __init__(self, happens: Callable[[], None], rng: np.random.Generator) -> None:
        self._happens, self._rng, self._held = happens, rng, False

    def __enter__(self) -> None:
        self.interrupt()
        self._held = True

    def __exit__(self, *_problem: object) -> None:
        self._held = False

    def interrupt(self) -> None:
        if self._held:  # or it is happening
            return
        self._held = True
        while self._rng.random() < 0.3:
            self._happens()
        self._held = False


UNINTERRUPTED = FeatureTable._ascending


def _interrupted(
    table: FeatureTable, lock: Interrupting, slots: I64
) -> Iterator[tuple[int, torch.Tensor]]:
    """As ``FeatureTable._ascending``, but the map changes between two parts of it."""
    for part in UNINTERRUPTED(table, slots):
        lock.interrupt()
        yield part


@given(seed=st.integers(0, 2**16), dtype=st.sampled_from(["float32", "float16"]))
@settings(max_examples=8, deadline=None)
def test_an_answer_is_that_of_one_revision_whenever_the_map_changes(seed: int, dtype: str) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cells_module, "BLOCK", 16)  # so that a read has several parts
        patch.setattr(scores_module, "COPIED_CELLS", 4)
        changing = ChangingMap(seed, dtype)
        rng = np.random.default_rng(seed + 1)
        lock = Interrupting(changing.change, rng)
        interrupted = functools.partialmethod(_interrupted, lock)
        patch.setattr(FeatureTable, "_ascending", interrupted)
        scores = MapScores(changing.belief, lock)
        for _ in range(4):
            asked = rng.permutation(3)[: rng.integers(0, 4)].tolist()
            answer = scores.of([changing.texts[k] for k in asked])
            changing.check(answer, asked)


@pytest.fixture
def hasty_threads(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Threads that take turns as often as they can, with reads and writes in many parts."""
    monkeypatch.setattr(cells_module, "BLOCK", 16)
    monkeypatch.setattr(scores_module, "COPIED_CELLS", 100)
    interval_s = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(interval_s)


@pytest.mark.usefixtures("hasty_threads")
def test_frames_are_fused_while_threads_ask() -> None:
    """Every answer, with its layers, is that of a map into which only whole frames were fused."""
    rng = np.random.default_rng(0)
    updates = [update(rng, k) for k in range(16)]
    words = [text(rng, f"text {k}") for k in range(16)]
    still, expected = BeliefMap(scenes.params()), dict[int, BeliefMap]()
    belief, lock = BeliefMap(scenes.params()), threading.Lock()
    belief.fuse(updates[0])
    scores, due = MapScores(belief, lock), threading.Semaphore(0)

    def fuse() -> None:
        for each in updates[1:]:
            assert due.acquire(timeout=60)
            with lock:
                belief.fuse(each)

    def ask(k: int) -> tuple[int, ScoredVersion]:
        due.release()  # a frame for each question: both at once
        return k, scores.of([words[k], words[0]])

    with ThreadPoolExecutor(4) as pool:
        fusing = pool.submit(fuse)
        answers = list(pool.map(ask, range(1, 16)))
        fusing.result()
    by_revision = {answer.version.revision: (k, answer) for k, answer in answers}
    assert len(by_revision) > 1
    for frame in updates:
        still.fuse(frame)
        for k, answer in answers:
            if answer.version.revision == still.revision:
                expected_answer = MapScores(still).of([words[k], words[0]])
                assert_same(answer, expected_answer)
                expected[still.revision] = still
    assert set(expected) == set(by_revision)


def update(rng: np.random.Generator, sequence: int) -> FrameUpdate:
    """A frame of the room with features unlike those of the other frames."""
    features = unit_rows(rng, 48).reshape(6, 8, CHANNELS)
    place = scenes.pose(-0.5, 0.02 * sequence, 0.7 * (sequence % 9))
    return compute_update(scenes.field(sequence, place, features=features), scenes.params())


def assert_same(answer: ScoredVersion, expected: ScoredVersion) -> None:
    found, want = (search_view(each, text="a text") for each in (answer, expected))
    for name in ("occupancy", "layers"):
        np.testing.assert_array_equal(getattr(found, name), getattr(want, name))
    for name in ("similarity", "rival"):
        np.testing.assert_allclose(getattr(found, name), getattr(want, name), atol=1e-5)
    np.testing.assert_array_equal(answer.version.variances, expected.version.variances)
    assert (found.grid, found.stamp_ns) == (want.grid, want.stamp_ns)


def test_the_lock_is_free_while_a_new_text_is_scored(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scores_module, "COPIED_CELLS", 4)
    changing, lock, held = ChangingMap(0), threading.Lock(), list[tuple[int, bool]]()
    products = FeatureTable.products

    def watched(table: FeatureTable, slots: I64, vectors: torch.Tensor) -> torch.Tensor:
        held.append((len(slots), lock.locked()))
        return products(table, slots, vectors)

    monkeypatch.setattr(FeatureTable, "products", watched)
    changing.check(MapScores(changing.belief, lock).of(changing.texts), [0, 1, 2])
    assert held == [(changing.belief.store.count, False), (0, False)]
