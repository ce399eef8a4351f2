"""From the configuration to running parts."""

from __future__ import annotations

from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from onemap_perception import factory
from onemap_perception.detectors.protocol import Detection, Image
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_detector
from onemap_perception.service import build
from onemap_shared import keys
from onemap_shared.messages import TextEmbeddings, TextRequest
from onemap_shared.runner import StartError
from tests.memory_bus import MemoryRouter
from tests.perception.test_config import configured
from tests.perception.tiny import (
    needs_open_clip,
    open_clip_folder,
    owl_folder,
    rtdetr_folder,
)
from tests.perception.toy import ColourEncoder, frame


@needs_open_clip
def test_a_service_of_other_peoples_parts_sees_and_answers(tmp_path: Path) -> None:
    config = configured(
        {
            "encoder": {
                "backend": "openclip_convnext",
                "model": str(open_clip_folder(tmp_path / "clip")),
                "long_side_px": 64,
            },
            "detector": {
                "backend": "routed",
                "coco_model": str(rtdetr_folder(tmp_path / "coco")),
                "model": str(owl_folder(tmp_path / "owl")),
            },
        }
    )
    router = MemoryRouter()
    fields = router.bus().subscribe(keys.FIELD)
    service = build(router.bus("perception"), config)
    router.bus().publish(keys.ROBOT_RGBD).put(frame())
    service.step(0.0)
    field = fields.take(0.0)
    assert field is not None
    assert field.features.shape == (1, 2, 16)
    reply = router.bus().call(keys.EMBED_TEXT, TextRequest(("a red lamp",)))
    assert (reply.encoder_id, reply.text_space) == (field.encoder_id, field.text_space)
    assert reply.embeddings.shape[1] == field.features.shape[2]


def test_a_model_that_is_not_here_names_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("onemap_perception.model_store.cached", lambda repo, files: None)
    document = {"backend": "openclip_convnext", "model": "laion/CLIP-x"}
    with pytest.raises(StartError, match="not on this machine: onemap models fetch laion/CLIP-x"):
        build(MemoryRouter().bus(), configured({"encoder": document}))


class OnlyCosines(ColourEncoder):
    """A toy without calibration."""

    def embed_text(self, texts: Any) -> TextEmbeddings:
        rows = np.ones((len(texts), 3), np.float32)
        none = np.zeros((0, 3), np.float32)
        mask = np.zeros((len(texts), 0), np.uint8)
        return TextEmbeddings("toy", "colours", tuple(texts), rows, none, mask, 1.0)


def test_patches_need_a_calibrated_encoder() -> None:
    with pytest.raises(BackendError, match="needs an encoder with calibrated scores"):
        make_detector(configured({}).detector, OnlyCosines())


class Corner:
    """A user's detector: everything is in the corner."""

    detector_id = "corner"
    reads_features = False

    def __init__(self, score: float) -> None:
        self._score = score

    def detect(self, image: Image, names: TextEmbeddings) -> tuple[Detection, ...]:
        mask = np.ones((1, 1), bool)
        return tuple(Detection(name, self._score, (0, 0, 1, 1), mask) for name in names.texts)


def entries(group: str) -> list[EntryPoint]:
    assert group == "onemap.detectors"
    place = "tests.perception.test_factory"
    return [
        EntryPoint("corner", f"{place}:Corner", group),
        EntryPoint("broken", f"{place}:entries", group),
        EntryPoint("dict", "builtins:dict", group),
    ]


def test_a_users_own_detector_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(factory, "entry_points", entries)
    document = {"backend": "plugin", "name": "corner", "options": {"score": 0.7}}
    detector = make_detector(configured({"detector": document}).detector, OnlyCosines())
    (found,) = detector.detect(
        Image(np.zeros((2, 2, 3), np.uint8)),
        OnlyCosines().embed_text(["cup"]),
    )
    assert (found.name, found.score) == ("cup", 0.7)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("yolo", r"no installed package has a detector 'yolo' \(there is: broken, corner, dict\)"),
        ("broken", "the detector 'broken' cannot be loaded"),
        ("dict", "the detector 'dict' lacks detector_id, reads_features, detect"),
    ],
)
def test_a_bad_plugin_is_one_sentence(
    name: str, sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(factory, "entry_points", entries)
    with pytest.raises(BackendError, match=sentence):
        factory.load_plugin(name, {})
