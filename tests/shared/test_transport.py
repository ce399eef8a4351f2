"""Inboxes keep the newest packets and count the others; what a process logs is bounded."""

from __future__ import annotations

import dataclasses
import io
import logging
import math
from collections.abc import Callable, Iterator

import pytest

from onemap_shared import keys
from onemap_shared.clock import SystemClock
from onemap_shared.log import MAX_CHARS, PERIOD_S, LogLimit
from onemap_shared.messages import Odometry, SearchRequest, SearchStatus
from onemap_shared.supervisor import start_hint
from onemap_shared.transport import Inbox, RemoteError, RequestRejected, answer
from onemap_shared.wire import Packet, encode
from tests.shared.samples import sample

GARBAGE = Packet(b"?", b"")


def odometry(sequence: int) -> Packet:
    return encode(dataclasses.replace(sample(Odometry), sequence=sequence))


def taken(inbox: Inbox[Odometry]) -> list[int]:
    sequences = []
    while (message := inbox.take(0.0)) is not None:
        sequences.append(message.sequence)
    return sequences


@pytest.mark.parametrize(("capacity", "kept"), [(1, [5]), (3, [3, 4, 5]), (9, [1, 2, 3, 4, 5])])
def test_the_newest_are_kept_in_order(capacity: int, kept: list[int]) -> None:
    inbox = Inbox(Odometry, capacity, SystemClock())
    for sequence in range(1, 6):
        inbox.put(odometry(sequence))
    assert taken(inbox) == kept
    assert (inbox.counters.received, inbox.counters.skipped) == (len(kept), 5 - len(kept))


def test_gaps_in_the_sequence_are_missed_and_a_restart_is_none() -> None:
    inbox = Inbox(Odometry, 9, SystemClock())
    for sequence in (7, 8, 12, 1, 2):
        inbox.put(odometry(sequence))
    assert taken(inbox) == [7, 8, 12, 1, 2]
    assert inbox.counters.missed == 3
    assert inbox.counters.disordered == 1


def test_bad_packets_are_counted_and_passed_over() -> None:
    inbox = Inbox(Odometry, 3, SystemClock())
    inbox.put(GARBAGE)
    inbox.put(odometry(1))
    inbox.put(GARBAGE)
    assert taken(inbox) == [1]
    assert (inbox.counters.refused, inbox.counters.received) == (2, 1)
    assert "lacks schema" in inbox.counters.last_problem


LOG = logging.Logger("onemap.test_log_limit", logging.INFO)  # of this module alone


@pytest.fixture
def now_s() -> list[float]:
    return [100.0]


@pytest.fixture
def lines(now_s: list[float]) -> Iterator[Callable[[], list[str]]]:
    stream = io.StringIO()
    handler = logging.StreamHandler(stream)
    handler.addFilter(LogLimit(lambda: now_s[0]))
    LOG.addHandler(handler)
    yield lambda: stream.getvalue().splitlines()
    LOG.removeHandler(handler)


def test_ten_minutes_of_bad_messages_is_one_line_in_ten_seconds(
    lines: Callable[[], list[str]], now_s: list[float]
) -> None:
    for index in range(47 * 600):
        now_s[0] = 100 + index / 47
        LOG.warning("message refused: %s", f"{index} " + "x" * 5000)
    logged = lines()
    assert len(logged) == pytest.approx(600 / PERIOD_S, abs=1)
    assert logged[0].startswith("message refused: 0 x")
    assert logged[1].endswith("(and 469 more before)")
    assert sum(map(len, logged)) < 1.1 * MAX_CHARS * len(logged)


def test_kinds_do_not_silence_each_other(lines: Callable[[], list[str]]) -> None:
    for stream in ("odometry", "rgbd"):
        LOG.warning(f"{stream}: refused %s", "a")
        LOG.warning(f"{stream}: refused %s", "b")
    assert lines() == ["odometry: refused a", "rgbd: refused a"]


@pytest.mark.parametrize(
    ("variables", "hint"),
    [
        ({}, "'onemap service planner' and the same --config"),
        ({"ONEMAP_SUPERVISOR": "systemd"}, "'systemctl start onemap-planner'"),
        ({"ONEMAP_SUPERVISOR": "compose"}, "'docker compose -p onemap start planner'"),
        ({"ONEMAP_LAUNCHED": "router planner"}, "it is started again by itself"),
        ({"ONEMAP_LAUNCHED": "router mapper"}, "'onemap service planner'"),
    ],
)
def test_a_hint_names_the_command_that_works_here(
    variables: dict[str, str], hint: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("ONEMAP_SUPERVISOR", "ONEMAP_LAUNCHED"):
        monkeypatch.setenv(name, variables.get(name, ""))
    assert hint in start_hint("planner")


def test_a_search_ages_while_it_waits_for_its_turn() -> None:
    """A stop that came meanwhile holds for it too."""
    asked = list[SearchRequest]()

    def start(request: SearchRequest) -> SearchStatus:
        asked.append(request)
        raise RequestRejected("stopped", "it was stopped")

    request = encode(SearchRequest(("sofa",), patience_s=2.0, age_s=1.0))
    with pytest.raises(RemoteError, match="it was stopped"):
        answer(keys.SEARCH_START, start, request, waited_s=0.25, patience_s=math.inf)
    assert asked == [SearchRequest(("sofa",), patience_s=1.75, age_s=1.25)]
