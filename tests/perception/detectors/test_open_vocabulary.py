"""Grounding detectors of transformers on tiny random weights."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest
import torch

from onemap_perception.detectors.boxes import BoxDetector
from onemap_perception.detectors.networks import GroundingNetwork
from onemap_perception.detectors.params import OpenVocabularyParams
from onemap_perception.detectors.protocol import DetectorError
from tests.perception.detectors.samples import inside, names, noise
from tests.perception.tiny import grounding_folder, owl_folder, rtdetr_folder

CPU = torch.device("cpu")


@pytest.fixture(scope="module", params=["Owlv2", "GroundingDino", "MMGroundingDino"])
def detector(
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


def test_any_name_is_taken(detector: BoxDetector) -> None:
    found = detector.detect(noise(), names("Red lamp", "unicorn", "電視"))
    assert inside(found, (64, 48))
    assert {each.name for each in found} <= {"Red lamp", "unicorn", "電視"}
    assert detector.detect(noise(), names()) == ()
    assert 1 <= max(Counter(each.name for each in found).values()) <= 16


@pytest.mark.parametrize("size", [(1, 1), (7, 33), (480, 3)])
def test_images_of_any_size_are_taken(detector: BoxDetector, size: tuple[int, int]) -> None:
    found = detector.detect(noise(*size), names("chair"))
    assert inside(found, size[::-1])


def test_a_folder_of_something_else_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("transformers", reason="needs transformers")
    with pytest.raises(DetectorError, match="holds no grounding detector"):
        GroundingNetwork(tmp_path, CPU)
    rtdetr_folder(tmp_path)
    with pytest.raises(DetectorError, match="holds no grounding detector"):
        GroundingNetwork(tmp_path, CPU)
