"""RT-DETRv2 on tiny random weights, and COCO's names."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest
import torch

from onemap_perception.config import CocoParams, OpenVocabularyParams
from onemap_perception.detectors.boxes import BoxDetector
from onemap_perception.detectors.networks import CocoNetwork, GroundingNetwork, coco_name
from onemap_perception.errors import BackendError
from tests.perception.detectors.samples import inside, names, noise
from tests.perception.tiny import grounding_folder, owl_folder, rtdetr_folder

CPU = torch.device("cpu")


@pytest.fixture(scope="module")
def detector(tmp_path_factory: pytest.TempPathFactory) -> BoxDetector:
    network = CocoNetwork(rtdetr_folder(tmp_path_factory.mktemp("rtdetr")), CPU)
    return BoxDetector(network, CocoParams(score_threshold=1e-6))


@pytest.mark.parametrize(
    ("said", "coco"),
    [
        ("a Sofa", "couch"),
        ("TV", "tv"),
        ("the  potted plant", "potted plant"),
        ("TELLY", "tv"),
        ("lamp", "lamp"),
    ],
)
def test_synonyms_become_the_names_of_coco(said: str, coco: str) -> None:
    assert coco_name(said) == coco


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


def test_a_folder_of_something_else_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("transformers", reason="needs transformers")
    with pytest.raises(BackendError, match="holds no RT-DETRv2 model"):
        CocoNetwork(tmp_path, CPU)


CPU = torch.device("cpu")


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
