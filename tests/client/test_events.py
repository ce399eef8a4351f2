"""The format of server-sent events."""

from __future__ import annotations

import itertools

from hypothesis import given
from hypothesis import strategies as st

from onemap.events import StreamMessage, search_event, stream_messages

STREAM = (
    b": ping\n\nretry: 2000\nevent: status\ndata: {}\n\n"
    b"data: one\r\ndata:two\r\n\r\nevent: problem\n\nevent: cut"
)
MESSAGES = [StreamMessage("status", "{}"), StreamMessage("message", "one\ntwo")]


def test_comments_and_what_was_cut_off_are_ignored() -> None:
    assert list(stream_messages([STREAM])) == MESSAGES


@given(st.lists(st.integers(0, len(STREAM)), max_size=8))
def test_messages_do_not_depend_on_how_the_bytes_arrive(cuts: list[int]) -> None:
    places = [0, *sorted(cuts), len(STREAM)]
    chunks = [STREAM[a:b] for a, b in itertools.pairwise(places)]
    assert list(stream_messages(chunks)) == MESSAGES


def test_a_line_separator_inside_a_text_ends_no_line() -> None:
    assert [m.data for m in stream_messages(["data: a\u2028b\x85c\n\n".encode()])] == [
        "a\u2028b\x85c"
    ]


def test_an_unknown_kind_of_event_is_none() -> None:
    assert search_event(StreamMessage("weather", "{}")) is None
