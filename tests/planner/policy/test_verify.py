"""Walking up to a candidate: where to stand, when to believe it, when to leave it."""

from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.motion.pure_pursuit import Pose, Rest, Velocity
from onemap_planner.policy.context import Situation, take_in
from onemap_planner.policy.goals import Goal, GoalKind, Worth
from onemap_planner.policy.state import MAX_LOOKS, Mind, Quest, is_shunned, reconsider, shun
from onemap_planner.policy.step import Senses, think
from onemap_planner.policy.verify import _solid, approach, confirm, find_stand, latest, reject
from onemap_planner.search.phases import (
    Approaching,
    Confirmed,
    Confirming,
    Exploring,
    Moment,
    Over,
    Rejected,
)
from onemap_planner.search.state_machine import begin
from onemap_planner.world.candidates import Candidate
from onemap_shared.messages import SearchState
from tests.planner.drawn_maps import RULES, as_view, drawn

ROOM = as_view(drawn(*["#" * 8, *["#......#"] * 6, "#" * 8], scale=5))
POSE = Pose(1.0, 1.0, 0.0)
SEARCH = begin("id", ("sofa",), Moment(0.0, 0.0, (1.0, 1.0), 0.0), 0)


def candidate(x: float, y: float, sightings: int = 3) -> Candidate:
    cell = (int(x / 0.1), int(y / 0.1))
    return Candidate((x, y, 0.5), frozenset({cell}), sightings, 0.9, 0.8, ((1.0, 1.0),))


def mind(*candidates: Candidate, attentive_s: float = 0.0) -> Mind:
    return Mind(SEARCH, Quest(candidates=candidates), attentive_s=attentive_s)


def situation() -> Situation:
    return take_in(mind(), POSE, ROOM, RULES)


def test_it_stands_within_reach_of_the_surface() -> None:
    stand = find_stand(candidate(2.5, 2.5), situation(), RULES.explore)
    assert stand is not None
    away = np.hypot(stand[0] - 2.55, stand[1] - 2.55)
    assert RULES.explore.approach_nearest_m <= away <= RULES.explore.approach_farthest_m


def test_what_stands_deep_on_furniture_is_approached_as_near_as_possible() -> None:
    stand = find_stand(candidate(2.0, 3.9), situation(), RULES.explore)  # beyond the wall's face
    assert stand is not None
    assert np.hypot(stand[0] - 2.0, stand[1] - 3.9) < RULES.explore.approach_last_resort_m


def test_a_stray_cell_before_the_thing_does_not_keep_the_robot_away() -> None:
    thing = frozenset((x, y) for x in (24, 25) for y in (24, 25))
    stray = thing | {(17, 19)}  # towards the robot
    seen = replace(candidate(2.5, 2.5), cells=stray, recent=(stray, *[thing] * 8))
    stand = find_stand(seen, situation(), RULES.explore)
    assert stand is not None
    assert np.hypot(stand[0] - 2.45, stand[1] - 2.45) < 1.5


def test_nowhere_to_stand_is_waited_for_and_then_rejected() -> None:
    far = candidate(9.0, 9.0)
    assert find_stand(far, situation(), RULES.explore) is None
    after, motion, event = approach(mind(far), Approaching(far), situation(), RULES)
    assert (motion, event) == (Rest(), None)
    later = replace(after, attentive_s=RULES.explore.settle_s + 0.1)
    after, _, event = approach(later, Approaching(far), situation(), RULES)
    assert event == Rejected()
    assert after.quest.candidates == ()
    assert after.quest.rejected == (far,)


def test_the_candidate_is_followed_when_sightings_move_it() -> None:
    old = candidate(2.0, 2.0)
    moved = replace(candidate(2.3, 2.0, 5), cells=frozenset({(1, 1)}))
    shares = replace(candidate(4.0, 4.0), cells=old.cells)
    assert latest(mind(moved), old, RULES.consensus) == moved
    assert latest(mind(moved, shares), old, RULES.consensus) == shares
    assert latest(mind(candidate(4.0, 4.0)), old, RULES.consensus) == old


@pytest.mark.parametrize(("more", "sure"), [(5, False), (6, True)])
def test_enough_new_detections_confirm(more: int, sure: bool) -> None:
    then = candidate(2.0, 2.0, 4)
    now = replace(then, sightings=4 + more)
    _, _, event = confirm(mind(now), Confirming(then, 0.0), situation(), RULES)
    assert event == (Confirmed(now) if sure else None)


def test_without_them_it_is_rejected_after_a_while() -> None:
    then = candidate(2.0, 2.0)
    waited = mind(then, attentive_s=RULES.explore.confirm_s + 0.1)
    after, _, event = confirm(waited, Confirming(then, 0.0), situation(), RULES)
    assert event == Rejected()
    assert after.quest.rejected == (then,)


def stuck(phase: Approaching | Exploring, bumps: int) -> Mind:
    """The mind after this many collisions in one place, five seconds apart."""
    state = replace(mind(candidate(2.5, 2.5)), search=replace(SEARCH, phase=phase))
    for number in range(8 * bumps + 5):
        senses = Senses(
            now_s=0.7 * number,
            pose=POSE,
            odometer_m=0.0,
            command=Velocity(0.3, 0.0),
            collided=number % 8 == 7,
            view=ROOM,
            detections=(),
            complaint="",
        )
        state, _ = think(state, senses, RULES)
    return state


def test_bumps_give_up_the_candidate_and_a_robot_that_is_held_gives_up() -> None:
    target = candidate(2.5, 2.5)
    left = stuck(Approaching(target), RULES.recovery.max_bumps)
    assert left.quest.rejected == (target,) or left.quest.reconsidered
    end = stuck(Approaching(target), RULES.recovery.max_bumps + 2).search
    assert end.phase == Over(SearchState.FAILED)
    assert end.reason == "the robot is stuck at (1.0, 1.0)"


def goal(kind: GoalKind) -> Goal:
    return Goal(kind, (0.0, 0.0), (1.0, 1.0), Worth(0.5, 0.0, 1.0, 0.0), "")


@pytest.mark.parametrize(
    ("kind", "looks"),
    [(GoalKind.FRONTIER, 1), (GoalKind.REGION, MAX_LOOKS), (GoalKind.DETECTION, MAX_LOOKS)],
)
def test_goals_that_come_to_nothing_are_left_alone(kind: GoalKind, looks: int) -> None:
    state = mind()
    for _ in range(looks):
        assert not is_shunned(state, goal(kind), 0.5)
        state = shun(state, goal(kind))
    assert is_shunned(state, goal(kind), 0.5)


def test_what_was_rejected_gets_one_more_chance() -> None:
    state = reject(mind(candidate(2.5, 2.5)), candidate(2.5, 2.5))
    again = reconsider(state)
    assert again.quest.rejected == ()
    assert again.quest.reconsidered


def test_floor_before_a_thing_is_not_taken_for_its_surface() -> None:
    """A detection's rim lies on the floor; the stand keeps its distance from what stands there."""
    here = situation()
    solid = np.argwhere(here.terrain.occupied)
    free = np.argwhere(~here.terrain.occupied)
    both = np.concatenate([free[:3], solid[:2]])
    np.testing.assert_array_equal(_solid(both, here.terrain), solid[:2])
    np.testing.assert_array_equal(_solid(free[:3], here.terrain), free[:3])
