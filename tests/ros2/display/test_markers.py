from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_ros2.cdr import DETECTION_ARRAY, MARKER_ARRAY, PATH, decode
from onemap_ros2.display_messages import MAX_MARKED, detection_array, marker_array, path_message
from tests.ros2.planner_messages import KEPT, path_to


def test_markers_show_finds_regions_and_frontiers_after_deleting_all() -> None:
    message = decode(marker_array([KEPT], path_to(2.0, 0.0), 7, "map"), MARKER_ARRAY)
    first, *rest = message.markers
    assert first.action == 3
    assert [(each.ns, each.id, each.type) for each in rest] == [
        ("finds", 0, 2),
        ("finds", 1, 9),
        ("regions", 0, 3),
        ("regions", 1, 3),
        ("frontiers", 0, 7),
    ]
    sphere, label, low, high, frontiers = rest
    assert (sphere.pose.position.x, sphere.pose.position.z) == (1.0, 0.4)
    assert label.text == "sofa"
    assert low.color.a < high.color.a
    assert [(point.x, point.y) for point in frontiers.points] == [(1.0, 1.0), (3.0, 1.0)]
    assert {each.header.frame_id for each in rest} == {"map"}
    assert all(each.action == 0 and each.scale.x > 0 and each.color.a > 0 for each in rest)


def test_without_a_plan_only_finds_are_shown() -> None:
    assert len(decode(marker_array([], None, 7, "map"), MARKER_ARRAY).markers) == 1


def test_a_hall_of_frontiers_is_cut() -> None:
    path = path_to(2.0, 0.0)
    many = np.zeros((1000, 2), np.float32)
    path = type(path)(1, "none", "", many[:0], many[:0], many, many[:, 0], many, many[:, 0], "rest")
    markers = decode(marker_array([], path, 7, "map"), MARKER_ARRAY).markers
    assert len(markers[-1].points) == MAX_MARKED
    assert len(markers) == 2 + MAX_MARKED


def test_a_detection_has_id_name_score_and_the_extent_of_its_cells() -> None:
    (found,) = decode(detection_array([KEPT], 7, "map"), DETECTION_ARRAY).detections
    assert found.id == "id1"
    assert found.results[0].hypothesis.class_id == "sofa"
    assert found.results[0].hypothesis.score == 0.75
    box = found.bbox
    assert (box.center.position.x, box.center.position.y, box.center.position.z) == (1.1, 2.0, 0.4)
    np.testing.assert_allclose((box.size.x, box.size.y, box.size.z), (1.2, 1.0, 0.0))


def test_a_detection_has_the_heights_of_its_object() -> None:
    tall = replace(KEPT, height_m=(0.3, 1.9))
    (found,) = decode(detection_array([tall], 7, "map"), DETECTION_ARRAY).detections
    assert (found.bbox.center.position.z, found.bbox.size.z) == pytest.approx((1.1, 1.6))
    assert found.results[0].pose.pose.position.z == 0.4  # where it was detected


def test_a_path_is_its_points() -> None:
    poses = decode(path_message(path_to(2.0, 1.0), 7, "map"), PATH).poses
    assert [(each.pose.position.x, each.pose.position.y) for each in poses] == [(0, 0), (2, 1)]
