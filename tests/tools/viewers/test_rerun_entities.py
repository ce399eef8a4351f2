"""What a message shows in Rerun."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("rerun", reason="needs rerun-sdk: pip install 'onemap[rerun]'")

from onemap_gateway.present.palette import DARK
from onemap_shared.messages import MapClear, VelocityCommand
from onemap_tools.viewers.rerun_entities import CAMERA, IMAGE, SHOWN, entities_of
from tests.gateway import fakes
from tests.shared.samples import SAMPLES, STATUS


def shown(message: object) -> dict[str, list[Any]]:
    found: dict[str, list[Any]] = {}
    for entity, archetype in entities_of(message):
        found.setdefault(entity, []).append(archetype)
    return found


def values(component: Any) -> Any:
    """A component batch as Python values."""
    return component.as_arrow_array().to_pylist()


@pytest.mark.parametrize("kind", SHOWN, ids=lambda kind: kind.__name__)
def test_every_kind_of_message_can_be_shown(kind: type) -> None:
    sample = next(each for each in SAMPLES if isinstance(each, kind))
    assert shown(sample)


def test_other_messages_show_nothing() -> None:
    assert shown(MapClear()) == {}


def test_a_frame_shows_image_points_and_camera() -> None:
    found = shown(fakes.rgbd())
    assert set(found) == {CAMERA, IMAGE, "world/points"}
    points = np.array(values(found["world/points"][0].positions))
    assert points.shape == (6 * 8, 3)
    assert points[:, 2] == pytest.approx(1.5)  # the camera looks along z of the map here


def test_rows_of_the_map_begin_with_the_largest_y() -> None:
    view = fakes.search_view()
    (layer,) = shown(view)["world/map/occupancy"]
    width, height = view.grid.shape
    pixels = np.array(values(layer.data)[0], np.uint8).reshape(height, width, 4)
    ix, iy = np.argwhere(view.occupancy == 2)[0]
    assert tuple(pixels[height - 1 - iy, ix, :3]) == DARK.occupied
    x_min, y_min, _, _ = view.grid.bounds_m
    assert values(layer.translation)[0][:2] == pytest.approx([x_min, y_min])


def test_similarity_is_shown_if_something_is_sought() -> None:
    assert "world/map/similarity" not in shown(fakes.search_view())
    assert "world/map/similarity" in shown(fakes.search_view("sofa"))


def test_boxes_have_names() -> None:
    found = shown(fakes.detections("sofa", "bed"))
    (boxes,) = found[f"{IMAGE}/boxes"]
    assert values(boxes.labels) == ["sofa 0.80", "bed 0.80"]
    assert values(shown(fakes.detections())[f"{IMAGE}/boxes"][0].labels) == []


def test_found_objects_are_marked() -> None:
    (objects,) = shown(STATUS)["world/objects"]
    assert values(objects.labels) == ["sofa 0.90"]
    assert values(objects.positions) == [pytest.approx([1.0, 2.0, 0.4])]


def test_commands_and_problems_are_plotted_and_logged() -> None:
    assert set(shown(VelocityCommand(1, 1, 0.2, 0.1))) == {
        "plots/speed/commanded",
        "plots/speed/commanded_turning",
    }
    assert "log/mapper" in shown(fakes.heartbeat("mapper", problem="no frames"))
