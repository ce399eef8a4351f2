"""Standing queries: answers as they change, over interruptions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import islice
from typing import Any

import pytest

from onemap import Client, OneMapError, QueryInterrupted, QueryOptions, QueryResult, Retry
from onemap.connection import EventStreams
from tests.gateway.fakes import FakeMapper
from tests.shared.samples import PNG


class Streams:
    """A connection of which each stream is given: its body, or the error that ends it."""

    def __init__(self, *streams: bytes | OneMapError) -> None:
        self.paths: list[str] = []
        self.bodies: list[Mapping[str, Any] | None] = []
        self._streams = iter(streams)

    def stream(self, path: str, body: Mapping[str, Any] | None = None) -> Iterator[bytes]:
        self.paths.append(path)
        self.bodies.append(body)
        content = next(self._streams)
        if isinstance(content, OneMapError):
            raise content
        yield content


SOFA = b'event: answer\ndata: {"text": "sofa", "regions": [], "verdict": "not_here"}\n\n'
LOST = b'event: problem\ndata: {"detail": "The mapper is not running."}\n\n'
ODD = b"event: news\ndata: {}\n\nevent: answer\ndata: []\n\n"


def followed(*streams: bytes | OneMapError) -> tuple[Streams, Iterator[object], list[float]]:
    source, slept = Streams(*streams), list[float]()
    opened = EventStreams(source, Retry(0.5, attempts=2), slept.append)  # type: ignore[arg-type]
    return source, opened.follow("/events", "answer", QueryResult.of, {"text": "sofa"}), slept


def test_each_text_of_a_gateway_is_answered(client: Client, mapper: FakeMapper) -> None:
    options = QueryOptions(max_regions=1, negatives=("kettle",), area_m=(0, -1, 2, 3))
    sofa, kite = islice(client.follow_queries(["sofa", "kite"], options), 2)
    assert isinstance(sofa, QueryResult)
    assert isinstance(kite, QueryResult)
    assert (sofa.text, kite.text) == ("sofa", "kite")
    assert len(sofa.regions) == 1
    asked = mapper.asked[-1]
    assert (asked.negatives, asked.area_m) == (("kettle",), (0.0, -1.0, 2.0, 3.0))


def test_an_image_is_followed(client: Client, mapper: FakeMapper) -> None:
    options = QueryOptions(max_regions=1, area_m=(0, -1, 2, 3))
    answer = next(client.follow_image(PNG, options))
    assert isinstance(answer, QueryResult)
    assert (answer.text, answer.calibrated, len(answer.regions)) == ("image", False, 1)
    assert set(mapper.images) == {PNG}
    assert mapper.asked[-1].area_m == (0.0, -1.0, 2.0, 3.0)
    with pytest.raises(OneMapError, match="no PNG and no JPEG"):
        next(client.follow_image(b"GIF89a"))
    with pytest.raises(OneMapError, match="negatives"):
        next(client.follow_image(PNG, QueryOptions(negatives=("bed",))))


def test_a_stream_that_ends_is_opened_again() -> None:
    source, events, slept = followed(SOFA, LOST + SOFA)
    assert [str(next(events)) for _ in range(2)][1] == "The mapper is not running."
    assert isinstance(next(events), QueryResult)
    assert (source.paths, source.bodies) == (["/events"] * 2, [{"text": "sofa"}] * 2)
    assert slept == [0.5]


def test_a_gateway_that_stays_away_ends_it() -> None:
    away = OneMapError("No gateway.", status=503)
    _, events, slept = followed(away, away, away)
    assert next(events) == QueryInterrupted("No gateway.")
    with pytest.raises(OneMapError, match="No gateway"):
        next(events)
    assert slept == [0.5, 1.0]


def test_an_answer_that_cannot_be_read_is_named() -> None:
    with pytest.raises(OneMapError, match="same version"):
        next(followed(ODD)[1])
