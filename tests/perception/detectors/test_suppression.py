"""Of two names for one object the one with the better score is kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from onemap_perception.detectors.protocol import Detection
from onemap_perception.encoders.mini import MiniEncoder, MiniParams
from onemap_perception.target_detection import distinct_queries, iou, suppress_overlaps


def detection(name: str, score: float, x: int, y: int, side: int = 4) -> Detection:
    """A square of ``side`` cells at (x, y) of a grid of 16 x 16."""
    mask = np.zeros((16, 16), bool)
    mask[y : y + side, x : x + side] = True
    return Detection(name, score, (x, y, x + side, y + side), mask)


def test_of_two_names_for_one_object_the_better_one_is_kept() -> None:
    bed, sofa = detection("bed", 0.9, 2, 2), detection("sofa", 0.6, 2, 3)
    assert suppress_overlaps((bed, sofa)) == (bed,)
    assert suppress_overlaps((sofa, bed)) == (bed,)


def test_an_object_on_another_is_kept() -> None:
    bed, pillow = detection("bed", 0.9, 0, 0, side=10), detection("pillow", 0.5, 1, 1, side=3)
    assert suppress_overlaps((bed, pillow)) == (bed, pillow)


def test_one_name_does_not_compete_with_itself() -> None:
    twins = (detection("chair", 0.9, 2, 2), detection("chair", 0.6, 2, 2))
    assert suppress_overlaps(twins) == twins


def test_scores_of_two_networks_are_not_compared() -> None:
    chair = replace(detection("chair", 0.9, 2, 2), scale="coco")
    throne = replace(detection("throne", 0.4, 2, 2), scale="open")
    assert suppress_overlaps((chair, throne)) == (chair, throne)


def test_words_that_mean_the_same_do_not_compete() -> None:
    encoder = MiniEncoder(MiniParams())
    words = ("sofa", "couch", "bed", "sectional sofa", "armchair")
    assert distinct_queries(encoder.embed_text(words)).texts == ("sofa", "bed", "armchair")


def test_masks_of_two_grids_are_not_compared() -> None:
    pixels = Detection("sofa", 0.5, (0, 0, 8, 8), np.ones((8, 8), bool))
    patches = Detection("bed", 0.9, (0, 0, 8, 8), np.ones((2, 2), bool))
    assert suppress_overlaps((patches, pixels)) == (patches, pixels)


@given(st.lists(st.tuples(st.sampled_from("abc"), st.floats(0, 1), st.integers(0, 12)), max_size=8))
def test_the_surest_always_stands_and_every_loser_has_a_surer_rival(
    drawn: list[tuple[str, float, int]],
) -> None:
    found = [detection(name, score, x, 3) for name, score, x in drawn]
    standing = suppress_overlaps(found)
    if found:
        assert any(max(found, key=lambda each: each.score) is each for each in standing)
    for loser in (each for each in found if not any(each is one for one in standing)):
        assert any(
            rival.name != loser.name and rival.score > loser.score
            for rival in found
            if iou(rival.mask, loser.mask) >= 0.5
        )
