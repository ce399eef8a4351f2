"""Labels: beside their points, in the image, apart."""

from __future__ import annotations

from itertools import combinations

from hypothesis import given
from hypothesis import strategies as st

from onemap_gateway.present.canvas import GAP_PX, overlap_px2, place_labels

IMAGE_PX = (400.0, 300.0)
SIZE_PX = (60.0, 12.0)
points = st.tuples(st.floats(0, IMAGE_PX[0]), st.floats(0, IMAGE_PX[1]))


def test_a_label_stands_to_the_right_of_its_point() -> None:
    assert place_labels([(100, 100)], [SIZE_PX], IMAGE_PX) == [(110, 94, 170, 106)]


def test_at_the_right_edge_it_stands_to_the_left() -> None:
    ((_, _, right, _),) = place_labels([(395, 100)], [SIZE_PX], IMAGE_PX)
    assert right == 395 - GAP_PX


def test_labels_of_one_place_are_stacked() -> None:
    boxes = place_labels([(200, 150)] * 8, [SIZE_PX] * 8, IMAGE_PX)
    assert all(overlap_px2(a, b) == 0 for a, b in combinations(boxes, 2))


def test_a_label_does_not_cover_another_point() -> None:
    boxes = place_labels([(100, 100), (140, 100)], [SIZE_PX] * 2, IMAGE_PX)
    assert overlap_px2(boxes[0], (135, 95, 145, 105)) == 0


@given(st.lists(points, max_size=8))
def test_a_few_labels_never_overlap_and_stay_inside(points_px: list[tuple[float, float]]) -> None:
    boxes = place_labels(points_px, [SIZE_PX] * len(points_px), IMAGE_PX)
    for left, top, right, bottom in boxes:
        assert left >= 0
        assert top >= 0
        assert right <= IMAGE_PX[0]
        assert bottom <= IMAGE_PX[1]
    assert all(overlap_px2(a, b) == 0 for a, b in combinations(boxes, 2))


def test_without_room_labels_overlap_but_none_is_missing() -> None:
    assert len(place_labels([(5, 5)] * 9, [(80, 12)] * 9, (40, 20))) == 9
    assert place_labels([(5, 5)], [(80, 12)], (40, 20))[0][0] == 0
