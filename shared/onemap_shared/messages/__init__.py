"""Every message that travels between services, as frozen dataclasses.

A message checks itself when it is built, on both sides of the wire, so every
instance is valid. Arrays are read-only for the receiver. Zero-length arrays stand
for what was not requested.

Each message describes its fields under "Attributes", an array beginning with its
shape. These mean the same wherever a message does not say otherwise:

Attributes:
    sequence: number of the camera frame that the content derives from.
    stamp_ns: capture time of that frame, in nanoseconds of the robot's wall clock.
    encoder_id: which encoder and weights made the features; encoders are never mixed.
    text_space: which text embeddings the features can be compared with.
    intrinsics: of the camera, in pixels of the depth image.
    T_map_camera: (4, 4) rigid transform from the camera frame to the map frame.
    revision: counts every change of the map.
    grid: which cells of the world the grids of this message cover.
    search_id: names the search.
"""

from onemap_shared.messages.checks import (
    MAX_PICTURE_BYTES,
    MAX_TEXT_CHARS,
    check_text,
    expect,
    expect_finite,
    expect_share,
)
from onemap_shared.messages.choice import MAX_GOAL_OPTIONS, NO_CHOICE, GoalChoice, GoalOption
from onemap_shared.messages.ground_truth import Truth, TruthRequest
from onemap_shared.messages.health import Heartbeat
from onemap_shared.messages.images import MAX_IMAGE_BYTES, check_image
from onemap_shared.messages.link import FrameReceipt
from onemap_shared.messages.map import (
    MAX_FILE_TEXT_CHARS,
    MAX_LISTED_MAPS,
    MAX_RIVALS,
    Layer,
    MapClear,
    MapDigest,
    MapDigestRequest,
    MapFile,
    MapList,
    MapListRequest,
    MapMerge,
    MapRevision,
    MapSummary,
    Occupancy,
    SavedMap,
    SearchReset,
    SearchView,
    SearchViewRequest,
)
from onemap_shared.messages.objects import (
    MAX_LISTED_OBJECTS,
    KeptObject,
    ObjectFind,
    ObjectId,
    ObjectList,
    ObjectListRequest,
    PicturedObject,
)
from onemap_shared.messages.outcome import NO_COVERAGE, Coverage, FailureCode
from onemap_shared.messages.perception import (
    MIN_VARIANCE,
    SAME_MEANING_COSINE,
    Detections,
    FeatureField,
    ImageRequest,
    TextEmbeddings,
    TextRequest,
)
from onemap_shared.messages.robot import (
    MAX_KEYFRAMES,
    Odometry,
    PoseGraph,
    RgbdFrame,
    VelocityCommand,
)
from onemap_shared.messages.search import (
    FINAL_STATES,
    MAX_OBJECTS,
    ObjectResult,
    PlannedPath,
    SearchId,
    SearchKind,
    SearchList,
    SearchListRequest,
    SearchOrder,
    SearchRequest,
    SearchState,
    SearchStatus,
    subject_of,
)
from onemap_shared.messages.similarity import (
    MAX_NEGATIVES,
    AnsweredQuery,
    ImageSimilarityRequest,
    SimilarityReply,
    SimilarityRequest,
)
from onemap_shared.messages.verdict import NO_VERDICT, MapVerdict, Verdict
from onemap_shared.messages.view_changes import (
    NO_VIEW,
    RANKS,
    TILE_CELLS,
    ViewChanges,
    ViewChangesRequest,
    ViewKey,
)

__all__ = [
    "FINAL_STATES",
    "MAX_FILE_TEXT_CHARS",
    "MAX_GOAL_OPTIONS",
    "MAX_IMAGE_BYTES",
    "MAX_KEYFRAMES",
    "MAX_LISTED_MAPS",
    "MAX_LISTED_OBJECTS",
    "MAX_NEGATIVES",
    "MAX_OBJECTS",
    "MAX_PICTURE_BYTES",
    "MAX_RIVALS",
    "MAX_TEXT_CHARS",
    "MIN_VARIANCE",
    "NO_CHOICE",
    "NO_COVERAGE",
    "NO_VERDICT",
    "NO_VIEW",
    "RANKS",
    "SAME_MEANING_COSINE",
    "TILE_CELLS",
    "AnsweredQuery",
    "Coverage",
    "Detections",
    "FailureCode",
    "FeatureField",
    "FrameReceipt",
    "GoalChoice",
    "GoalOption",
    "Heartbeat",
    "ImageRequest",
    "ImageSimilarityRequest",
    "KeptObject",
    "Layer",
    "MapClear",
    "MapDigest",
    "MapDigestRequest",
    "MapFile",
    "MapList",
    "MapListRequest",
    "MapMerge",
    "MapRevision",
    "MapSummary",
    "MapVerdict",
    "ObjectFind",
    "ObjectId",
    "ObjectList",
    "ObjectListRequest",
    "ObjectResult",
    "Occupancy",
    "Odometry",
    "PicturedObject",
    "PlannedPath",
    "PoseGraph",
    "RgbdFrame",
    "SavedMap",
    "SearchId",
    "SearchKind",
    "SearchList",
    "SearchListRequest",
    "SearchOrder",
    "SearchRequest",
    "SearchReset",
    "SearchState",
    "SearchStatus",
    "SearchView",
    "SearchViewRequest",
    "SimilarityReply",
    "SimilarityRequest",
    "TextEmbeddings",
    "TextRequest",
    "Truth",
    "TruthRequest",
    "VelocityCommand",
    "Verdict",
    "ViewChanges",
    "ViewChangesRequest",
    "ViewKey",
    "check_image",
    "check_text",
    "expect",
    "expect_finite",
    "expect_share",
    "subject_of",
]
