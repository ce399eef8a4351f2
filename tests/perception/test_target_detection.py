"""The target of a search in one frame."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_perception.detectors.patches import PatchDetector
from onemap_perception.detectors.protocol import Detection, Image
from onemap_perception.errors import UnknownWordError
from onemap_perception.target_detection import Target, detect_in_frame, make_target
from onemap_shared.messages import TextEmbeddings
from tests.perception.toy import ColourEncoder, frame

ENCODER = ColourEncoder()
DETECTOR = PatchDetector("toy")


def test_the_target_comes_first_and_the_other_names_compete() -> None:
    target = make_target(ENCODER, "blue", ("red", "blue", "green"))
    assert target.name == "blue"
    assert target.queries is not None
    assert target.queries.texts == ("blue", "red", "green")


def test_names_that_cannot_be_embedded_do_not_compete() -> None:
    target = make_target(ENCODER, "blue", ("mauve", "red", "puce"))
    assert target.queries is not None
    assert target.queries.texts == ("blue", "red")


def test_an_unknown_target_is_an_error() -> None:
    with pytest.raises(UnknownWordError, match="'mauve' is no colour"):
        make_target(ENCODER, "mauve", ("red", "mauve"))


def test_detections_have_points_in_the_map() -> None:
    shown = frame(7)
    target = make_target(ENCODER, "red", ())
    detections = detect_in_frame(DETECTOR, target, shown, ENCODER.encode(shown.rgb))
    assert (detections.sequence, detections.stamp_ns) == (7, shown.stamp_ns)
    assert (detections.names, detections.detector_id) == (("red",), "patches/toy")
    np.testing.assert_array_equal(detections.boxes_px, [[16, 8, 32, 24]])
    np.testing.assert_allclose(detections.points_map[:, 2], 2.0)
    assert set(detections.point_owner.tolist()) == {0}
    assert not detections.independent  # it reads the features that the map holds


def test_a_detector_that_reads_no_features_is_independent() -> None:
    class Nothing:
        detector_id = "nothing"
        reads_features = False

        def detect(self, image: Image, names: TextEmbeddings) -> tuple[Detection, ...]:
            return ()

    target = make_target(ENCODER, "red", ())
    assert detect_in_frame(Nothing(), target, frame(), None).independent


def test_a_target_without_queries_has_no_detections() -> None:
    shown = frame()
    nothing = detect_in_frame(DETECTOR, Target("mauve", None), shown, ENCODER.encode(shown.rgb))
    assert nothing.names == ()
    assert nothing.boxes_px.shape == (0, 4)
