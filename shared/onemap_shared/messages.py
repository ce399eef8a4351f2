"""Every message that travels between services, as frozen dataclasses.

A message checks itself when it is built, on both sides of the wire: whoever
holds one holds a valid one. Arrays are read-only for the receiver. ``stamp_ns``
is always the capture time of the camera frame the content derives from, in
nanoseconds of the wall clock; ``sequence`` counts that robot's frames.
Zero-length arrays stand for "not asked for".
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum, IntEnum

import numpy as np
from numpy.typing import NDArray

from onemap_shared.geometry import F32, F64, I32, I64, U8, U16, Bool, Intrinsics, check_rigid
from onemap_shared.grid import GridSpec

MAX_TEXT_CHARS = 200  # one object name, not an essay
MAX_OBJECTS = 20  # objects of one search
# Texts of an encoder without neutral words mean the same from this cosine on. Not measured (no
# weights are at hand); chosen high, so that paraphrases rather fail to compete than block.
SAME_MEANING_COSINE = 0.9
MAX_RIVALS = 30  # names that compete in one view: the mapper keeps the scores of 32 texts
MAX_PIXELS = 4096 * 4096
F16 = NDArray[np.float16]


class Occupancy(IntEnum):
    """What a map cell is known to be, for driving."""

    UNKNOWN = 0
    FREE = 1
    OCCUPIED = 2


class Layer(IntEnum):
    """Bit flags of ``SearchView.layers``."""

    OBSERVED = 1  # O: any feature was fused here
    EXPLORED = 2  # E: variance below the threshold
    SEARCHED = 4  # C: the same, since the search of this object began


class SearchState(str, Enum):
    """States of a search; the last four are final."""

    EXPLORING = "exploring"
    APPROACHING = "approaching"
    CONFIRMING = "confirming"
    FOUND = "found"
    NOT_FOUND = "not_found"
    FAILED = "failed"
    CANCELLED = "cancelled"

    def __str__(self) -> str:
        return self.value


FINAL_STATES = frozenset(
    {SearchState.FOUND, SearchState.NOT_FOUND, SearchState.FAILED, SearchState.CANCELLED}
)


def expect(array: np.ndarray, name: str, dtype: type, shape: tuple[int | None, ...]) -> None:
    """Raise ValueError unless ``array`` has this dtype and shape (None is any length)."""
    if array.dtype != np.dtype(dtype):
        raise ValueError(f"{name} has dtype {array.dtype}; expected {np.dtype(dtype)}")
    fits = array.ndim == len(shape) and all(
        want is None or have == want for have, want in zip(array.shape, shape, strict=True)
    )
    if not fits:
        wanted = tuple("any" if n is None else n for n in shape)
        raise ValueError(f"{name} has shape {array.shape}; expected {wanted}")


def expect_finite(array: np.ndarray, name: str) -> None:
    """Raise ValueError if any value is NaN or infinite."""
    if not np.isfinite(array).all():
        raise ValueError(f"{name} contains NaN or infinity")


def _expect_share(value: float, name: str) -> None:
    """Raise ValueError unless 0 <= value <= 1; also refuses NaN."""
    if not 0.0 <= value <= 1.0:
        raise ValueError(f"{name} is {value}; it must lie in [0, 1]")


def check_text(text: str, what: str = "text") -> str:
    """Return the text stripped and with single spaces, or raise ValueError with one sentence."""
    if not isinstance(text, str):
        raise ValueError(f"{what} must be a string, not {type(text).__name__}")
    cleaned = " ".join(text.split())
    if not cleaned:
        raise ValueError(f"{what} is empty: name an object, for example 'sofa'")
    if len(cleaned) > MAX_TEXT_CHARS:
        raise ValueError(
            f"{what} has {len(cleaned)} characters; the limit is {MAX_TEXT_CHARS}: "
            "name an object, for example 'sofa'"
        )
    if not any(character.isalpha() for character in cleaned) or not cleaned.isprintable():
        raise ValueError(f"{what} holds no readable word: name an object, for example 'sofa'")
    return cleaned


# ---------------------------------------------------------------- robot


@dataclass(frozen=True, slots=True)
class RgbdFrame:
    """One aligned colour and depth image with the camera's pose at capture.

    rgb (H, W, 3) uint8; depth_mm (H, W) uint16 along the optical axis, 0 = no return;
    T_map_camera (4, 4) float64, rigid.
    """

    sequence: int
    stamp_ns: int
    rgb: U8
    depth_mm: U16
    intrinsics: Intrinsics
    T_map_camera: F64

    def __post_init__(self) -> None:
        expect(self.rgb, "rgb", np.uint8, (None, None, 3))
        expect(self.depth_mm, "depth_mm", np.uint16, self.rgb.shape[:2])
        if self.depth_mm.size == 0:
            raise ValueError("the image has no pixels")
        check_rigid(self.T_map_camera, "T_map_camera")


@dataclass(frozen=True, slots=True)
class Odometry:
    """Where the robot's body is and how fast it moves (body frame: x forward, z up)."""

    sequence: int
    stamp_ns: int
    T_map_body: F64
    linear_mps: float
    angular_radps: float
    collided: bool = False

    def __post_init__(self) -> None:
        check_rigid(self.T_map_body, "T_map_body")


@dataclass(frozen=True, slots=True)
class VelocityCommand:
    """Drive with this velocity for at most ``validity_ms`` after it arrived, then brake."""

    sequence: int
    stamp_ns: int
    linear_mps: float
    angular_radps: float
    validity_ms: int = 300

    def __post_init__(self) -> None:
        if not np.isfinite((self.linear_mps, self.angular_radps)).all():
            raise ValueError("velocity is NaN or infinite")


# ---------------------------------------------------------------- perception


@dataclass(frozen=True, slots=True)
class FeatureField:
    """Language-aligned patch features of one frame, with a variance for each depth pixel.

    features (h, w, D) float16, L2-normalised per patch; patch (i, j) covers the image's
    i-th of h rows of patches. variance (H, W) float32 > 0, infinity = do not use.
    depth_mm (H, W) uint16, intrinsics and T_map_camera as in the frame.
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

    def __post_init__(self) -> None:
        expect(self.features, "features", np.float16, (None, None, None))
        expect(self.variance, "variance", np.float32, (None, None))
        expect(self.depth_mm, "depth_mm", np.uint16, self.variance.shape)
        if self.features.size == 0 or self.depth_mm.size == 0:
            raise ValueError("the feature field is empty")
        expect_finite(self.features, "features")
        if not (self.variance > 0).all():  # also refuses NaN
            raise ValueError("variance must be positive (infinity marks unusable pixels)")
        check_rigid(self.T_map_camera, "T_map_camera")


@dataclass(frozen=True, slots=True)
class Detections:
    """What the detector saw in one frame, of the names that are being searched.

    boxes_px (N, 4) float32 x0, y0, x1, y1; scores (N,) float32 in [0, 1]; names one each.
    points_map (P, 3) float32 metres: surface points of all detections;
    point_owner (P,) int32: which detection a point belongs to.
    """

    sequence: int
    stamp_ns: int
    detector_id: str
    names: tuple[str, ...]
    boxes_px: F32
    scores: F32
    points_map: F32
    point_owner: I32

    def __post_init__(self) -> None:
        count = len(self.names)
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
    """Texts to embed."""

    texts: tuple[str, ...]

    def __post_init__(self) -> None:
        if not 1 <= len(self.texts) <= 256:
            raise ValueError(
                f"{len(self.texts)} texts in one request; between 1 and 256 are allowed"
            )
        for text in self.texts:
            check_text(text)


@dataclass(frozen=True, slots=True)
class TextEmbeddings:
    """Embeddings and how to turn a cosine into a score.

    embeddings (N, D) float32 unit rows. neutral (M, D) float32 unit rows: other concepts a
    cell may show; neutral_mask (N, M) uint8, 1 where neutral word m competes with text n
    (synonyms do not). score = softmax over {text, competing neutrals} of temperature * cosine.
    M = 0: the encoder has no calibration and score = (1 + cosine) / 2.
    floor: a best score below this means "not here"; 0: not measured for this encoder.
    nearest: per text, known words closest to it if the encoder cannot place the text, else
    none; () for an encoder that places every text.
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
        _expect_share(self.floor, "floor")
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


# ---------------------------------------------------------------- mapper


@dataclass(frozen=True, slots=True)
class MapRevision:
    """The state of the map after the newest fused frame; revision counts every change."""

    revision: int
    sequence: int
    stamp_ns: int
    encoder_id: str
    text_space: str
    frames_fused: int
    cells_observed: int
    memory_bytes: int
    update_ms: float
    rate_hz: float


@dataclass(frozen=True, slots=True)
class SimilarityRequest:
    """Where is this?"""

    text: str
    max_regions: int = 5
    include_grid: bool = False

    def __post_init__(self) -> None:
        check_text(self.text)
        if not 1 <= self.max_regions <= 100:
            raise ValueError(f"max_regions is {self.max_regions}; it must lie in [1, 100]")


@dataclass(frozen=True, slots=True)
class SimilarityReply:
    """Ranked regions of high similarity, best first, and the grid if it was asked for.

    No region scores below ``floor``; ``best_score`` is that of the best region before those were
    left out, 0 if nothing was observed. ``nearest``: known words near a text that the encoder
    cannot place.
    centres_m (N, 2), extents_m (N, 4) x_min, y_min, x_max, y_max, scores (N,) in [0, 1],
    variances (N,), all float32. scores_grid (nx, ny) float32, NaN where nothing was
    observed; (0, 0) if not asked for.
    """

    text: str
    revision: int
    stamp_ns: int
    encoder_id: str
    centres_m: F32
    extents_m: F32
    scores: F32
    variances: F32
    grid: GridSpec
    scores_grid: F32
    best_score: float = 0.0
    floor: float = 0.0
    nearest: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        count = len(self.scores)
        expect(self.centres_m, "centres_m", np.float32, (count, 2))
        expect(self.extents_m, "extents_m", np.float32, (count, 4))
        expect(self.scores, "scores", np.float32, (count,))
        expect(self.variances, "variances", np.float32, (count,))
        expect(self.scores_grid, "scores_grid", np.float32, (None, None))
        _expect_share(self.best_score, "best_score")
        _expect_share(self.floor, "floor")


@dataclass(frozen=True, slots=True)
class SearchViewRequest:
    """The layers of the map for one object; an empty text asks for no similarity.

    rivals: other names that what looks like ``text`` may be.
    """

    text: str = ""
    rivals: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.text:
            check_text(self.text)
        if len(self.rivals) > MAX_RIVALS:
            raise ValueError(f"{len(self.rivals)} rivals; at most {MAX_RIVALS} are compared")
        for name in self.rivals:
            check_text(name, "rival")


@dataclass(frozen=True, slots=True)
class SearchView:
    """All a planner needs of the map, of one instant.

    occupancy (nx, ny) uint8, values of ``Occupancy``; layers (nx, ny) uint8, bits of
    ``Layer``; similarity (nx, ny) float32 score in [0, 1], NaN where not observed,
    (0, 0) without a text; rival the same for the best of the request's rivals, (0, 0) without
    any that the encoder knows. stamp_ns is the newest fused frame's, 0 for an empty map.
    """

    text: str
    revision: int
    sequence: int
    stamp_ns: int
    grid: GridSpec
    occupancy: U8
    layers: U8
    similarity: F32
    rival: F32 = field(default_factory=lambda: np.zeros((0, 0), np.float32))

    def __post_init__(self) -> None:
        expect(self.occupancy, "occupancy", np.uint8, self.grid.shape)
        expect(self.layers, "layers", np.uint8, self.grid.shape)
        expect(self.similarity, "similarity", np.float32, (None, None))
        expect(self.rival, "rival", np.float32, (None, None))


@dataclass(frozen=True, slots=True)
class SearchReset:
    """Forget what has been searched (sigma_E), keep what has been learned."""

    search_id: str


@dataclass(frozen=True, slots=True)
class MapFile:
    """Save to or load from this file name (no folder) in the mapper's map folder."""

    name: str


@dataclass(frozen=True, slots=True)
class MapClear:
    """Empty the map."""


@dataclass(frozen=True, slots=True)
class MapSummary:
    """The answer to save, load and clear: what the map now holds, and where the file lies."""

    path: str
    encoder_id: str
    text_space: str
    cell_size_m: float
    cells_observed: int
    frames_fused: int
    file_bytes: int = 0


# ---------------------------------------------------------------- planner


@dataclass(frozen=True, slots=True)
class SearchRequest:
    """Find these objects, one after the other.

    patience_s: how long the caller waits for the answer; afterwards no robot may start.
    """

    objects: tuple[str, ...]
    patience_s: float = 2.0

    def __post_init__(self) -> None:
        if not self.patience_s > 0:  # also refuses NaN
            raise ValueError(f"patience_s is {self.patience_s}; it must be positive")
        if not 1 <= len(self.objects) <= MAX_OBJECTS:
            raise ValueError(
                f"a search has {len(self.objects)} objects; between 1 and {MAX_OBJECTS} are allowed"
            )
        for name in self.objects:
            check_text(name, "object name")


@dataclass(frozen=True, slots=True)
class SearchId:
    """Which search; an empty id means the newest."""

    search_id: str = ""


@dataclass(frozen=True, slots=True)
class ObjectResult:
    """How the search for one object ended. ``position_m`` is (x, y, z), empty if not found."""

    name: str
    outcome: SearchState
    reason: str
    position_m: tuple[float, ...]
    score: float
    duration_s: float
    path_length_m: float
    start_xy_m: tuple[float, ...]
    end_xy_m: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class SearchStatus:
    """Where a search stands. ``state`` of the object now sought; the whole search's when final.

    ``reason`` says in a sentence what is going on or why it ended.
    """

    search_id: str
    state: SearchState
    objects: tuple[str, ...]
    index: int
    reason: str
    results: tuple[ObjectResult, ...]
    started_ns: int
    updated_ns: int
    path_length_m: float

    @property
    def active(self) -> bool:
        """Whether the robot is still at it."""
        return self.state not in FINAL_STATES

    @property
    def target(self) -> str:
        """The object now sought, empty when the search is over."""
        return self.objects[self.index] if self.active and self.index < len(self.objects) else ""


@dataclass(frozen=True, slots=True)
class PlannedPath:
    """What the planner means to do, for display. All arrays float32, metres in the map frame.

    points_m (N, 2) path; goal_m (0 or 1, 2); goal_kind: frontier, region, detection or none.
    frontiers_m (F, 2) with frontier_scores (F,); regions_m (R, 2) with region_scores (R,).
    """

    stamp_ns: int
    goal_kind: str
    goal_reason: str
    points_m: F32
    goal_m: F32
    frontiers_m: F32
    frontier_scores: F32
    regions_m: F32
    region_scores: F32

    def __post_init__(self) -> None:
        expect(self.points_m, "points_m", np.float32, (None, 2))
        expect(self.goal_m, "goal_m", np.float32, (None, 2))
        expect(self.frontiers_m, "frontiers_m", np.float32, (None, 2))
        expect(self.frontier_scores, "frontier_scores", np.float32, (len(self.frontiers_m),))
        expect(self.regions_m, "regions_m", np.float32, (None, 2))
        expect(self.region_scores, "region_scores", np.float32, (len(self.regions_m),))
        for name in ("points_m", "goal_m", "frontiers_m", "regions_m"):
            expect_finite(getattr(self, name), name)


# ---------------------------------------------------------------- simulator only


@dataclass(frozen=True, slots=True)
class TruthRequest:
    """Simulator only: how far is the nearest object of this name from a place, really?"""

    name: str
    x_m: float
    y_m: float


@dataclass(frozen=True, slots=True)
class Truth:
    """Ground truth for the summary of a demo; never read by perception, mapper or planner.

    instances: how many there are; distance_m: straight line from the place to the surface
    of the nearest; shortest_path_m: along the floor for this robot to the nearest place that
    counts as success, 0 if the place itself does; infinity if there is none. nearest: category
    of the thing nearest to the place, walls, floors, ceilings, doors and windows left out;
    empty if there is none or nobody named it.
    names_complete: whether nothing in the scene lacks its name. If not, a name that is not
    among the categories may still be there: nobody can judge a search for it.
    """

    scene: str
    instances: int
    distance_m: float
    shortest_path_m: float
    categories: tuple[str, ...]
    nearest: str
    names_complete: bool


# ---------------------------------------------------------------- health


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """One a second from every service. ``progress`` stops when the service's loop hangs.

    ready: the service does its work; problem: one sentence if something is wrong.
    metrics: name -> number, shown at /metrics as onemap_<service>_<name>.
    """

    service: str
    instance: str
    stamp_ns: int
    progress: int
    ready: bool
    problem: str = ""
    metrics: dict[str, float] = field(default_factory=dict)
