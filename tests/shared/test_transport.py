"""Inboxes keep the newest packets and count the others; handlers' errors reach the caller."""

from __future__ import annotations

import dataclasses

import pytest

from onemap_shared.messages import Odometry
from onemap_shared.transport import Inbox
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
    inbox = Inbox(Odometry, capacity)
    for sequence in range(1, 6):
        inbox.put(odometry(sequence))
    assert taken(inbox) == kept
    assert (inbox.counters.received, inbox.counters.skipped) == (len(kept), 5 - len(kept))


def test_gaps_in_the_sequence_are_missed_and_a_restart_is_none() -> None:
    inbox = Inbox(Odometry, 9)
    for sequence in (7, 8, 12, 1, 2):
        inbox.put(odometry(sequence))
    assert taken(inbox) == [7, 8, 12, 1, 2]
    assert inbox.counters.missed == 3
    assert inbox.counters.disordered == 1


def test_bad_packets_are_counted_and_passed_over() -> None:
    inbox = Inbox(Odometry, 3)
    inbox.put(GARBAGE)
    inbox.put(odometry(1))
    inbox.put(GARBAGE)
    assert taken(inbox) == [1]
    assert (inbox.counters.refused, inbox.counters.received) == (2, 1)
    assert "lacks schema" in inbox.counters.last_problem
