"""Messages for Foxglove, read back by their schemas."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

pytest.importorskip("foxglove", reason="needs foxglove-sdk: pip install -e '.[live]'")

from onemap_gateway.present.palette import DARK
from onemap_shared.camera import unproject
from onemap_shared.geometry import pose_2d
from onemap_shared.messages import Layer, Occupancy
from onemap_tools.recording import foxglove as convert
from onemap_tools.recording.foxglove import object_scene, plan_scene, robot_scene
from onemap_tools.recording.map_colours import (
    LAYERS,
    belief_rgba,
    occupancy_rgba,
    similarity_rgba,
)
from tests.gateway import fakes
from tests.shared.samples import KEPT
from tests.tools.recording.foxglove_client import read

FRAME = fakes.rgbd()
DEPTH_M = FRAME.depth_mm.astype(np.float32) / np.float32(1000)


def test_a_transform_turns_as_the_pose() -> None:
    sent = read(convert.transforms(pose_2d(1.0, -2.0, np.pi / 2), convert.BODY, fakes.STAMP_NS))
    (transform,) = sent.transforms
    assert (transform.parent_frame_id, transform.child_frame_id) == ("map", "body")
    assert (transform.translation.x, transform.translation.y) == (1.0, -2.0)
    turned = transform.rotation
    assert (turned.x, turned.y) == (0.0, 0.0)
    assert (turned.z, turned.w) == pytest.approx((np.sqrt(0.5), np.sqrt(0.5)))
    assert transform.timestamp.ToNanoseconds() == fakes.STAMP_NS


def test_the_image_is_a_jpeg_and_the_calibration_projects_points_to_its_pixels() -> None:
    sent = read(convert.camera_image(FRAME))
    assert (sent.format, sent.frame_id) == ("jpeg", "camera")
    image = cv2.imdecode(np.frombuffer(sent.data, np.uint8), cv2.IMREAD_COLOR_RGB)
    assert image is not None
    assert image.shape == FRAME.rgb.shape
    assert abs(int(image[12, 4, 0]) - 200) < 10  # the left half is red
    sent = read(convert.calibration(FRAME))
    row, column = 7, 21
    x, y, z = unproject(DEPTH_M, FRAME.intrinsics)[row, column]
    u, v, w = np.array(list(sent.P)).reshape(3, 4) @ (x, y, z, 1.0)
    assert (u / w, v / w) == pytest.approx((column, row), abs=1e-4)
    assert (sent.width, sent.height) == (32, 24)


def test_the_cloud_lies_on_what_the_camera_sees() -> None:
    depth_mm = FRAME.depth_mm.copy()
    depth_mm[:, 16:] = 0  # no return
    sent = read(convert.frame_cloud(replace(FRAME, depth_mm=depth_mm)))
    points = np.frombuffer(sent.data, np.float32).reshape(-1, sent.point_stride // 4)
    stride = convert.CLOUD_STRIDE
    expected = unproject(DEPTH_M, FRAME.intrinsics)[::stride, :16:stride].reshape(-1, 3)
    np.testing.assert_allclose(points[:, :3], expected, atol=1e-5)
    colours = np.frombuffer(sent.data, np.uint8).reshape(-1, sent.point_stride)[:, 12:]
    assert (colours == (200, 0, 0, 255)).all()
    assert [field.name for field in sent.fields] == [*"xyz", "red", "green", "blue", "alpha"]


def test_a_box_has_its_corners_and_its_name() -> None:
    sent = read(convert.boxes_in_image(fakes.detections("sofa")))
    (box,), (text,) = sent.points, sent.texts
    assert [(point.x, point.y) for point in box.points] == [(4, 6), (20, 6), (20, 18), (4, 18)]
    assert text.text == "sofa 0.80"
    assert len(read(convert.boxes_in_image(fakes.detections())).points) == 0


def test_a_cell_of_the_grid_lies_where_the_map_has_it() -> None:
    """As Foxglove reads a grid: rows of cells from the pose, column by column."""
    cells = fakes.GRID
    values = np.arange(cells.shape[0] * cells.shape[1], dtype=np.float32).reshape(cells.shape)
    rgba = np.zeros((*cells.shape, 4), np.uint8)
    rgba[7, 11] = (1, 2, 3, 4)
    sent = read(convert.grid(cells, rgba, values, stamp_ns=fakes.STAMP_NS, height_m=0.5))
    row, column = 11, 7
    begin = row * sent.row_stride + column * sent.cell_stride
    assert tuple(sent.data[begin : begin + 4]) == (1, 2, 3, 4)
    value = np.frombuffer(sent.data[begin + 4 : begin + 8], np.float32)[0]
    assert value == values[7, 11]
    centre = (
        sent.pose.position.x + (column + 0.5) * sent.cell_size.x,
        sent.pose.position.y + (row + 0.5) * sent.cell_size.y,
    )
    assert centre == pytest.approx(cells.centres(np.array([7, 11])))
    assert sent.column_count == cells.shape[0]
    assert len(sent.data) == sent.row_stride * cells.shape[1]


def test_the_robot_has_its_trail_and_the_plan_path_goal_and_frontiers() -> None:
    trail = ((0.0, 0.0), (1.0, 0.0))
    robot, line = read(robot_scene(fakes.odometry(1.0, 0.0, 0.5), trail)).entities
    assert (robot.arrows[0].pose.position.x, robot.arrows[0].pose.position.y) == (1.0, 0.0)
    assert robot.arrows[0].pose.orientation.z == pytest.approx(np.sin(0.25))
    assert [(point.x, point.y) for point in line.lines[0].points] == list(trail)
    sent = read(plan_scene(fakes.planned_path((0.0, 0.0), (1.0, 0.5))))
    entities = {entity.id: entity for entity in sent.entities}
    assert list(entities) == ["path", "goal", "frontiers", "regions"]
    points = entities["path"].lines[0].points
    assert [(point.x, point.y) for point in points] == [(0.0, 0.0), (1.0, 0.5)]
    goal = entities["goal"]
    assert (goal.spheres[0].pose.position.x, goal.spheres[0].pose.position.y) == (1.0, 0.5)
    assert goal.texts[0].text == "frontier"
    assert [len(entities[name].spheres) for name in ("frontiers", "regions")] == [1, 0]
    assert {entity.frame_id for entity in sent.entities} == {"map"}


@pytest.mark.parametrize(
    ("height_m", "middle_m", "size_m"), [((0.3, 1.9), 1.1, 1.6), ((), 0.4, 0.3)]
)
def test_objects_are_boxes_with_names_and_their_heights_where_they_are_known(
    height_m: tuple[float, ...], middle_m: float, size_m: float
) -> None:
    sent = read(object_scene((replace(KEPT, height_m=height_m),), fakes.STAMP_NS))
    assert len(sent.deletions) == 1  # of the earlier ones
    (entity,) = sent.entities
    cube, label = entity.cubes[0], entity.texts[0]
    assert (entity.id, label.text) == (KEPT.object_id, "bed 0.93")
    assert (cube.pose.position.x, cube.pose.position.y) == (1.0, 2.0)
    assert (cube.size.x, cube.size.y) == (1.0, 2.0)
    assert cube.pose.position.z == pytest.approx(middle_m)
    assert cube.size.z == pytest.approx(size_m)
    assert label.pose.position.z > middle_m + size_m / 2
    assert len(read(object_scene((), fakes.STAMP_NS)).entities) == 0


def test_cells_have_the_colours_of_what_is_known_and_else_none() -> None:
    occupancy = np.array([[Occupancy.UNKNOWN, Occupancy.FREE, Occupancy.OCCUPIED]], np.uint8)
    coloured = occupancy_rgba(occupancy)
    assert coloured[0, :, 3].tolist() == [0, 255, 255]
    assert [tuple(cell[:3]) for cell in coloured[0, 1:]] == [DARK.free, DARK.occupied]
    bits = [0, Layer.OBSERVED, Layer.OBSERVED | Layer.EXPLORED, 7]
    coloured = belief_rgba(np.array([bits], np.uint8))
    assert coloured[0, 0, 3] == 0
    assert [tuple(cell[:3]) for cell in coloured[0, 1:]] == [*LAYERS.values()]  # the strongest
    coloured = similarity_rgba(np.array([[np.nan, 0.0, 0.45, 0.9]], np.float32))
    assert coloured[0, 0, 3] == coloured[0, 1, 3] == 0
    assert tuple(coloured[0, 3, :3]) == DARK.heat[-1]  # relative to the best score
    assert 0 < coloured[0, 2, 3] < coloured[0, 3, 3] == 255
