"""What perception publishes and answers: feature fields, detections, text embeddings."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F16, F32, F64, I32, I64, U8, U16, Bool, check_rigid
from onemap_shared.messages.checks import (
    ADDED,
    check_image,
    check_name,
    check_picture,
    clean_texts,
    expect,
    expect_finite,
    expect_share,
)

# Texts of an encoder without neutral words mean the same from this cosine on. Not measured (no
# weights are at hand); chosen high, so that paraphrases rather fail to compete than block.
SAME_MEANING_COSINE = 0.9

# Sums of inverse variances stay finite and above zero in float32. Models give 0.1 to 1e5.
MIN_VARIANCE, MAX_VARIANCE = 1e-6, 1e12


@dataclass(frozen=True, slots=True)
class FeatureField:
    """Language-aligned patch features of one frame, with a variance for each depth pixel.

    Attributes:
        features: (h, w, D) L2-normalised per patch; patch (i, j) covers the i-th of h rows and
            the j-th of w columns of patches of the image.
        variance: (H, W) variance of the observation, 1e-6 to 1e12; infinity = do not use this
            pixel.
        depth_mm: (H, W) depth as in the frame: millimetres, 0 = no return.
        world: of the frame.
    """

    sequence: int
    stamp_ns: int
    encoder_id: str
    text_space: str
    features: F16
    variance: F32
    depth_mm: U16
    intrinsics: Intrinsics
    T_map_camera: F64
    world: str = field(default="", metadata=ADDED)

    def __post_init__(self) -> None:
        check_name(self.world, "world")
        expect(self.features, "features", np.float16, (None, None, None))
        expect(self.variance, "variance", np.float32, (None, None))
        expect(self.depth_mm, "depth_mm", np.uint16, self.variance.shape)
        if self.features.size == 0 or self.depth_mm.size == 0:
            raise ValueError("the feature field is empty")
        self.intrinsics.check_image(self.depth_mm.shape[1], self.depth_mm.shape[0])
        expect_finite(self.features, "features")
        usable = (self.variance <= MAX_VARIANCE) | np.isinf(self.variance)
        if not (self.variance.min() >= MIN_VARIANCE and usable.all()):  # also refuses NaN
            raise ValueError(
                f"variance must be positive, {MIN_VARIANCE:g} to {MAX_VARIANCE:g} (infinity marks "
                "unusable pixels)"
            )
        check_rigid(self.T_map_camera, "T_map_camera")


@dataclass(frozen=True, slots=True)
class Detections:
    """Detections of one frame, for the names of the present search.

    Attributes:
        detector_id: which detector made them.
        names: one name for each of the N detections.
        boxes_px: (N, 4) x0, y0, x1, y1 in pixels of the frame.
        scores: (N,) in [0, 1].
        points_map: (P, 3) surface points of all detections, in metres of the map frame.
        point_owner: (P,) index of the detection that a point belongs to.
        picture: the frame as JPEG, in which the target was detected; else empty.
        picture_scale: pixels of the picture for one pixel of the frame, at most 1.
        independent: whether the detector does not read the features that the map holds, so that
            it can tell what the map cannot.
    """

    sequence: int
    stamp_ns: int
    detector_id: str
    names: tuple[str, ...]
    boxes_px: F32
    scores: F32
    points_map: F32
    point_owner: I32
    picture: bytes = b""
    picture_scale: float = 1.0
    independent: bool = False

    def __post_init__(self) -> None:
        count = len(self.names)
        check_picture(self.picture)
        if not 0.0 < self.picture_scale <= 1.0:  # also refuses NaN
            raise ValueError(f"picture_scale is {self.picture_scale}; it must lie in (0, 1]")
        expect(self.boxes_px, "boxes_px", np.float32, (count, 4))
        expect(self.scores, "scores", np.float32, (count,))
        expect(self.points_map, "points_map", np.float32, (None, 3))
        expect(self.point_owner, "point_owner", np.int32, (len(self.points_map),))
        for name in ("boxes_px", "scores", "points_map"):
            expect_finite(getattr(self, name), name)
        if self.point_owner.size and not (
            self.point_owner.min() >= 0 and self.point_owner.max() < count
        ):
            raise ValueError(f"point_owner must lie in [0, {count})")


@dataclass(frozen=True, slots=True)
class TextRequest:
    """Texts to embed.

    Attributes:
        texts: 1 to 256 texts.
    """

    texts: tuple[str, ...]

    def __post_init__(self) -> None:
        if not 1 <= len(self.texts) <= 256:
            raise ValueError(
                f"{len(self.texts)} texts in one request; between 1 and 256 are allowed"
            )
        clean_texts(self, "texts")


@dataclass(frozen=True, slots=True)
class ImageRequest:
    """A picture of one thing to embed, so that it can be asked for as a text can.

    Attributes:
        image: a PNG or JPEG of 16 to 4096 pixels on each side, at most 512 kB.
    """

    image: bytes

    def __post_init__(self) -> None:
        check_image(self.image)


@dataclass(frozen=True, slots=True)
class TextEmbeddings:
    """Embeddings of texts, with the calibration that turns a cosine into a score.

    An image has one too, in the place of a text's.

    score = softmax over {text, competing neutrals} of temperature * cosine. Without neutral words
    (M = 0) the encoder has no calibration and score = (1 + cosine) / 2.

    Attributes:
        texts: the N texts of the request.
        embeddings: (N, D) unit rows.
        neutral: (M, D) unit rows: other concepts that a cell may show.
        neutral_mask: (N, M) 1 where neutral word m competes with text n (synonyms do not).
        temperature: factor of the cosine in the softmax.
        floor: a best score below this means "not here"; 0: not measured for this encoder.
        nearest: per text, the nearest known words if it is outside the encoder's vocabulary,
            else none; empty for an encoder with an open vocabulary.
    """

    encoder_id: str
    text_space: str
    texts: tuple[str, ...]
    embeddings: F32
    neutral: F32
    neutral_mask: U8
    temperature: float
    floor: float = 0.0
    nearest: tuple[tuple[str, ...], ...] = ()

    def __post_init__(self) -> None:
        expect(self.embeddings, "embeddings", np.float32, (len(self.texts), None))
        expect(self.neutral, "neutral", np.float32, (None, self.embeddings.shape[1]))
        expect(self.neutral_mask, "neutral_mask", np.uint8, (len(self.texts), len(self.neutral)))
        expect_finite(self.embeddings, "embeddings")
        expect_finite(self.neutral, "neutral")
        expect_share(self.floor, "floor")
        if self.nearest and len(self.nearest) != len(self.texts):
            raise ValueError(f"nearest has {len(self.nearest)} entries for {len(self.texts)} texts")

    def only(self, rows: I64) -> TextEmbeddings:
        """The texts of these rows (K,)."""
        return replace(
            self,
            texts=tuple(self.texts[row] for row in rows),
            embeddings=self.embeddings[rows],
            neutral_mask=self.neutral_mask[rows],
            nearest=tuple(self.nearest[row] for row in rows) if self.nearest else (),
        )

    def same_meaning(self) -> Bool:
        """Which of the texts mean the same: (N, N) bool, symmetric, true on the diagonal.

        Those do that do not compete with one and the same neutral word; without neutral words,
        those whose cosine is at least ``SAME_MEANING_COSINE``.
        """
        alike: Bool = np.eye(len(self.texts), dtype=bool)
        if len(self.neutral):
            spared = (self.neutral_mask == 0).astype(np.int32)
            alike |= spared @ spared.T > 0
        else:
            alike |= self.embeddings @ self.embeddings.T >= SAME_MEANING_COSINE
        return alike
