"""Faults by seed: plans, making them small, seeds that hold, and that each rule sees a defect."""

from __future__ import annotations

import pytest

from onemap_tools.bench.faults import run
from onemap_tools.bench.faults.plan import FaultPlan, Incident, drawn, shrunk
from onemap_tools.bench.faults.run import run_plan
from tests.tools.bench.faults.planted import DEFECTS

APARTMENT = 1


def plan_of(*incidents: Incident) -> FaultPlan:
    return FaultPlan(1, APARTMENT, incidents, 12.0)


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


ZONE = Incident("zone", 8.0)
TORN = Incident("disk torn", 10.0, "places.bin", 0.1, 0.5)
APART = (Incident("kill", 4.9, "planner", 6.8), Incident("router", 5.4, "", 7.2))
# Which plan finds each; the seeds that found the others are in docs/reliability.md.
PLANS: list[tuple[str, tuple[Incident, ...]]] = [
    ("endless command", (Incident("kill", 8.0, "planner", 4.0),)),
    ("nothing is stale", (Incident("kill", 8.0, "mapper", 8.0),)),
    ("straight on", ()),
    ("a step fails", ()),
    ("zones are not followed", (ZONE,)),
    ("unreadable is empty", (ZONE, TORN)),
    ("said once", APART),
    ("cancelled later", (Incident("cancel", 8.0),)),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "incidents"), PLANS)
def test_a_planted_defect_breaks_its_rule(
    name: str, incidents: tuple[Incident, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run, "OBJECT_LIMIT_S", 10.0)
    monkeypatch.setattr(run, "MAX_REST_S", 20.0)
    defect = next(each for each in DEFECTS if each.name == name)
    defect.plant(monkeypatch)

    def over(tried: run._Run) -> bool:
        return tried._done or any(each.rule == defect.rule for each in tried.rules.broken)

    monkeypatch.setattr(run._Run, "over", over)  # as soon as it is seen
    found = run_plan(plan_of(*incidents))
    assert defect.rule in {each.rule for each in found.broken}


# Shrunk plans of seeds that broke a rule before it was mended: seed, apartment, until when a user
# asks, and what happens.
FOUND = [
    # 45: a planner that found the router before the gateway told it in vain what a kill had ended.
    FaultPlan(45, 4, APART, 6.7),
]


@pytest.mark.slow
@pytest.mark.parametrize("plan", FOUND, ids=lambda plan: str(plan.seed))
def test_what_was_found_is_mended(plan: FaultPlan) -> None:
    assert run_plan(plan).broken == ()


@pytest.mark.slow
def test_the_rules_hold() -> None:
    """Of a plan with a cut link, a stream that stands still, a power loss and a zone."""
    plan = drawn(23)
    assert {each.kind for each in plan.incidents} == {"stall", "frozen", "power", "zone"}
    assert run_plan(plan).broken == ()
