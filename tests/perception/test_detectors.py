"""Detections from boxes, from networks on tiny random weights, and from patch scores."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from onemap_perception.config import CocoParams, OpenVocabularyParams
from onemap_perception.detectors.boxes import (
    Box,
    BoxDetector,
    RoutedDetector,
    detections_from_boxes,
    inner_mask,
)
from onemap_perception.detectors.networks import CocoNetwork, GroundingNetwork
from onemap_perception.detectors.patches import PatchDetector, PatchLimits
from onemap_perception.detectors.protocol import Detection, Image
from onemap_perception.encoders.checkpoint import load_pretrained
from onemap_perception.errors import BackendError
from onemap_shared.geometry import U8, Bool
from onemap_shared.messages import TextEmbeddings
from tests.perception.tiny import grounding_folder, owl_folder, rtdetr_folder
from tests.perception.toy import ColourEncoder, frame


def names(*texts: str) -> TextEmbeddings:
    rows = np.ones((len(texts), 1), np.float32)
    none = np.zeros((0, 1), np.float32)
    return TextEmbeddings("e", "s", texts, rows, none, np.zeros((len(texts), 0), np.uint8), 1.0)


def noise(height: int = 48, width: int = 64) -> Image:
    rgb = np.random.default_rng(0).integers(0, 256, (height, width, 3)).astype(np.uint8)
    return Image(rgb)


def inside(detections: Sequence[Detection], image_px: tuple[int, int]) -> bool:
    """Whether boxes, masks and scores are possible for an image (W, H)."""
    width, height = image_px
    return all(
        0 <= detection.box_px[0] < detection.box_px[2] <= width
        and 0 <= detection.box_px[1] < detection.box_px[3] <= height
        and detection.mask.shape == (height, width)
        and detection.mask.any()
        and 0 <= detection.score <= 1
        for detection in detections
    )


SQUARE = (0.0, 0.0, 9.0, 9.0)


def accepted(
    boxes: Sequence[Box], *, score_threshold: float = 0.3, max_detections: int = 16
) -> tuple[Detection, ...]:
    return detections_from_boxes(
        boxes, (9, 9), score_threshold=score_threshold, max_detections=max_detections
    )


def test_the_middle_of_a_box_stands_for_the_object() -> None:
    mask = inner_mask((10, 20, 20, 40), (64, 48))
    rows, columns = np.nonzero(mask)
    assert (columns.min(), columns.max() + 1) == (12, 18)
    assert (rows.min(), rows.max() + 1) == (24, 36)


@given(
    corners=st.tuples(*[st.floats(-50, 150) | st.sampled_from([np.nan, np.inf, -np.inf])] * 4),
    image_px=st.tuples(st.integers(1, 80), st.integers(1, 80)),
)
def test_any_box_is_clipped_or_left_out(
    corners: tuple[float, float, float, float], image_px: tuple[int, int]
) -> None:
    detections = detections_from_boxes(
        [Box("x", 0.5, corners)], image_px, score_threshold=0.3, max_detections=6
    )
    assert inside(detections, image_px)


def test_boxes_below_the_threshold_do_not_count_and_the_best_come_first() -> None:
    boxes = [Box("x", score, SQUARE) for score in (0.3, 0.9, 0.6)]
    assert [each.score for each in accepted(boxes, score_threshold=0.5)] == [0.9, 0.6]
    boxes = [Box("chair", 0.9, SQUARE)] * 20 + [Box("cup", 0.4, SQUARE)]
    assert [each.name for each in accepted(boxes, max_detections=3)] == ["chair"] * 3 + ["cup"]


class FixedBoxes:
    """Implements ``BoxNetwork``: the same three boxes for every name but unicorns."""

    network_id = "fixed-1"

    def __init__(self) -> None:
        self.asked: list[tuple[tuple[str, ...], float]] = []

    def supports(self, name: str) -> bool:
        return name != "unicorn"

    def boxes(self, rgb: U8, names: Sequence[str], score_threshold: float) -> list[Box]:
        self.asked.append((tuple(names), score_threshold))
        scores = (0.9, 0.7, 0.2)
        return [Box(name, score, (0, 0, 8, 8)) for name in names for score in scores]


def test_the_network_is_asked_for_the_names_it_supports() -> None:
    network = FixedBoxes()
    detector = BoxDetector(network, CocoParams(score_threshold=0.4))
    found = detector.detect(noise(), names("sofa", "unicorn"))
    assert network.asked == [(("sofa",), 0.4)]
    assert [(each.name, each.score) for each in found] == [("sofa", 0.9), ("sofa", 0.7)]
    assert detector.detector_id == "fixed-1"
    assert not detector.reads_features


class Unwhole:
    """A model class of transformers whose checkpoint lacks two tensors."""

    @staticmethod
    def from_pretrained(folder: Path, **options: bool) -> tuple[None, dict[str, set[str]]]:
        return None, {"missing_keys": {"head.weight", "body.bias"}}


def test_a_checkpoint_that_lacks_a_tensor_is_refused_by_its_name(tmp_path: Path) -> None:
    with pytest.raises(BackendError, match=r"another architecture: it lacks body\.bias"):
        load_pretrained(Unwhole, tmp_path, what="model")


class OneEach:
    """One detection of every name, with a fixed score."""

    reads_features = False

    def __init__(self, detector_id: str, score: float, supported: tuple[str, ...] = ()) -> None:
        self.detector_id = detector_id
        self.asked: list[tuple[str, ...]] = []
        self._score, self._supported = score, supported

    def supports(self, name: str) -> bool:
        return name in self._supported

    def detect(self, image: Image, wanted: TextEmbeddings) -> tuple[Detection, ...]:
        self.asked.append(wanted.texts)
        mask = np.ones((1, 1), bool)
        return tuple(Detection(name, self._score, (0, 0, 1, 1), mask) for name in wanted.texts)


def test_each_name_goes_to_one_detector_and_the_best_come_first() -> None:
    closed, open_vocabulary = OneEach("closed", 0.5, ("tv", "cup")), OneEach("open", 0.8)
    routed = RoutedDetector(closed, open_vocabulary)
    found = routed.detect(noise(), names("tv", "unicorn", "cup"))
    assert (closed.asked, open_vocabulary.asked) == ([("tv", "cup")], [("unicorn",)])
    assert [each.name for each in found] == ["unicorn", "tv", "cup"]
    assert [each.scale for each in found] == ["open", "closed", "closed"]
    assert routed.detector_id == "closed+open"


CPU = torch.device("cpu")


@pytest.fixture(scope="module")
def detector(tmp_path_factory: pytest.TempPathFactory) -> BoxDetector:
    network = CocoNetwork(rtdetr_folder(tmp_path_factory.mktemp("rtdetr")), CPU)
    return BoxDetector(network, CocoParams(score_threshold=1e-6))


def test_detections_have_the_name_that_was_searched(detector: BoxDetector) -> None:
    found = detector.detect(noise(), names("sofa", "unicorn"))
    assert [each.name for each in found] == ["sofa"] * 16
    assert inside(found, (64, 48))
    assert detector.detect(noise(), names("unicorn")) == ()


@pytest.mark.parametrize("size", [(1, 1), (7, 33), (480, 3)])
def test_images_of_any_size_are_taken(detector: BoxDetector, size: tuple[int, int]) -> None:
    found = detector.detect(noise(*size), names("chair"))
    assert len(found) > 0
    assert inside(found, size[::-1])


@pytest.fixture(scope="module", params=["Owlv2", "GroundingDino", "MMGroundingDino"])
def grounding(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> BoxDetector:
    """MMGroundingDino is what LLMDet's checkpoints are loaded as."""
    folder = tmp_path_factory.mktemp(request.param)
    if request.param == "Owlv2":
        owl_folder(folder)
    else:
        grounding_folder(folder, request.param)
    params = OpenVocabularyParams(score_threshold=1e-6)
    return BoxDetector(GroundingNetwork(folder, CPU), params)


def test_any_name_is_taken(grounding: BoxDetector) -> None:
    found = grounding.detect(noise(), names("Red lamp", "unicorn", "電視"))
    assert inside(found, (64, 48))
    assert {each.name for each in found} <= {"Red lamp", "unicorn", "電視"}
    assert grounding.detect(noise(), names()) == ()
    assert 1 <= max(Counter(each.name for each in found).values()) <= 16


def test_a_folder_of_no_grounding_detector_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("transformers", reason="needs transformers")
    with pytest.raises(BackendError, match="holds no grounding detector"):
        GroundingNetwork(tmp_path, CPU)
    rtdetr_folder(tmp_path)
    with pytest.raises(BackendError, match="holds no grounding detector"):
        GroundingNetwork(tmp_path, CPU)


ENCODER = ColourEncoder()


def sample_image() -> Image:
    rgb = frame().rgb
    return Image(rgb, ENCODER.encode(rgb))


def patches(**params: float) -> PatchDetector:
    return PatchDetector("toy", PatchLimits(**params))  # type: ignore[arg-type]


def test_a_red_square_is_the_one_detection() -> None:
    (found,) = patches().detect(sample_image(), ENCODER.embed_text(["red"]))
    assert found.name == "red"
    assert found.score > 0.99
    assert found.box_px == (16.0, 8.0, 32.0, 24.0)
    assert found.mask.sum() == 4
    assert patches().detector_id == "patches/toy"


def test_groups_below_the_thresholds_are_left_out() -> None:
    red = ENCODER.embed_text(["red"])
    assert patches(min_patches=5).detect(sample_image(), red) == ()
    assert patches(peak_threshold=0.99999).detect(sample_image(), red) == ()


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
    found = patches(min_patches=1, max_detections=24).detect(image, ENCODER.embed_text(["red"]))
    expected = {(slow == label).tobytes() for label in np.unique(slow[above])}
    assert {detection.mask.tobytes() for detection in found} == expected
