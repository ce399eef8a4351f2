"""A search goes on by itself only if the planner alone was away, and not for long."""

from dataclasses import replace
from itertools import product
from math import inf, nan
from typing import Any

import pytest

from onemap_planner.search.journal import (
    MAX_AWAY_S,
    MAX_MOVED_M,
    Surroundings,
    interrupted_reason,
    interruption,
)
from onemap_planner.search.state_machine import new_search
from onemap_shared.messages import ObjectResult, SearchState
from tests.planner.search.test_journal import THEN

BEFORE = Surroundings("r1", "boot", 1000.0, "ros2 i1", "m1", 70, (1.0, 2.0))
NOW = replace(BEFORE, boot_s=1005.0, odometry=90, xy_m=(1.5, 2.0))

# Each value of each fact, and whether a search may go on with it.
FACTS: dict[str, tuple[tuple[Any, bool], ...]] = {
    "namespace": (("r1", True), ("r2", False), ("", False)),
    "boot_id": (("boot", True), ("later", False), ("", False)),
    "boot_s": (
        (1000.0, True),
        (1000.0 + MAX_AWAY_S, True),
        (1001.0 + MAX_AWAY_S, False),
        (999.0, False),  # a clock that went back
        (nan, False),
        (inf, False),
    ),
    "robot": (("ros2 i1", True), ("ros2 i2", False), ("replay i1", False)),
    "map_id": (("m1", True), ("m2", False)),
    "odometry": ((70, True), (71, True), (69, False), (0, False)),
    "xy_m": (
        ((1.0, 2.0), True),
        ((1.0, 2.0 + MAX_MOVED_M), True),
        ((1.0, 2.1 + MAX_MOVED_M), False),
        ((nan, 2.0), False),
    ),
}


def test_every_combination() -> None:
    for chosen in product(*FACTS.values()):
        now = Surroundings(**{name: value for name, (value, _) in zip(FACTS, chosen, strict=True)})
        goes_on = all(may for _, may in chosen)
        assert (interruption(BEFORE, now) == "") is goes_on, now
        assert now.known


@pytest.mark.parametrize(
    "unknown", [{"robot": ""}, {"map_id": ""}, {"odometry": -1}, {"xy_m": None}, {"boot_id": ""}]
)
def test_what_is_not_known_never_moves_a_robot(unknown: dict[str, Any]) -> None:
    assert interruption(replace(BEFORE, **unknown), NOW)
    now = replace(NOW, **unknown)
    assert not now.known or interruption(BEFORE, now)


def test_the_reason_says_when_and_what_was_found() -> None:
    search = new_search("id", ("bed", "cup"), THEN, 7)
    bed = ObjectResult("bed", SearchState.FOUND, "", (), 0.9, 1.0, 1.0, (), ())
    search = replace(search, results=(bed,), index=1)
    said = interrupted_reason(search, "the map is another one", 1_700_000_000 * 10**9)
    assert said == (
        "interrupted at 2023-11-14 22:13:20 UTC: the map is another one; found before: bed"
    )
