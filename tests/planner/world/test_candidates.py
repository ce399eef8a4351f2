"""A detection counts only where the map agrees, and only several in one place."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from onemap_planner.sentences import confirmed
from onemap_planner.world.candidates import (
    RECENT_SIGHTINGS,
    Consensus,
    ObjectCandidate,
    PictureOfObject,
    Sighting,
    merge_sightings,
    sightings_of,
    similarity_threshold,
)
from onemap_shared.geometry import F32
from onemap_shared.messages import Detections
from tests.planner.drawn_maps import detections_of, drawn_map
from tests.reference.planning import top_cells

HERE = (0.0, 0.0)


def detections(points: list[tuple[float, float, float]], name: str = "sofa") -> Detections:
    return detections_of({name: points})


def sighted(similarity: F32, message: Detections) -> tuple[Sighting, ...]:
    map_view = replace(drawn_map(*["." * 20] * 20), similarity=similarity)
    return sightings_of("sofa", message, map_view, seen_from=HERE)


def sighting(x: float, cells: frozenset[tuple[int, int]] = frozenset()) -> Sighting:
    return Sighting((x, 0.0, 0.5), cells, 0.8, 0.7, HERE)


@given(
    arrays(
        np.float32,
        (7, 6),
        elements=st.one_of(st.just(np.float32(np.nan)), st.floats(0, 1, width=32)),
    ),
    st.sampled_from([0.0, 50.0, 90.0, 95.0, 100.0]),
)
def test_the_threshold_marks_the_top_cells(similarity: F32, percentile: float) -> None:
    threshold = similarity_threshold(similarity, Consensus(percentile, floor=0.0))
    distinct = ~np.isclose(similarity, threshold, atol=1e-5)  # rounding decides about the others
    expected = top_cells(similarity, percentile)
    assert (similarity >= threshold)[distinct].tolist() == expected[distinct].tolist()


@pytest.mark.parametrize(
    ("high", "where"),
    [
        pytest.param(0.8, (1.55, 1.55, 0.5), id="elsewhere"),
        pytest.param(0.2, (0.55, 0.55, 0.5), id="on top but below the floor"),
        pytest.param(0.8, (9.0, 9.0, 0.5), id="outside the map"),
    ],
)
def test_a_detection_the_map_does_not_support_does_not(
    high: float, where: tuple[float, float, float]
) -> None:
    similarity = np.full((20, 20), 0.1, np.float32)
    similarity[5:7, 5:7] = high
    assert sighted(similarity, detections([where])) == ()


def test_a_sighting_has_its_frame_with_the_box_in_pixels_of_the_picture() -> None:
    similarity = np.full((20, 20), 0.8, np.float32)
    message = replace(
        detections([(0.5, 0.5, 0.5)]),
        boxes_px=np.array([[10, 20, 30, 40]], np.float32),
        stamp_ns=7,
        picture=b"jpeg",
        picture_scale=0.5,
    )
    (found,) = sighted(similarity, message)
    score = float(np.float32(0.8))
    assert found.view == PictureOfObject(score, 7, (5.0, 10.0, 15.0, 20.0), b"jpeg")


@pytest.mark.parametrize(
    ("independent", "supported", "said"),
    [
        ((False, True), True, "and the map agrees"),
        ((False, False), True, "and the map agrees, by the same encoder: one opinion, not two"),
        ((True,), False, "though the map does not agree"),
    ],
)
def test_a_find_says_whether_two_opinions_agree(
    independent: tuple[bool, ...], supported: bool, said: str
) -> None:
    similarity = np.full((20, 20), 0.8 if supported else 0.1, np.float32)
    map_view = replace(drawn_map(*["#" * 20] * 20), similarity=similarity)
    seen: tuple[Sighting, ...] = ()
    for each in independent:
        message = replace(detections([(0.5, 0.5, 0.5)]), independent=each)
        seen += sightings_of("sofa", message, map_view, seen_from=HERE)
    (candidate,) = merge_sightings((), seen)
    assert confirmed(12, candidate.agreement) == f"seen in 12 images from near, {said}"


@pytest.mark.parametrize(
    ("scores_and_pictures", "best"),
    [
        pytest.param([(0.5, b"x"), (0.9, b"x"), (0.7, b"x")], 1, id="the highest score"),
        pytest.param([(0.9, b"x"), (0.89, b"x")], 1, id="the later one of two about equal"),
        pytest.param([(0.4, b"x"), (0.9, b"")], 0, id="the one with a picture"),
        pytest.param([(0.4, b""), (0.9, b"")], 1, id="none has a picture"),
    ],
)
def test_a_candidate_keeps_its_best_view(
    scores_and_pictures: list[tuple[float, bytes]], best: int
) -> None:
    views = [
        PictureOfObject(score, stamp_ns, (0.0, 0.0, 1.0, 1.0), picture)
        for stamp_ns, (score, picture) in enumerate(scores_and_pictures)
    ]
    seen = [replace(sighting(0.0), view=view) for view in views]
    (candidate,) = merge_sightings((), seen)
    assert candidate.best_view == views[best]
    (after,) = merge_sightings((candidate,), [sighting(0.0)])
    assert after.best_view == views[best]


def test_background_in_the_box_is_tolerated_and_left_out() -> None:
    similarity = np.full((20, 20), 0.1, np.float32)
    similarity[5:7, 5:7] = 0.8
    box = [(0.55, 0.55, 0.5), (0.65, 0.55, 0.5), (1.5, 1.5, 0.5), (1.6, 1.6, 0.5)]
    (found,) = sighted(similarity, detections(box))
    assert found.xyz == pytest.approx((0.6, 0.55, 0.5))


def test_a_sighting_from_near_outweighs_those_from_afar() -> None:
    far = [replace(sighting(1.0), seen_from=(5.0, 0.0)) for _ in range(8)]
    near = replace(sighting(1.4), seen_from=(2.4, 0.0))
    (candidate,) = merge_sightings((), [*far, near])
    assert candidate.xyz[0] > 1.28
    (other,) = merge_sightings((), [near, *far])
    assert other.xyz[0] > 1.2  # what is seen again from afar does not undo it


def test_a_detection_without_the_map_s_support_has_the_obstacles_it_covers() -> None:
    map_view = drawn_map(*["." * 20] * 10, *["#" * 20] * 10)
    message = detections([(0.55, 0.55, 0.4), (1.55, 0.55, 0.6), (1.65, 0.55, 0.6)])
    (found,) = sightings_of("sofa", message, map_view, seen_from=HERE)
    assert not found.supported
    assert found.cells == {(15, 5), (16, 5)}
    assert found.xyz == pytest.approx((1.6, 0.55, 0.6))
    (candidate,) = merge_sightings((), [found])
    assert not candidate.supported


def test_a_stray_cell_of_one_frame_is_not_the_surface() -> None:
    thing = frozenset((x, y) for x in range(10, 14) for y in range(10, 14))
    stray = (18, 12)
    found: tuple[ObjectCandidate, ...] = ()
    for number in range(RECENT_SIGHTINGS):
        cells = thing | {stray} if number == 0 else thing
        found = merge_sightings(found, [sighting(1.2, cells)])
    assert stray in found[0].cells
    assert found[0].surface == thing
    moved = frozenset((x + 1, y) for x, y in thing)  # the last sightings, from near, decide
    for _ in range(RECENT_SIGHTINGS):
        found = merge_sightings(found, [sighting(1.3, moved)])
    assert found[0].surface == moved
