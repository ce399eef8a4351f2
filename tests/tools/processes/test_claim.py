"""Which launchers and services conflict on one bus."""

from __future__ import annotations

import pytest

from onemap_tools.processes.claim import claim, conflicts


def test_a_service_that_runs_or_is_claimed_conflicts() -> None:
    own, other = claim(("mapper", "gateway")), claim(("simulator", "mapper"))
    processes = {("up", own), ("doctor", "d1"), ("planner", "p1")}
    assert conflicts(processes, own) == ()
    assert conflicts({*processes, ("mapper", "m1")}, own) == ("mapper",)
    assert conflicts({*processes, ("up", other)}, own) == ("mapper",)  # before its mapper is there
    assert conflicts({*processes, ("up", claim(("router", "simulator")))}, own) == ()


@pytest.mark.parametrize("robot", ["simulator", "replay", "robot"])
def test_a_map_follows_one_robot(robot: str) -> None:
    assert conflicts({(robot, "x")}, claim(("replay", "mapper"))) == (robot,)
    assert conflicts({(robot, "x")}, claim(("mapper",))) == ()


def test_two_claims_of_the_same_services_differ() -> None:
    assert claim(("mapper",)) != claim(("mapper",))
