"""What perception publishes and answers: feature fields, detections, text embeddings."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F16, F32, I32, I64, MAX_COORDINATE_M, U8, U16, Bool
from onemap_shared.messages import checks

# Texts of an encoder without neutral words mean the same from this cosine on. Not measured (no
# weights are at hand); chosen high, so that paraphrases rather fail to compete than block.
SAME_MEANING_COSINE = 0.9

# Sums of inverse variances stay finite and above zero in float32. Models give 0.1 to 1e5.
MIN_VARIANCE, MAX_VARIANCE = 1e-6, 1e12


@dataclass(frozen=True, slots=True)
class FeatureField(checks.Message):
    """Language-aligned patch features of one frame, with a variance for each depth pixel.

    Attributes:
        features: (h, w, D) L2-normalised per patch; patch (i, j) covers the i-th of h rows and
            the j-th of w columns of patches of the image.
        variance: (H, W) variance of the observation, 1e-6 to 1e12; infinity = do not use this
            pixel.
        depth_mm: (H, W) depth as in the frame: millimetres, 0 = no return.
        world: of the frame.
        colours: (h, w, 3) mean colour of each patch, as ``colours.packed``; (0, 0, 3): not sent.
    """

    sequence: int
    stamp_ns: int
    encoder_id: str
    text_space: str
    features: Annotated[F16, checks.Shape(None, None, None), checks.finite]
    variance: Annotated[F32, checks.Shape("H", "W")]
    depth_mm: Annotated[U16, checks.Shape("H", "W")]
    intrinsics: Intrinsics
    T_map_camera: checks.Pose
    world: checks.Name = ""
    colours: Annotated[U8, checks.Shape(None, None, 3)] = checks.without(np.uint8, 0, 0, 3)

    def _check(self) -> None:
        if self.colours.size:
            checks.expect(self.colours, "colours", np.uint8, (*self.features.shape[:2], 3))
        if self.features.size == 0 or self.depth_mm.size == 0:
            raise ValueError("the feature field is empty")
        self.intrinsics.check_image(self.depth_mm.shape[1], self.depth_mm.shape[0])
        usable = (self.variance <= MAX_VARIANCE) | np.isinf(self.variance)
        if not (self.variance.min() >= MIN_VARIANCE and usable.all()):  # also refuses NaN
            raise ValueError(
                f"variance must be positive, {MIN_VARIANCE:g} to {MAX_VARIANCE:g} (infinity marks "
                "unusable pixels)"
            )


@dataclass(frozen=True, slots=True)
class Detections(checks.Message):
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
    names: Annotated[tuple[str, ...], checks.Shape("N")]
    boxes_px: Annotated[F32, checks.Shape("N", 4), checks.finite]
    scores: Annotated[F32, checks.Shape("N"), checks.finite]
    points_map: Annotated[F32, checks.Shape("P", 3), checks.finite]
    point_owner: Annotated[I32, checks.Shape("P")]
    picture: checks.Picture = b""
    picture_scale: Annotated[float, checks.within(0, 1, above=True)] = 1.0
    independent: bool = False

    def _check(self) -> None:
        count = len(self.names)
        if self.point_owner.size and not (
            self.point_owner.min() >= 0 and self.point_owner.max() < count
        ):
            raise ValueError(f"point_owner must lie in [0, {count})")
        if self.points_map.size and np.abs(self.points_map).max() > MAX_COORDINATE_M:
            raise ValueError(f"points_map lies beyond {MAX_COORDINATE_M:g} m from the origin")


@dataclass(frozen=True, slots=True)
class TextRequest(checks.Message):
    """Texts to embed.

    Attributes:
        texts: 1 to 256 texts.
    """

    texts: Annotated[tuple[str, ...], checks.items(256, least=1), checks.cleaned()]


@dataclass(frozen=True, slots=True)
class ImageRequest(checks.Message):
    """A picture of one thing to embed, so that it can be asked for as a text can.

    Attributes:
        image: a PNG or JPEG of 16 to 4096 pixels on each side, at most 512 kB.
    """

    image: checks.Image


@dataclass(frozen=True, slots=True)
class TextEmbeddings(checks.Message):
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
        controls: how many of the neutral words, the last ones, name what no home has; without a
            floor, it is the score that one in twenty of them reaches on the map. None of them has
            synonyms among the neutral words.
        stands_for: names of the encoder's classes that are nearest to each text, the nearest
            first; a class's own name alone for a name of it. Empty: the encoder has no classes.
    """

    encoder_id: str
    text_space: str
    texts: Annotated[tuple[str, ...], checks.Shape("N")]
    embeddings: Annotated[F32, checks.Shape("N", "D"), checks.finite]
    neutral: Annotated[F32, checks.Shape("M", "D"), checks.finite]
    neutral_mask: Annotated[U8, checks.Shape("N", "M")]
    temperature: float
    floor: checks.Share = 0.0
    stands_for: tuple[tuple[str, ...], ...] = ()
    controls: int = 0

    def _check(self) -> None:
        if not 0 <= self.controls <= len(self.neutral):
            raise ValueError(f"{self.controls} controls are not among {len(self.neutral)} words")

    def only(self, rows: I64) -> TextEmbeddings:
        """The texts of these rows (K,)."""
        return replace(
            self,
            texts=tuple(self.texts[row] for row in rows),
            embeddings=self.embeddings[rows],
            neutral_mask=self.neutral_mask[rows],
            stands_for=tuple(self.stands_for[row] for row in rows) if self.stands_for else (),
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
