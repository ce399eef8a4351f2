from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("foxglove", reason="needs foxglove-sdk: pip install 'onemap[live]'")

from onemap_tools.viewers.foxglove_scenes import object_scene, plan_scene, robot_scene
from tests.gateway import fakes
from tests.shared.samples import KEPT
from tests.tools.viewers.foxglove_client import read


def test_the_plan_has_path_goal_and_frontiers() -> None:
    sent = read(plan_scene(fakes.planned_path((0.0, 0.0), (1.0, 0.5))))
    entities = {entity.id: entity for entity in sent.entities}
    assert set(entities) == {"path", "goal", "frontiers", "regions"}
    points = entities["path"].lines[0].points
    assert [(point.x, point.y) for point in points] == [(0.0, 0.0), (1.0, 0.5)]
    goal = entities["goal"].spheres[0].pose.position
    assert (goal.x, goal.y) == (1.0, 0.5)
    assert entities["goal"].texts[0].text == "frontier"
    assert len(entities["frontiers"].spheres) == 1
    assert len(entities["regions"].spheres) == 0
    assert {entity.frame_id for entity in sent.entities} == {"map"}


def test_a_better_frontier_is_larger() -> None:
    points = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]], np.float32)
    plan = replace(
        fakes.planned_path((0.0, 0.0)),
        frontiers_m=points,
        frontier_scores=np.array([0.1, 0.9, np.nan], np.float32),
    )
    entities = {entity.id: entity for entity in read(plan_scene(plan)).entities}
    sizes = [sphere.size.x for sphere in entities["frontiers"].spheres]
    assert sizes[1] > sizes[0] > sizes[2] > 0


def test_objects_are_boxes_with_names_and_replace_the_earlier() -> None:
    sent = read(object_scene((KEPT,), fakes.STAMP_NS))
    assert len(sent.deletions) == 1
    (entity,) = sent.entities
    cube = entity.cubes[0]
    assert entity.id == KEPT.object_id
    assert (cube.pose.position.x, cube.pose.position.y) == (1.0, 2.0)
    assert (cube.size.x, cube.size.y) == (1.0, 2.0)
    assert entity.texts[0].text == "bed 0.93"
    assert len(read(object_scene((), fakes.STAMP_NS)).entities) == 0


@pytest.mark.parametrize(
    ("height_m", "middle_m", "size_m"), [((0.3, 1.9), 1.1, 1.6), ((), 0.4, 0.3)]
)
def test_a_box_has_the_heights_of_its_object_where_they_are_known(
    height_m: tuple[float, ...], middle_m: float, size_m: float
) -> None:
    kept = replace(KEPT, height_m=height_m)
    (entity,) = read(object_scene((kept,), fakes.STAMP_NS)).entities
    cube, label = entity.cubes[0], entity.texts[0]
    assert cube.pose.position.z == pytest.approx(middle_m)
    assert cube.size.z == pytest.approx(size_m)
    assert label.pose.position.z > middle_m + size_m / 2


def test_the_robot_has_its_trail() -> None:
    trail = ((0.0, 0.0), (1.0, 0.0))
    sent = read(robot_scene(fakes.odometry(1.0, 0.0, 0.5), trail))
    robot, line = sent.entities
    assert (robot.arrows[0].pose.position.x, robot.arrows[0].pose.position.y) == (1.0, 0.0)
    assert robot.arrows[0].pose.orientation.z == pytest.approx(np.sin(0.25))
    assert [(point.x, point.y) for point in line.lines[0].points] == list(trail)
