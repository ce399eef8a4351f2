"""Detections from patch scores."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from onemap_perception.detectors.patches import PatchDetector, PatchLimits
from onemap_perception.detectors.protocol import Image
from onemap_shared.geometry import Bool
from tests.perception.toy import ColourEncoder, frame

ENCODER = ColourEncoder()


def sample_image() -> Image:
    rgb = frame().rgb
    return Image(rgb, ENCODER.encode(rgb))


def detector(**params: float) -> PatchDetector:
    return PatchDetector("toy", PatchLimits(**params))  # type: ignore[arg-type]


def test_a_red_square_is_the_one_detection() -> None:
    (found,) = detector().detect(sample_image(), ENCODER.embed_text(["red"]))
    assert found.name == "red"
    assert found.score > 0.99
    assert found.box_px == (16.0, 8.0, 32.0, 24.0)
    assert found.mask.sum() == 4
    assert detector().detector_id == "patches/toy"


def test_groups_below_the_thresholds_are_left_out() -> None:
    red = ENCODER.embed_text(["red"])
    assert detector(min_patches=5).detect(sample_image(), red) == ()
    assert detector(peak_threshold=0.99999).detect(sample_image(), red) == ()


@given(
    above=arrays(bool, (4, 6), elements=st.booleans()),
)
def test_detections_are_the_groups_that_touch(above: Bool) -> None:
    """Against a slow search: spread the smallest number of the neighbourhood to a fixed point."""
    slow = np.where(above, np.arange(above.size).reshape(above.shape) + 1, 0)
    for _ in range(above.size):
        for i, j in np.argwhere(above):
            near = slow[max(i - 1, 0) : i + 2, max(j - 1, 0) : j + 2]
            slow[i, j] = near[near > 0].min()
    rgb = np.zeros((32, 48, 3), np.uint8)
    rgb[..., 1] = 200
    rgb[np.kron(above, np.ones((8, 8), bool))] = (200, 0, 0)
    image = Image(rgb, ENCODER.encode(rgb))
    found = detector(min_patches=1, max_detections=24).detect(image, ENCODER.embed_text(["red"]))
    expected = {(slow == label).tobytes() for label in np.unique(slow[above])}
    assert {detection.mask.tobytes() for detection in found} == expected


def test_a_box_covers_its_patches_in_pixels_of_the_image() -> None:
    rgb = np.zeros((80, 100, 3), np.uint8)
    features = np.zeros((4, 5, 3), np.float16)
    features[..., 1] = 1
    features[1:3, 4] = (1, 0, 0)
    (found,) = detector(min_patches=1).detect(Image(rgb, features), ENCODER.embed_text(["red"]))
    assert found.box_px == (80.0, 20.0, 100.0, 60.0)
