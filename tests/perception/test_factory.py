"""From the configuration to running parts, and what is missing for them."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from onemap_perception import factory
from onemap_perception.config import OpenClipConvNextParams, PerceptionConfig
from onemap_perception.detectors.networks import CocoNetwork
from onemap_perception.detectors.protocol import Detection, Image
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_detector, make_encoder
from onemap_perception.service import build
from onemap_shared import keys
from onemap_shared.config import ConfigError, section
from onemap_shared.messages import TextEmbeddings, TextRequest
from onemap_shared.runner import StartError
from tests.memory_bus import MemoryRouter
from tests.perception.tiny import needs_open_clip, open_clip_folder, owl_folder, rtdetr_folder
from tests.perception.toy import ColourEncoder, frame


def configured(document: dict[str, Any]) -> PerceptionConfig:
    return section({"perception": document}, "perception", PerceptionConfig)


@pytest.mark.parametrize(
    ("document", "sentence"),
    [
        (
            {"encoder": {"backend": "openclip_convnext", "modle": "x", "model": "x"}},
            "perception.encoder.modle is unknown; did you mean 'model'?",
        ),
        ({"encoder": {"backend": "mini", "thread": 1}}, "perception.encoder.thread is unknown"),
        ({"encoder": {"backend": "clip"}}, "perception.encoder: Input tag 'clip'"),
        ({"encoder": {"backend": "photo"}}, "perception.encoder: the encoder photo is gone"),
        ({"encoder": {"backend": "tipsv2"}}, "perception.encoder.model: Field required"),
        (
            {"detector": {"backend": "routed", "score_treshold": 0.5}},
            "perception.detector.score_treshold is unknown; did you mean 'score_threshold'?",
        ),
        ({"frame_timeout_s": 3}, "perception.frame_timeout_s is unknown; there are encoder, "),
        ({"patches": {"min_patches": 2}}, "remove it, since 'onemap config schema' lists"),
        ({"encoder": {"backend": "tipsv2", "model": "x", "device": "gpu"}}, "should match pattern"),
        ({"mini": {"colour": 1}}, "perception.encoder.colour is unknown"),
    ],
)
def test_mistakes_are_refused_with_their_path(document: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ConfigError) as refusal:
        configured(document)
    assert sentence in str(refusal.value)


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
    monkeypatch.setattr("onemap_perception.model_store.cached", lambda *_: None)
    document = {"backend": "openclip_convnext", "model": "laion/CLIP-x"}
    with pytest.raises(StartError, match="not on this machine: onemap models use laion/CLIP-x"):
        build(MemoryRouter().bus(), configured({"encoder": document}))


class OnlyCosines(ColourEncoder):
    """A toy without calibration."""

    def embed_text(self, texts: Any) -> TextEmbeddings:
        rows = np.ones((len(texts), 3), np.float32)
        none = np.zeros((0, 3), np.float32)
        mask = np.zeros((len(texts), 0), np.uint8)
        return TextEmbeddings("toy", "colours", tuple(texts), rows, none, mask, 1.0)


def test_patches_need_a_calibrated_encoder() -> None:
    with pytest.raises(BackendError, match="needs an encoder calibrated with labels"):
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
    place = "tests.perception.test_factory"
    if group == "onemap.encoders":
        return [EntryPoint("colours", "tests.perception.toy:ColourEncoder", group)]
    assert group == "onemap.detectors"
    return [
        EntryPoint("corner", f"{place}:Corner", group),
        EntryPoint("broken", f"{place}:entries", group),
        EntryPoint("dict", "builtins:dict", group),
    ]


def test_a_users_own_encoder_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(factory, "entry_points", entries)
    document = {"backend": "plugin", "name": "colours"}
    encoder = make_encoder(configured({"encoder": document}).encoder)
    assert encoder.embed_text(["red"]).encoder_id == ColourEncoder.encoder_id


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
        (
            "yolo",
            r"no installed package has the detector 'yolo' \(there is: broken, corner, dict\)",
        ),
        ("broken", "the detector 'broken' cannot be loaded"),
        ("dict", "the detector 'dict' lacks detector_id, reads_features, detect"),
    ],
)
def test_a_bad_plugin_is_one_sentence(
    name: str, sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(factory, "entry_points", entries)
    with pytest.raises(BackendError, match=sentence):
        factory.load_plugin("detector", name, {})


ENCODE = """
import numpy as np
from onemap_perception.config import MiniParams
from onemap_perception.encoders.mini import MiniEncoder
MiniEncoder(MiniParams()).encode(np.zeros((48, 64, 3), np.uint8))
"""


@pytest.mark.slow
def test_nothing_is_kept_for_sending(tmp_path: Path) -> None:
    """With its telemetry on, onnxruntime queues events in a database below the home folder."""
    listed = {name: value for name, value in os.environ.items() if not name.startswith("ORT_")}
    listed.pop("CI", None)  # which would silence it by itself
    quiet = {**listed, "HOME": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    subprocess.run([sys.executable, "-c", ENCODE], env=quiet, check=True, timeout=60)
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


CPU = torch.device("cpu")
USERS: dict[str, tuple[str, Callable[[Path], object]]] = {
    "openclip_convnext": (
        "open_clip",
        lambda folder: make_encoder(OpenClipConvNextParams(model=str(folder))),
    ),
    "coco": ("transformers", lambda folder: CocoNetwork(folder, CPU)),
}


def without(library: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Forget that the library was imported."""
    for name in list(sys.modules):
        if name.split(".")[0] == library:
            monkeypatch.delitem(sys.modules, name)


@pytest.mark.parametrize("backend", USERS)
def test_a_missing_library_is_an_error_with_the_command_to_install_it(
    backend: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    library, make = USERS[backend]
    without(library, monkeypatch)
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(
        BackendError, match=f"{backend} needs {library}.*: pip install -e '."
    ) as error:
        make(tmp_path)
    assert "\n" not in str(error.value)
