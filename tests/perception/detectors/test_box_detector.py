"""``BoxDetector`` around a network with fixed boxes, and loading of folders."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from onemap_perception.detectors.boxes import Box, BoxDetector
from onemap_perception.detectors.params import CocoParams
from onemap_perception.detectors.protocol import DetectorError
from onemap_perception.encoders.checkpoint import load_pretrained
from onemap_shared.geometry import U8
from tests.perception.detectors.samples import names, noise


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


def test_without_a_supported_name_the_network_does_not_run() -> None:
    network = FixedBoxes()
    detector = BoxDetector(network, CocoParams())
    assert detector.detect(noise(), names("unicorn")) == ()
    assert detector.detect(noise(), names()) == ()
    assert network.asked == []


class Unwhole:
    """A model class of transformers whose checkpoint lacks two tensors."""

    @staticmethod
    def from_pretrained(folder: Path, **options: bool) -> tuple[None, dict[str, set[str]]]:
        return None, {"missing_keys": {"head.weight", "body.bias"}}


class Unreadable:
    @staticmethod
    def from_pretrained(folder: Path, **options: bool) -> None:
        raise OSError("no file named config.json\nand more")


def test_a_checkpoint_that_lacks_a_tensor_is_refused_by_its_name(tmp_path: Path) -> None:
    with pytest.raises(DetectorError, match=r"another architecture: it lacks body\.bias"):
        load_pretrained(Unwhole, tmp_path, what="model", error=DetectorError)


def test_a_folder_that_cannot_be_read_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(DetectorError, match=r"holds no model: no file named config\.json$"):
        load_pretrained(Unreadable, tmp_path, what="model", error=DetectorError)
