"""A robot over a slow link: it stops, and the planner knows why. In simulated time."""

from __future__ import annotations

from typing import ClassVar

import pytest

from onemap_planner.motion.staleness import StalenessParams
from onemap_planner.policy.params import PlannerParams
from tests.end_to_end.delayed_link import drive

LIMIT_S = PlannerParams().staleness.max_loop_s


class Blind(StalenessParams):
    """As before the loop was measured."""

    max_odometry_delay_s: ClassVar[float] = 1e9


BLIND = Blind(max_loop_s=1e9)
CONTROL_S = 0.05
CENTIMETRE = 0.01  # of rounding: the monitor's slack, and steps of the physics


@pytest.mark.parametrize("delay_s", [0.6, 1.5])
def test_a_delay_that_was_always_there_keeps_the_robot_standing(delay_s: float) -> None:
    outcome = drive(lambda _: delay_s, duration_s=15.0)
    assert outcome.moving_s == []
    assert outcome.driven_m == 0.0
    assert outcome.reason == (
        f"waiting for the robot: a command takes longer than {LIMIT_S:g} s there and back"
    )


@pytest.mark.parametrize("delay_s", [0.6, 1.5])
@pytest.mark.parametrize("begins_s", [4.0, 7.5])  # in the room, and short of the wall
def test_a_delay_that_begins_stops_the_robot_before_the_wall(
    delay_s: float, begins_s: float
) -> None:
    outcome = drive(lambda now_s: delay_s if now_s >= begins_s else 0.02, duration_s=15.0)
    assert outcome.driven_m > 1.0
    assert [at_s for at_s in outcome.moving_s if at_s > begins_s + LIMIT_S + CONTROL_S] == []
    assert outcome.collisions == 0


def test_the_wall_is_hit_where_nobody_measures_the_loop() -> None:
    """The defect that the tests above look for: they see it."""
    outcome = drive(lambda _: 0.6, echoes=False, checks=False, staleness=BLIND)
    assert outcome.collisions > 0
    assert len(outcome.moving_s) > 500  # of 600
    assert outcome.reason == ""


@pytest.mark.parametrize("delay_s", [0.05, 0.25])
def test_over_a_link_within_the_limit_a_wrong_plan_hits_no_wall(delay_s: float) -> None:
    """The monitor stops the robot where it will be, not where odometry last said it was."""
    outcome = drive(lambda _: delay_s)
    assert outcome.driven_m > 10.0
    assert outcome.collisions == 0
    assert outcome.late == 0


@pytest.mark.parametrize(
    ("delay_s", "echoes"), [(0.0, True), (0.02, True), (0.1, True), (0.25, True), (0.02, False)]
)
def test_whichever_command_is_the_last_the_robot_stands_before_the_wall(
    delay_s: float, echoes: bool
) -> None:
    """As if planner or router were killed after it."""
    outcome = drive(lambda _: delay_s, duration_s=16.0, echoes=echoes, dies=True)
    assert outcome.driven_m > 5.0
    assert outcome.left_m > -CENTIMETRE


@pytest.mark.parametrize("held_s", [0.4, 0.5])
def test_commands_that_a_link_held_back_drive_no_robot_that_has_braked(held_s: float) -> None:
    """It stands elsewhere than the planner took it to be when it made them."""
    outcome = drive(lambda at_s: 0.02 + max(held_s - at_s % 1.0, 0.0), duration_s=16.0, dies=True)
    assert outcome.driven_m > 5.0
    assert outcome.left_m > -CENTIMETRE
    assert outcome.late > 0


def test_the_robot_drives_again_once_the_link_is_fast() -> None:
    outcome = drive(lambda now_s: 1.0 if 4.0 <= now_s < 10.0 else 0.02, duration_s=20.0)
    assert any(at_s > 12.0 for at_s in outcome.moving_s)
    assert outcome.collisions == 0
    assert outcome.reason == ""


def test_a_robot_that_names_no_command_is_judged_by_its_odometry() -> None:
    outcome = drive(
        lambda now_s: 1.0 if now_s >= 4.0 else 0.02, duration_s=15.0, echoes=False, checks=False
    )
    assert [at_s for at_s in outcome.moving_s if at_s > 4.0 + LIMIT_S] == []
    assert outcome.reason == "waiting for the robot's position: 1.0 s behind"
    assert outcome.collisions == 0


def test_the_robot_checks_the_age_of_commands_itself() -> None:
    """Under a planner that measures nothing."""
    outcome = drive(lambda _: 0.6, duration_s=15.0, staleness=BLIND, echoes=False)
    assert len(outcome.moving_s) > 200
    assert outcome.late > 200
    assert outcome.driven_m == 0.0
