"""Faults by seed: plans, making them small, seeds that hold, and that each rule sees a defect."""

from __future__ import annotations

from collections.abc import Callable
from datetime import date

import pytest

from onemap_mapper.storage.kept import Kept
from onemap_planner.followed_places import FollowedPlaces
from onemap_planner.inputs import LatestInputs
from onemap_planner.planning_thread import PlanningThread
from onemap_planner.service import Planner
from onemap_shared.command_gate import Deadman
from onemap_tools.bench.faults import run
from onemap_tools.bench.faults.plan import FaultPlan, Incident, drawn, shrunk
from onemap_tools.bench.faults.run import run_plan

APARTMENT = 1
TODAY = date.today().toordinal()

Plant = Callable[[pytest.MonkeyPatch], None]


def plan_of(*incidents: Incident) -> FaultPlan:
    return FaultPlan(1, APARTMENT, incidents)


def test_a_plan_is_of_its_seed() -> None:
    plans = [drawn(seed) for seed in range(50)]
    assert plans == [drawn(seed) for seed in range(50)]
    assert len({incident.kind for plan in plans for incident in plan.incidents}) > 10


def test_a_plan_that_fails_is_made_as_small_as_it_can_be() -> None:
    killed = Incident("kill", 5.0, "mapper", 8.0)
    plan = plan_of(Incident("clock", 4.0, "all", 1.0, 60.0), killed, Incident("zone", 9.0))

    def fails(tried: FaultPlan) -> bool:
        return any(each.kind == "kill" and each.lasts_s >= 2.0 for each in tried.incidents)

    (left,) = shrunk(plan, fails).incidents
    assert (left.kind, left.lasts_s) == ("kill", 2.0)


def endless_command(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(Deadman, "command_at", lambda deadman, _: deadman.command)


def nothing_is_stale(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(LatestInputs, "stale_reason", lambda *_: "")
    patch.setattr(PlanningThread, "_request_view", kept_view)


_asked = PlanningThread._request_view
_views: dict[int, object] = {}


def kept_view(thread: PlanningThread, state: object) -> object:
    """The newest view that ever came, if none comes."""
    try:
        _views[id(thread)] = _asked(thread, state)  # type: ignore[arg-type]
    except Exception:
        if id(thread) not in _views:
            raise
    return _views[id(thread)]


def a_step_fails(patch: pytest.MonkeyPatch) -> None:
    def log_refused(planner: Planner) -> None:
        if planner._registry.state is not None and planner._sent > 50:
            raise RuntimeError("planted")

    patch.setattr(Planner, "_log_refused", log_refused)


def a_thread_fails(patch: pytest.MonkeyPatch) -> None:
    def detections(thread: PlanningThread) -> tuple[()]:
        raise RuntimeError("planted")

    patch.setattr(PlanningThread, "_new_detections", detections)


def zones_are_not_followed(patch: pytest.MonkeyPatch) -> None:
    def follow(places: FollowedPlaces, inputs: LatestInputs, *_: object) -> str:
        places.version = inputs.places_version
        return ""

    patch.setattr(FollowedPlaces, "follow", follow)


def nothing_is_written(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(Kept, "_write", lambda *_: None)


ZONE = Incident("zone", 12.0)
PLANTED: list[tuple[str, Plant, tuple[Incident, ...]]] = [
    ("request", endless_command, (Incident("kill", 12.0, "planner", 4.0),)),
    ("age", nothing_is_stale, (Incident("kill", 12.0, "mapper", 8.0),)),
    ("exit", a_step_fails, ()),
    ("crash", a_thread_fails, ()),
    ("zone", zones_are_not_followed, (ZONE,)),
    ("kept", nothing_is_written, (ZONE, Incident("kill", 16.0, "mapper", 1.0))),
]


@pytest.mark.slow
@pytest.mark.parametrize(("rule", "plant", "incidents"), PLANTED)
def test_a_planted_defect_breaks_its_rule(
    rule: str, plant: Plant, incidents: tuple[Incident, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run, "SEARCHES_UNTIL_S", 20.0)
    monkeypatch.setattr(run, "OBJECT_LIMIT_S", 10.0)
    monkeypatch.setattr("onemap_tools.bench.faults.rules.MAX_REST_S", 20.0)
    plant(monkeypatch)
    found = run_plan(plan_of(*incidents))
    assert rule in {each.rule for each in found.broken}


@pytest.mark.slow
@pytest.mark.parametrize("seed", [*range(1, 5), *range(4 * TODAY, 4 * TODAY + 4)])
def test_the_rules_hold(seed: int) -> None:
    """Those of the day are others tomorrow: a failure names its seed."""
    assert run_plan(drawn(seed)).broken == ()
