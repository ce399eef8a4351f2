"""A robot over slow links, under a plan that drives through walls; in simulated time."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_planner.policy.step import PlannerParams
from tests.chaos.report import Attack
from tests.end_to_end.delayed_link import Outcome, drive

STOPS_S = PlannerParams().staleness.max_loop_s + 0.05  # and one control period
BEGINS_S = np.arange(2.0, 14.0, 1.0)


def summary(outcomes: list[Outcome], late: int) -> str:
    driven_m = sum(outcome.driven_m for outcome in outcomes)
    hits = sum(outcome.collisions for outcome in outcomes)
    return f"{late} commands, {hits} collisions in {driven_m:.0f} m"


@pytest.mark.parametrize("delay_s", [0.6, 1.0, 1.5])
def test_a_slow_link(attack: Attack, delay_s: float) -> None:
    always = drive(lambda _: delay_s)
    attack.holds(
        f"{delay_s:g} s each way from the start",
        limit="0 commands that move, 0 collisions",
        measured=summary([always], len(always.moving_s)),
        held=not always.moving_s and always.collisions == 0,
    )
    outcomes, late = [], 0
    for begins_s in BEGINS_S:
        outcome = drive(lambda s, b=begins_s: delay_s if s >= b else 0.02, duration_s=16.0)  # type: ignore[misc]
        late += sum(at_s > begins_s + STOPS_S for at_s in outcome.moving_s)
        outcomes.append(outcome)
    attack.holds(
        f"{delay_s:g} s each way that begin on the way, {len(outcomes)} times",
        limit=f"0 commands that move {STOPS_S:g} s later, 0 collisions",
        measured=summary(outcomes, late),
        held=late == 0 and not any(outcome.collisions for outcome in outcomes),
    )


def test_a_link_within_the_limit(attack: Attack) -> None:
    outcomes = [drive(lambda _, d=delay_s: d) for delay_s in np.arange(0.0, 0.28, 0.03)]  # type: ignore[misc]
    attack.holds(
        f"a wrong plan at walls over 0 to 0.27 s each way, {len(outcomes)} drives",
        limit="0 collisions",
        measured=summary(outcomes, sum(len(outcome.moving_s) for outcome in outcomes)),
        held=not any(outcome.collisions for outcome in outcomes),
    )
