"""The shipped encoder ``mini``: an ONNX network on the CPU and its vocabulary.

It is trained on the simulator's apartments. See mini/MODEL_CARD.md.
"""
# Touches files: weights, words, calibration.

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from onemap_perception.config import SHIPPED, MiniParams
from onemap_perception.encoders.images import fitted_size, mean_feature, resized
from onemap_perception.errors import BackendError
from onemap_perception.onnx import open_session
from onemap_perception.text.embeddings import CachedTextEncoder
from onemap_perception.text.minilm import MiniLm, find_model_folder
from onemap_perception.text.queries import QueryEncoder
from onemap_perception.text.vocabulary import load_calibration, load_table, load_vocabulary
from onemap_shared.geometry import F16, U8
from onemap_shared.messages import TextEmbeddings, expect

STRIDE = 8
# Of a crop as it is fed in, the longer side: things in a frame of 320 pixels are about as large.
# Chosen on even seeds.
CROP_SIDE_PX = 160
INPUT_WIDTH_PX = 320  # wider images are reduced to this: what the network was trained on
NETWORK_FILE = "mini.onnx"
TEXT_SPACE = "all-MiniLM-L6-v2"
CACHED_TEXTS = 4096  # embeddings outside the table that are kept: 6 MB at 384 numbers


class MiniEncoder:
    """Implements ``Encoder``. Raises BackendError when its files are missing or damaged.

    raw: see ``QueryEncoder``. text: its words.
    """

    def __init__(self, params: MiniParams, *, raw: bool = False) -> None:
        path = params.folder / NETWORK_FILE
        self._session = _open(path)
        self._id = f"mini-{hashlib.sha256(path.read_bytes()).hexdigest()[:8]}"
        self.text = _load_text(params.folder, raw=raw)

    @property
    def encoder_id(self) -> str:
        """``mini-`` and the first digits of the weights' SHA-256."""
        return self._id

    @property
    def text_space(self) -> str:
        """The sentence encoder whose space it is."""
        return TEXT_SPACE

    def encode(self, rgb: U8) -> F16:
        """See ``Encoder``; one patch per 8 x 8 pixels of the image as it is fed in."""
        expect(rgb, "rgb", np.uint8, (None, None, 3))
        size = input_size(rgb.shape[1], rgb.shape[0], INPUT_WIDTH_PX)
        if size != (rgb.shape[1], rgb.shape[0]):
            rgb = cv2.resize(rgb, size, interpolation=cv2.INTER_AREA).astype(np.uint8)
        try:
            features: F16 = self._session.run(["features"], {"rgb": np.ascontiguousarray(rgb)})[0]
        except Exception as problem:  # onnxruntime's errors share no other base class
            size = (rgb.shape[1], rgb.shape[0])
            raise BackendError(f"onnxruntime failed on a {size} image: {problem}") from problem
        return features

    def embed_text(self, texts: Sequence[str]) -> TextEmbeddings:
        """See ``Encoder``."""
        return self.text.queries(texts, encoder_id=self._id, text_space=TEXT_SPACE)

    def embed_image(self, rgb: U8) -> TextEmbeddings:
        """See ``Encoder``: asked as a word that names no class, with the mean of the patches.

        The words that are like it do not compete, the others do.
        """
        features = self.encode(crop_of(rgb))
        vector = mean_feature(features, np.ones(features.shape[:2], np.float32))
        return self.text.vector_query(vector, encoder_id=self._id, text_space=TEXT_SPACE)


def crop_of(rgb: U8) -> U8:
    """A picture (H, W, 3) of one thing at the size that things have in an image."""
    size = fitted_size(rgb.shape[1], rgb.shape[0], long_side_px=CROP_SIDE_PX, stride=STRIDE)
    return resized(rgb, size)


def input_size(width: int, height: int, limit_px: int) -> tuple[int, int]:
    """(width, height) fed to the network: multiples of 8, at most ``limit_px`` wide."""
    scale = min(1.0, limit_px / width)
    columns, rows = (max(round(side * scale / STRIDE), 1) for side in (width, height))
    return columns * STRIDE, rows * STRIDE


def _open(path: Path) -> Any:
    if not path.is_file():
        remedy = (
            "reinstall OneMap"
            if path.parent == SHIPPED
            else "correct perception.encoder.folder, or make them with 'onemap train mini'"
        )
        raise BackendError(f"the encoder's weights {path} are missing: {remedy}")
    try:
        return open_session(path, threads=1)  # the other cores run other services
    except ValueError as problem:
        raise BackendError(f"the encoder's weights {path} are damaged: {problem}") from problem


def _load_text(folder: Path, *, raw: bool) -> QueryEncoder:
    model = find_model_folder()
    try:
        vocabulary = load_vocabulary(folder)
        fallback, knows = None, None
        if model is not None:
            tower = MiniLm(model)
            fallback = CachedTextEncoder(
                tower.embed, prompt=vocabulary.prompt, capacity=CACHED_TEXTS
            )
            knows = tower.knows
        table = load_table(folder, fallback=fallback)
        return QueryEncoder(vocabulary, table, load_calibration(folder), knows=knows, raw=raw)
    except ValueError as problem:
        raise BackendError(str(problem)) from problem
