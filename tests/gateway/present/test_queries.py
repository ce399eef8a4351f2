"""Answers of the map in words and numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_gateway.present.queries import no_match_message, query_result, verdict_sentence
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import MapVerdict, SimilarityReply, SimilarityRequest, Verdict
from tests.gateway import fakes
from tests.gateway.fakes import STAMP_NS, FakeMapper


def nothing(floor: float, nearest: tuple[str, ...]) -> SimilarityReply:
    none = np.zeros((0, 4), np.float32)
    return SimilarityReply(
        text="yeti",
        revision=1,
        stamp_ns=1,
        encoder_id="e",
        centres_m=none[:, :2],
        extents_m=none,
        scores=none[:, 0],
        variances=none[:, 0],
        grid=fakes.GRID,
        scores_grid=np.zeros((0, 0), np.float32),
        floor=floor,
        nearest=nearest,
    )


def test_an_empty_reply_has_the_best_score_and_near_words() -> None:
    assert no_match_message(nothing(0.0, ())) == "Nothing on the map looks like 'yeti'."
    assert no_match_message(nothing(0.3, ())).endswith(
        "the best score is 0.00, and answers begin at 0.30."
    )
    assert no_match_message(nothing(0.0, ("bed",))).endswith("'yeti'. Did you mean 'bed'?")


@pytest.fixture
def sofa() -> SimilarityReply:
    return FakeMapper(MemoryRouter()).similarity(SimilarityRequest("sofa"))


def test_a_region_has_outline_view_and_time_or_null(sofa: SimilarityReply) -> None:
    first, second = query_result(sofa, STAMP_NS).regions
    assert first.outline_m == ((0.2, 1.0), (0.5, 1.0), (0.5, 1.3))
    assert first.last_seen_at == "2026-01-01T00:00:00.000Z"
    assert first.best_view is not None
    assert (first.best_view.x_m, first.best_view.yaw_rad) == (1.0, 0.5)
    assert (second.outline_m, second.last_seen_at, second.best_view) == ((), None, None)
    assert (first.height_m, second.height_m) == ((0.1, 0.9), None)


def test_a_verdict_says_how_much_was_looked_at(sofa: SimilarityReply) -> None:
    reply = query_result(sofa, STAMP_NS)
    assert reply.verdict == "found"
    assert reply.looked.share == 0.75
    assert (reply.looked.frontiers, reply.looked.frontier_m) == (1, (1.5, 0.5))


@pytest.mark.parametrize(
    ("verdict", "said"),
    [
        (MapVerdict(Verdict.FOUND, 6, 2), "'sofa' is at (0.35, 1.15) m, with the score 0.90."),
        (
            MapVerdict(Verdict.NOT_HERE, 9.96, 0.04),
            "'sofa' is not here: 99 % of the reachable area was looked at, and the best score is "
            "0.90.",
        ),
        (
            MapVerdict(Verdict.NOT_LOOKED_YET, 6, 2, 1, (1.5, 0.5)),
            "'sofa' was not seen, but only 75 % of the reachable area was looked at; look behind "
            "the frontier at (1.50, 0.50) m next.",
        ),
        (
            MapVerdict(Verdict.NOT_LOOKED_YET),
            "'sofa' was not seen, but only 0 % of the reachable area was looked at.",
        ),
    ],
)
def test_a_verdict_in_words(sofa: SimilarityReply, verdict: MapVerdict, said: str) -> None:
    assert verdict_sentence(replace(sofa, verdict=verdict)) == said
