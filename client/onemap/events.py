"""Server-sent events: their format, and what they say of a search."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from onemap.errors import OneMapError
from onemap.replies import SearchSnapshot


@dataclass(frozen=True, slots=True)
class SearchChanged:
    """The search is in another state, or has another result."""

    search: SearchSnapshot

    def __str__(self) -> str:
        """One line for people: object or place, state, reason."""
        return f"{self.search.subject}: {self.search.state}: {self.search.reason}"


@dataclass(frozen=True, slots=True)
class SearchInterrupted:
    """The search cannot be followed at the moment; ``detail`` is a sentence that says why."""

    detail: str

    def __str__(self) -> str:
        """The sentence."""
        return self.detail


SearchEvent = SearchChanged | SearchInterrupted


@dataclass(frozen=True, slots=True)
class StreamMessage:
    """One message of an event stream, as it came."""

    event: str
    data: str


def stream_messages(chunks: Iterable[bytes]) -> Iterator[StreamMessage]:
    """The messages of a ``text/event-stream``; lines end with LF or CR LF.

    Comments, and fields other than ``event`` and ``data``, are ignored. A message that was cut off
    is not complete, and left out.
    """
    event, data = "", list[str]()
    for line in _lines(chunks):
        name, _, value = line.partition(":")
        value = value.removeprefix(" ")
        if not line and data:
            yield StreamMessage(event or "message", "\n".join(data))
        if not line:
            event, data = "", []
        elif name == "event":
            event = value
        elif name == "data":
            data.append(value)


def _lines(chunks: Iterable[bytes]) -> Iterator[str]:
    """Complete lines. Splitting bytes leaves line separators inside a text, such as U+2028, be."""
    rest = b""
    for chunk in chunks:
        *lines, rest = (rest + chunk).split(b"\n")
        yield from (line.removesuffix(b"\r").decode("utf-8", "replace") for line in lines)


def search_event(message: StreamMessage) -> SearchEvent | None:
    """The event of a search in this message; None if it is of an unknown kind."""
    try:
        if message.event == "status":
            return SearchChanged(SearchSnapshot.of(json.loads(message.data)))
        if message.event == "problem":
            return SearchInterrupted(str(json.loads(message.data)["detail"]))
    except (ValueError, TypeError, KeyError, AttributeError) as problem:
        raise OneMapError(
            f"An event of the search cannot be read: {message.data[:100]!r}. Do client and gateway "
            "have the same version?"
        ) from problem
    return None
