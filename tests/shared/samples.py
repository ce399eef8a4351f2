"""One valid message of every type, for round trips and for breaking."""

from __future__ import annotations

import dataclasses
import inspect
from typing import Any, TypeVar

import numpy as np

from onemap_shared import messages as m
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import pose_2d
from onemap_shared.grid import GridSpec

M = TypeVar("M")
CAMERA = Intrinsics(300.0, 300.0, 4.0, 3.0)
POSE = pose_2d(1.0, -2.0, 0.5)
GRID = GridSpec(0.1, (-3, 2), (4, 5))
TILES = GridSpec(0.1, (-64, 0), (128, 192))
RESULT = m.ObjectResult(
    "sofa",
    m.SearchState.FOUND,
    "seen twice",
    (1.0, 2.0, 0.4),
    0.9,
    12.5,
    7.25,
    (0.0, 0.0),
    (1.0, 1.5),
    coverage=m.Coverage(8.0, 10.0, 1.5, (1.0, 2.0), 0.4),
    frame_ns=123,
    box_px=(4.0, 6.0, 20.0, 18.0),
    cells=7,
)
OPTION = m.GoalOption("frontier", (1.0, 2.0), 0.4, 2.5, 0.3, chosen=True)
CHOICE = m.GoalChoice(3, "the only goal: unknown space", (OPTION,), 1)
NEXT_TO = m.Relation(m.RelationKind.NEXT_TO, ("bed",))
DETAIL = m.Detail("red", (NEXT_TO,), ("kitchen",), ("hall",))
STATUS = m.SearchStatus(
    "s1", m.SearchState.EXPLORING, ("sofa", "bed"), 1, "on its way", (RESULT,), 1, 2, 3.5,
    choice=CHOICE, details=(DETAIL, m.NO_DETAIL), stay_out=("nursery",),
    passed=(m.PassedThing((1.0, 2.0), "not red"),), after=m.After.RETURN, start_m=(0.5, 0.0),
)  # fmt: skip
STEP = m.SearchStep(
    2.5, m.SearchState.EXPLORING, "sofa", "on its way", (1.0, 2.0), "frontier", (3.0, 2.0)
)

SAVED = m.SavedMap("flat", 4096, 123, "mini-1", "minilm", 0.1, 100, 3)
KEPT = m.KeptObject(
    "3f9a12c4", "bed", (1.0, 2.0, 0.4), (0.5, 1.0, 1.5, 3.0), 0.93, 2, "s1", 100, 123,
    (4.0, 6.0, 20.0, 18.0), 3, (0.3, 0.7), "site/r1",
)  # fmt: skip

ZONE = m.Place("stairs", m.PlaceKind.KEEP_OUT, corners_m=((0.0, 0.0), (1.0, 0.0), (1.0, 2.0)))
IDS = np.zeros((4, 5), np.int32)
PNG = b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR\x00\x00\x00\x40\x00\x00\x00\x30\x08\x02"  # 64 x 48


def f32(*shape: int) -> np.ndarray:
    """Finite, positive, not constant."""
    return np.linspace(0.1, 0.9, int(np.prod(shape)), dtype=np.float32).reshape(shape)


SEES = m.CameraView(1.3, 55.0, -5.0)
SAMPLES: tuple[Any, ...] = (
    m.RgbdFrame(
        7, 123, np.full((6, 8, 3), 9, np.uint8), np.full((6, 8), 1500, np.uint16), CAMERA, POSE
    ),
    m.Odometry(
        7, 123, POSE, 0.5, -0.1, True, planner="5f3a", command_sequence=12,
        reached=(1.0, -2.0, 0.5), hold="nav2 does not answer",
    ),
    m.VelocityCommand(3, 5, 0.2, -0.4, planner="5f3a", odometry_stamp_ns=123, frame_ns=99),
    m.FeatureField(
        7, 123, "mini-1", "minilm", f32(2, 3, 4).astype(np.float16), f32(6, 8),
        np.full((6, 8), 1500, np.uint16), CAMERA, POSE, colours=np.full((2, 3, 3), 99, np.uint8),
    ),
    m.Detections(
        7, 123, "patches", ("sofa", "sofa"), f32(2, 4), f32(2), f32(3, 3),
        np.array([0, 1, 1], np.int32), b"jpeg", 0.5,
    ),
    m.TextRequest(("sofa", "teddy bear")),
    m.ImageRequest(PNG),
    m.ImageSimilarityRequest(PNG, m.SimilarityRequest("the image", 3, area_m=(0.0, 0.0, 1.0, 1.0))),
    m.TextEmbeddings(
        "mini-1", "minilm", ("sofa",), f32(1, 4), f32(3, 4), np.ones((1, 3), np.uint8), 20.0,
        0.3,
    ),
    m.MapRevision(4, 7, 123, "mini-1", "minilm", 3, 100, 4096, 8.5, 5.0, 9, (SEES,), map_id="5f3a"),
    m.SimilarityRequest(
        "sofa", 3, include_grid=True, negatives=("bed",), area_m=(0.0, -1.0, 2.0, 1.0),
        robot_xy_m=(0.5, 0.0),
    ),
    m.SimilarityReply(
        "sofa", 4, 123, "mini-1", f32(2, 2), f32(2, 4), f32(2), f32(2), GRID, f32(4, 5),
        0.9, 0.3, f32(4, 2), np.array([0, 0, 1, 1], np.int32),
        np.array([0, 123], np.int64), f32(2, 3),
        m.MapVerdict(m.Verdict.FOUND, 8.0, 2.0, 1, (1.0, 2.0)), f32(2, 2),
        whereabouts=(
            m.Whereabouts("kitchen", m.RelationKind.ON, "desk", "3f9a12c4"),
            m.Whereabouts(conditions=(m.CheckedCondition("red", m.Holds.NOT_CHECKED, "perhaps"),)),
        ),
    ),
    m.SearchViewRequest("sofa", ("bed", "desk")),
    m.SearchView(
        "sofa", 4, 7, 123, GRID, np.ones((4, 5), np.uint8), np.zeros((4, 5), np.uint8),
        np.full((4, 5), np.nan, np.float32), f32(4, 5), tops_dm=np.full((4, 5), 8, np.uint8),
        map_id="5f3a",
    ),
    m.ViewChangesRequest("sofa", ("bed", "desk"), m.ViewKey("5f3a", "1.2.3", 4)),
    m.ViewChanges(
        "sofa", m.ViewKey("5f3a", "1.2.3", 4), m.ViewKey("5f3a", "1.2.3", 6), 4, 7, 123, TILES,
        np.array([[0, 1]], np.int32), np.pad(np.full((1, 1), 192, np.uint8), ((0, 0), (0, 511))),
        np.ones(2, np.uint8), np.array([0, 1], np.uint8), f32(3, 1), f32(254),
    ),
    m.SearchReset("s1"),
    m.MapFile("flat"),
    m.MapClear(),
    m.PlacesRequest(),
    m.PlacesChange((ZONE,), ("hall",)),
    m.MapPlaces(2, 4, (m.Place("hall", inside_m=(0.0, 0.4)), ZONE), (0, -1), GRID, IDS,
                (m.RoomChange(4, (0,), (0, 3)),)),
    m.MapSummary("/maps/flat.npz", "mini-1", "minilm", 0.1, 100, 3, 4096, created=True),
    m.MapMerge("flat", 1.0, -2.0, 0.5),
    m.MapListRequest("flat"),
    SAVED,
    m.MapList((SAVED,), 3),
    m.ObjectFind(
        "bed", (1.0, 2.0, 0.4), (0.5, 1.0, 1.5, 3.0), 0.93, 123, "s1", (4.0, 6.0, 20.0, 18.0),
        b"jpeg",
    ),
    KEPT,
    m.ObjectId("3f9a12c4"),
    m.PicturedObject(KEPT, b"\xff\xd8\xff"),
    m.ObjectListRequest(),
    m.ObjectList((KEPT,), 3),
    m.SearchRequest(("sofa", "bed")),
    m.SearchId("s1"),
    STATUS,
    m.SearchListRequest(),
    m.SearchList((STATUS,), 3),
    m.SearchRecord(STATUS, (STEP,), 4, f32(2, 3)),
    m.PlannedPath(
        5, "frontier", "best similarity", f32(3, 2), f32(1, 2), f32(2, 2), f32(2), f32(0, 2), f32(0)
    ),
    m.TruthRequest("sofa", 1.0, 2.0),
    m.Truth("apartment 1", 0, float("inf"), float("inf"), ("bed", "sofa"), "chair", True),
    m.FrameReceipt(7, 123),
    m.Heartbeat("mapper", "abc", 5, 9, ready=True, metrics={"update_ms": 8.0}),
)  # fmt: skip


# Of other messages: they have no key of their own.
PARTS: tuple[type, ...] = (
    m.ObjectResult,
    m.GoalOption,
    m.GoalChoice,
    m.Coverage,
    m.MapVerdict,
    m.ViewKey,
    m.CameraView,
    m.RoomChange,
    m.SearchStep,
    m.PassedThing,
    m.Relation,
    m.Detail,
    m.CheckedCondition,
    m.Whereabouts,
    m.Place,
)


def message_types() -> set[type]:
    """Every top-level message type of the package."""
    return {
        cls
        for _, cls in inspect.getmembers(m, inspect.isclass)
        if dataclasses.is_dataclass(cls)
        and cls.__module__.startswith(m.__name__)
        and cls not in PARTS
    }


def equal(a: Any, b: Any) -> bool:
    """Whether two messages are equal, arrays to the last bit and dtype."""
    for field in dataclasses.fields(a):
        x, y = getattr(a, field.name), getattr(b, field.name)
        if isinstance(x, np.ndarray):
            if x.dtype != y.dtype or x.shape != y.shape or x.tobytes() != y.tobytes():
                return False
        elif x != y:
            return False
    return True


def sample(cls: type[M]) -> M:
    """The valid message, or part of one, of this type."""
    parts = (DETAIL, NEXT_TO, OPTION, CHOICE, SAVED, KEPT, SEES, m.ViewKey("5f3a", "1.2.3", 4))
    return next(each for each in (*SAMPLES, *parts) if type(each) is cls)
