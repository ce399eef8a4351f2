"""Detections from patch scores."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from onemap_perception.detectors.patches import PatchDetector, PatchThresholds, box_px, components
from onemap_perception.detectors.protocol import Image
from onemap_shared.geometry import Bool
from tests.perception.toy import COLOURS, ColourEncoder, frame

ENCODER = ColourEncoder()


def sample_image() -> Image:
    rgb = frame().rgb
    return Image(rgb, ENCODER.encode(rgb))


def detector(**limits: float) -> PatchDetector:
    return PatchDetector(PatchThresholds(**limits), "toy")  # type: ignore[arg-type]


def test_a_red_square_is_the_one_red_thing() -> None:
    (found,) = detector().detect(sample_image(), ENCODER.embed_text(["red"]))
    assert found.name == "red"
    assert found.score > 0.99
    assert found.box_px == (16.0, 8.0, 32.0, 24.0)
    assert found.mask.sum() == 4
    assert detector().detector_id == "patches/toy"


def test_what_is_not_there_is_not_found() -> None:
    assert detector().detect(sample_image(), ENCODER.embed_text(["blue"])) == ()


def test_several_names_come_best_first() -> None:
    found = detector().detect(sample_image(), ENCODER.embed_text(COLOURS))
    assert {detection.name for detection in found} == {"red", "green"}
    assert [detection.score for detection in found] == sorted(
        (t.score for t in found), reverse=True
    )


def test_things_smaller_or_less_sure_than_the_limits_are_left_out() -> None:
    red = ENCODER.embed_text(["red"])
    assert detector(patches=5).detect(sample_image(), red) == ()
    assert detector(core=0.99999).detect(sample_image(), red) == ()


def test_at_most_so_many_detections_of_a_name() -> None:
    rgb = np.zeros((40, 40, 3), np.uint8)
    rgb[..., 1] = 200
    rgb[::16, ::16] = (200, 0, 0)  # the toy looks at each patch's first pixel
    image = Image(rgb, ENCODER.encode(rgb))
    red = ENCODER.embed_text(["red"])
    assert len(detector(patches=1, detections=9).detect(image, red)) == 9
    assert len(detector(patches=1, detections=4).detect(image, red)) == 4


@given(bits=st.lists(st.lists(st.booleans(), min_size=6, max_size=6), min_size=4, max_size=4))
def test_components_are_the_groups_that_touch(bits: list[list[bool]]) -> None:
    wanted: Bool = np.array(bits)
    labels = components(wanted)
    assert ((labels > 0) == wanted).all()
    # The slow twin: spread the smallest number of the neighbourhood until nothing changes.
    slow = np.where(wanted, np.arange(wanted.size).reshape(wanted.shape) + 1, 0)
    for _ in range(wanted.size):
        for i, j in np.argwhere(wanted):
            near = slow[max(i - 1, 0) : i + 2, max(j - 1, 0) : j + 2]
            slow[i, j] = near[near > 0].min()
    pairs = {(int(a), int(b)) for a, b in zip(labels[wanted], slow[wanted], strict=True)}
    assert len(pairs) == len({a for a, _ in pairs}) == len({b for _, b in pairs})


def test_a_box_of_an_image_that_was_resized() -> None:
    mask = np.zeros((4, 5), bool)
    mask[1:3, 4] = True
    assert box_px(mask, (100, 80)) == (80.0, 20.0, 100.0, 60.0)
