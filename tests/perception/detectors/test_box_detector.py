"""Boxes, the detectors of transformers on tiny random weights, and who is asked for a name."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_perception.detectors.boxes import Box, BoxLimits, detections_from_boxes, inner_mask
from onemap_perception.detectors.coco import CocoDetector, CocoSettings
from onemap_perception.detectors.names import coco_name
from onemap_perception.detectors.open_vocabulary import (
    OpenVocabularyDetector,
    OpenVocabularySettings,
)
from onemap_perception.detectors.protocol import Detection, DetectorError, Image
from onemap_perception.detectors.router import RoutedDetector
from onemap_shared.geometry import U8
from onemap_shared.messages import TextEmbeddings
from tests.perception.tiny import grounding_folder, owl_folder, rtdetr_folder

ANY = BoxLimits(score=0.0, detections=6)


def names(*texts: str) -> TextEmbeddings:
    rows = np.ones((len(texts), 1), np.float32)
    none = np.zeros((0, 1), np.float32)
    return TextEmbeddings("e", "s", texts, rows, none, np.zeros((len(texts), 0), np.uint8), 1.0)


def sample_image(height: int = 48, width: int = 64) -> Image:
    rgb = np.random.default_rng(0).integers(0, 256, (height, width, 3)).astype(np.uint8)
    return Image(rgb, np.ones((1, 1, 1), np.float16))


@pytest.fixture(scope="module")
def coco(tmp_path_factory: pytest.TempPathFactory) -> CocoDetector:
    folder = rtdetr_folder(tmp_path_factory.mktemp("rtdetr"))
    return CocoDetector(CocoSettings(folder, limits=ANY))


@pytest.fixture(scope="module", params=["Owlv2", "GroundingDino", "MMGroundingDino"])
def grounding(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> OpenVocabularyDetector:
    """MMGroundingDino is what LLMDet's checkpoints are loaded as."""
    folder = tmp_path_factory.mktemp(request.param)
    if request.param == "Owlv2":
        owl_folder(folder)
    else:
        grounding_folder(folder, request.param)
    return OpenVocabularyDetector(OpenVocabularySettings(folder, limits=ANY))


def inside(found: Sequence[Detection], rgb: U8) -> bool:
    height, width = rgb.shape[:2]
    return all(
        0 <= detection.box_px[0] < detection.box_px[2] <= width
        and 0 <= detection.box_px[1] < detection.box_px[3] <= height
        and detection.mask.shape == (height, width)
        and detection.mask.any()
        and 0 <= detection.score <= 1
        for detection in found
    )


def test_the_middle_of_a_box_stands_for_the_thing() -> None:
    mask = inner_mask((10, 20, 20, 40), (64, 48))
    rows, columns = np.nonzero(mask)
    assert (columns.min(), columns.max() + 1) == (12, 18)
    assert (rows.min(), rows.max() + 1) == (24, 36)


@given(
    corners=st.tuples(*[st.floats(-50, 150) | st.sampled_from([np.nan, np.inf, -np.inf])] * 4),
    size=st.tuples(st.integers(1, 80), st.integers(1, 80)),
)
def test_any_box_is_clipped_or_left_out(
    corners: tuple[float, float, float, float], size: tuple[int, int]
) -> None:
    rgb = np.zeros((*size, 3), np.uint8)
    assert inside(detections_from_boxes([Box("x", 0.5, corners)], rgb, ANY), rgb)


def test_boxes_below_the_score_do_not_count_and_the_best_come_first() -> None:
    boxes = [Box("x", score, (0, 0, 9, 9)) for score in (0.3, 0.9, 0.6)]
    rgb = np.zeros((9, 9, 3), np.uint8)
    assert [detection.score for detection in detections_from_boxes(boxes, rgb, BoxLimits(0.5))] == [
        0.9,
        0.6,
    ]
    assert len(detections_from_boxes(boxes, rgb, BoxLimits(0.0, detections=1))) == 1


def test_many_sure_boxes_of_one_name_do_not_crowd_out_another() -> None:
    boxes = [Box("chair", 0.9, (0, 0, 9, 9))] * 20 + [Box("cup", 0.4, (0, 0, 9, 9))]
    rgb = np.zeros((9, 9, 3), np.uint8)
    found = detections_from_boxes(boxes, rgb, BoxLimits(0.3, detections=3))
    assert [detection.name for detection in found] == ["chair"] * 3 + ["cup"]


@pytest.mark.parametrize(
    ("said", "coco"), [("a Sofa", "couch"), ("TV", "tv"), ("the  potted plant", "potted plant")]
)
def test_people_say_it_otherwise(said: str, coco: str) -> None:
    assert coco_name(said) == coco


def test_coco_finds_what_it_is_asked_for_by_the_name_it_was_asked(coco: CocoDetector) -> None:
    image = sample_image()
    found = coco.detect(image, names("sofa", "unicorn"))
    assert len(found) == 6
    assert {detection.name for detection in found} == {"sofa"}
    assert inside(found, image.rgb)
    assert coco.detect(image, names("unicorn")) == ()
    assert coco.detect(image, names()) == ()


@pytest.mark.parametrize("size", [(1, 1), (7, 33), (480, 3)])
def test_odd_images_are_images(
    coco: CocoDetector, grounding: OpenVocabularyDetector, size: tuple[int, int]
) -> None:
    image = sample_image(*size)
    assert inside(coco.detect(image, names("chair")), image.rgb)
    assert inside(grounding.detect(image, names("chair")), image.rgb)


def test_an_open_detector_takes_any_name(grounding: OpenVocabularyDetector) -> None:
    image = sample_image()
    found = grounding.detect(image, names("Red lamp", "unicorn", "電視"))
    assert inside(found, image.rgb)
    assert {detection.name for detection in found} <= {"Red lamp", "unicorn", "電視"}
    assert grounding.detect(image, names()) == ()
    assert 1 <= max(Counter(detection.name for detection in found).values()) <= 6


def test_each_name_goes_to_one_detector(coco: CocoDetector) -> None:
    asked: list[tuple[str, ...]] = []

    class Listener:
        detector_id = "listener"
        reads_features = False

        def detect(self, _: Image, wanted: TextEmbeddings) -> tuple[Detection, ...]:
            asked.append(wanted.texts)
            return (Detection("unicorn", 2.0, (0, 0, 1, 1), np.ones((1, 1), bool)),)

    routed = RoutedDetector(coco, Listener())
    found = routed.detect(sample_image(), names("tv", "unicorn"))
    assert asked == [("unicorn",)]
    assert found[0].name == "unicorn"
    assert {detection.name for detection in found} == {"tv", "unicorn"}
    assert routed.detector_id == f"{coco.detector_id}+listener"
    asked.clear()
    routed.detect(sample_image(), names("television"))
    assert asked == []


def test_a_folder_of_something_else_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("transformers", reason="needs transformers")
    with pytest.raises(DetectorError, match="holds no RT-DETRv2 model"):
        CocoDetector(CocoSettings(tmp_path))
    with pytest.raises(DetectorError, match="holds no grounding detector"):
        OpenVocabularyDetector(OpenVocabularySettings(tmp_path))
    rtdetr_folder(tmp_path)
    with pytest.raises(DetectorError, match="holds no grounding detector"):
        OpenVocabularyDetector(OpenVocabularySettings(tmp_path))
