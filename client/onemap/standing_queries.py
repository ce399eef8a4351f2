"""Standing queries: answers that come again whenever they change."""
# Talks: waits before it connects again.

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlencode

from onemap.connection import Connection
from onemap.errors import OneMapError
from onemap.events import StreamMessage, stream_messages
from onemap.queries import QueryOptions, QueryResult
from onemap.remote_search import Retry

ADDRESS = "/v1/queries/events"


@dataclass(frozen=True, slots=True)
class QueryInterrupted:
    """There are no answers at the moment; ``detail`` is a sentence that says why."""

    detail: str

    def __str__(self) -> str:
        """The sentence."""
        return self.detail


QueryEvent = QueryResult | QueryInterrupted


class StandingQueries:
    """Streams of answers; an interrupted one is opened again, as that of a search."""

    def __init__(
        self, connection: Connection, retry: Retry, sleep: Callable[[float], None] = time.sleep
    ) -> None:
        self._connection = connection
        self._retry = retry
        self._sleep = sleep

    def events(self, texts: tuple[str, ...], options: QueryOptions) -> Iterator[QueryEvent]:
        """The answer to each text, and again whenever its verdict or its regions change.

        Raises OneMapError if the question is refused or the gateway stays away (see ``Retry``).
        """
        return self._events(_path(texts, options), None)

    def image_events(self, image: bytes, options: QueryOptions) -> Iterator[QueryEvent]:
        """The same for what a PNG or JPEG shows."""
        return self._events(ADDRESS, options.image_body(image))

    def _events(self, path: str, body: Mapping[str, Any] | None) -> Iterator[QueryEvent]:
        failures = 0
        while True:
            try:
                with closing(self._connection.stream(path, body)) as chunks:
                    for message in stream_messages(chunks):
                        failures = 0
                        if (event := _event(message)) is not None:
                            yield event
            except OneMapError as error:
                failures += 1
                if not error.temporary or failures > self._retry.attempts:
                    raise
                if failures == 1:
                    yield QueryInterrupted(error.detail)
            self._sleep(self._retry.delay_s(failures))


def _path(texts: tuple[str, ...], options: QueryOptions) -> str:
    asked = [("text", text) for text in texts]
    asked += [("negative", text) for text in options.negatives]
    if options.area_m is not None:
        asked.append(("area_m", ",".join(map(str, options.area_m))))
    asked.append(("max_regions", str(options.max_regions)))
    return f"{ADDRESS}?{urlencode(asked)}"


def _event(message: StreamMessage) -> QueryEvent | None:
    """The event of a message; None if it is of an unknown kind."""
    try:
        if message.event == "answer":
            return QueryResult.of(json.loads(message.data))
        if message.event == "problem":
            return QueryInterrupted(str(json.loads(message.data)["detail"]))
    except (ValueError, TypeError, KeyError, AttributeError) as problem:
        raise OneMapError(
            f"An answer cannot be read: {message.data[:100]!r}. Do client and gateway have the "
            "same version?"
        ) from problem
    return None
