"""The message shows goal, path, frontiers and regions of the present decision."""

import pytest

from onemap_planner.planning_thread import planned_path
from onemap_planner.search.phases import Destination, Exploring
from onemap_shared.messages import SearchKind
from tests.planner.grid_world import in_four_rooms, in_two_rooms, start, start_drive


@pytest.mark.slow
def test_the_message_shows_the_goal_of_each_phase() -> None:
    run = start(in_four_rooms(), "sofa")
    kinds, motions = set(), set()
    while run.state.search.active and run.now_s < 300.0:
        run.step()
        shown = planned_path(run.state.search, run.decision, 5)
        kinds.add(shown.goal_kind)
        assert len(shown.goal_m) == (shown.goal_kind != "none")
        assert shown.goal_reason
        motions.add(shown.motion)
        assert bool(shown.look_m) == (shown.motion == "drive")
        if isinstance(run.state.search.phase, Exploring) and run.decision is not None:
            assert len(shown.frontiers_m) == len(run.decision.goal_candidates.frontiers)
    assert {"none", "frontier", "detection"} <= kinds
    assert {"drive", "rotate"} <= motions <= {"", "drive", "rotate", "rest", "reverse"}
    over = planned_path(run.state.search, None, 5)
    assert (over.goal_kind, len(over.points_m)) == ("none", 0)


def test_the_message_of_a_drive_names_its_kind() -> None:
    run = start_drive(in_two_rooms(), Destination(SearchKind.GO_TO, (2.0, 6.0)))
    kinds = set()
    while run.state.search.active and run.now_s < 300.0:
        run.step()
        shown = planned_path(run.state.search, run.decision, 5)
        kinds.add(shown.goal_kind)
        assert len(shown.goal_m) == (shown.goal_kind != "none")
    assert kinds == {"none", "go_to"}
