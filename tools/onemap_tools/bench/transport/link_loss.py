"""What thin links cost: how features and variances change, and with them the order of places."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from onemap_perception.encoders.mini import SHIPPED
from onemap_perception.encoders.params import EncoderParams
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_encoder, with_channels
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_shared.compression import Codec, Compression, decompress
from onemap_shared.geometry import F16, F32, U8
from onemap_tools.bench.transport.streams import Stream, make_stream

QUALITIES = (70, 80, 90, 95)
CHANNELS = (32, 64, 128, 192)
RECOMMENDED_QUALITY, RECOMMENDED_CHANNELS = 95, 128
BEST_SHARE = 0.05  # of the patches: those that a search would go to


@dataclass(frozen=True, slots=True)
class Variant:
    """What is done to a frame's way: JPEG of this quality (0: raw), so many channels (0: all),
    int8 features or float16."""

    quality: int = 0
    channels: int = 0
    int8: bool = False

    @property
    def name(self) -> str:
        """For the report."""
        parts = [
            f"jpeg {self.quality}" if self.quality else "",
            f"{self.channels} channels" if self.channels else "",
            "int8" if self.int8 else "",
        ]
        return " + ".join(part for part in parts if part) or "raw"


VARIANTS = (
    *(Variant(quality=quality) for quality in QUALITIES),
    Variant(int8=True),
    *(Variant(channels=channels) for channels in CHANNELS),
    Variant(RECOMMENDED_QUALITY, 0, int8=True),
    Variant(RECOMMENDED_QUALITY, RECOMMENDED_CHANNELS, int8=True),
)


def run(
    encoder: EncoderParams,
    size_px: tuple[int, int],
    images: int,
    variants: Sequence[Variant] = VARIANTS,
) -> Iterator[dict[str, Any]]:
    """One row for each variant, then one for the variances; ValueError without the encoder."""
    try:
        full = make_encoder(encoder)
        stream = make_stream(encoder, size_px, images)
        words = load_vocabulary(SHIPPED).names
        before = cosines(full, stream.rgb, words)
        for variant in variants:
            narrow = with_channels(full, variant.channels)
            yield {"variant": variant.name} | loss(before, arrived(narrow, stream, variant, words))
    except BackendError as problem:
        raise ValueError(str(problem)) from problem
    yield {"variant": "variance log8"} | variance_loss(stream)


def arrived(encoder: Encoder, stream: Stream, variant: Variant, words: Sequence[str]) -> F32:
    """Cosines as they arrive at the map: (images x patches, words)."""
    images = stream.rgb
    if variant.quality:
        jpeg = Compression(Codec.JPEG, variant.quality)
        images = np.stack([_there_and_back(jpeg, image) for image in images])
    return cosines(encoder, images, words, int8=variant.int8)


def cosines(encoder: Encoder, images: U8, words: Sequence[str], *, int8: bool = False) -> F32:
    """Of every patch of the images with every word: (images x patches, words)."""
    features: list[F16] = [encoder.encode(image) for image in images]
    if int8:
        features = [_there_and_back(Compression(Codec.INT8), each) for each in features]
    flat = np.concatenate([each.reshape(-1, each.shape[-1]) for each in features])
    wide = flat.astype(np.float32)
    unit = wide / np.maximum(np.linalg.norm(wide, axis=1, keepdims=True), 1e-6)
    made: F32 = unit @ encoder.embed_text(words).embeddings.T
    return made


def loss(before: F32, after: F32) -> dict[str, float]:
    """How cosines (patches, words) changed: by how much, and the order of the patches.

    rank_correlation is Spearman's, the mean and the least of the words; best_kept is the share of
    the best patches of a word that are among the best afterwards.
    """
    change = np.abs(before - after)
    count = max(int(BEST_SHARE * len(before)), 1)
    correlations, kept = [], []
    for old, new in zip(before.T, after.T, strict=True):
        old_rank, new_rank = (np.argsort(np.argsort(each)) for each in (old, new))
        correlations.append(float(np.corrcoef(old_rank, new_rank)[0, 1]))
        best = [set(np.argsort(-each)[:count].tolist()) for each in (old, new)]
        kept.append(len(best[0] & best[1]) / count)
    return {
        "cosine_change_mean": round(float(change.mean()), 4),
        "cosine_change_p99": round(float(np.quantile(change, 0.99)), 4),
        "rank_correlation": round(float(np.mean(correlations)), 4),
        "rank_correlation_least": round(min(correlations), 4),
        "best_kept": round(float(np.mean(kept)), 3),
    }


def variance_loss(stream: Stream) -> dict[str, float]:
    """Largest and mean relative change of the usable variances."""
    changes = []
    for variance in stream.variance:
        received = _there_and_back(Compression(Codec.LOG8), variance)
        usable = np.isfinite(variance)
        changes.append(np.abs(received[usable] / variance[usable] - 1))
    together = np.concatenate(changes)
    return {
        "relative_change_mean": round(float(together.mean()), 4),
        "relative_change_max": round(float(together.max()), 4),
    }


def _there_and_back(how: Compression, array: np.ndarray) -> Any:
    return decompress(how.codec.value, how.compress(array), array.dtype, array.shape)
