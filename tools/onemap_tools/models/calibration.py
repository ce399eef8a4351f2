"""``onemap models calibrate``: the floor of an encoder, and how often its answers err.

Generated apartments are mapped in this process from images of sampled poses. Each map is then
asked for every class name of mini, each synonym that was never a training target (by its
embedding), each alias, and words that name nothing there. An object is present if the map was shown
it well enough, absent if the apartment has none; in between, the query does not count.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.update import compute_update
from onemap_mapper.params import MapParams
from onemap_mapper.query.replies import similarity_reply
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.similarity import TextQuery, text_query
from onemap_perception.config import SHIPPED, MiniParams, PerceptionConfig
from onemap_perception.encoders.mini import MiniEncoder
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_encoder, with_channels
from onemap_perception.feature_field import VarianceParams, feature_field
from onemap_perception.text.vocabulary import Vocabulary, load_vocabulary
from onemap_shared.config import load
from onemap_shared.geometry import F32, F64
from onemap_shared.messages import RgbdFrame, SimilarityRequest
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import HELD_OUT, TRAINING
from onemap_simulator.ground_truth.truth import horizontal_distances
from onemap_simulator.rendering.camera_poses import sample_camera_poses
from onemap_simulator.rendering.rendered_image import RenderedImage
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.rendering.rgbd_camera import CameraParams, measured_mm
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.machine import machine_facts

SEEDS = tuple(range(800, 900))  # encoders are evaluated on 900 to 999, trained from 1000 on
MIN_OBSERVED_PIXELS = 192  # of 320 x 240, in one image: three patches of 8 x 8
MAX_OBSERVED_RANGE_M = 4.0  # beyond, the released model's confidence is below a quarter
FLOORS = tuple(round(0.01 * step, 2) for step in range(1, 100))
MAX_FALSE_POSITIVE_RATE = 0.05  # of unrelated words, at the chosen floor
NEAR_M = 1.0  # horizontal distance from a region's centre to the object
# Everywhere, or above the map's height limit.
EXCLUDED_CLASSES = frozenset({"floor", "wall", "ceiling"})
# Words of the shipped table for objects that no apartment has and that are no synonym, part or
# kind of a class. The vocabulary's neutral words join them.
UNRELATED = (
    "aquarium", "baseball bat", "bird cage", "broom", "calculator", "cat tree", "chess set",
    "christmas tree", "crutch", "dumbbell", "fire extinguisher", "fireplace", "golf club", "harp",
    "headphones", "helmet", "ironing board", "kite", "ladder", "lawn mower", "loudspeaker",
    "mailbox", "mop", "piano", "pizza", "printer", "record player", "robot", "robot vacuum",
    "roller skates", "saw", "scissors", "skateboard", "skis", "staircase", "stapler", "stroller",
    "surfboard", "telephone", "tennis racket", "tent", "treadmill", "tripod", "trumpet",
    "umbrella stand", "vacuum cleaner", "wheelchair", "wrench",
)  # fmt: skip
RAW_GROUPS = (
    "synonyms",
    "unrelated",
)  # asked for whatever the encoder answers as a class or refuses
STYLES = (TRAINING, HELD_OUT)
IMAGES = 40  # of each apartment
FRAME_NS = 100_000_000


@dataclass(frozen=True, slots=True)
class QueryWord:
    """A text, the class that it names (empty: none) and its group in the report."""

    text: str
    category: str
    group: str


@dataclass(frozen=True, slots=True)
class QueryOutcome:
    """The reply of one map to one word. near: the best region lies near such an object."""

    word: QueryWord
    seed: int
    present: bool
    score: float
    near: bool


@dataclass(frozen=True, slots=True)
class MappedScene:
    """A scene, its map, and the categories that were shown to the map well enough."""

    scene: Scene
    belief: BeliefMap
    observed: frozenset[str]


def calibrate(
    path: Path | None, apartments: int, tell: Callable[[str], None], *, images: int = IMAGES
) -> dict[str, Any]:
    """The floor chosen on odd seeds and the rates on even ones, of the encoder of a configuration.

    ValueError if there is no such encoder, or no floor keeps unrelated words unanswered.
    """
    torch.set_num_threads(1)
    config = load(path, "perception", PerceptionConfig)[2].encoder
    try:
        encoder = raw = make_encoder(config)
        if isinstance(config, MiniParams):
            raw = MiniEncoder(config, raw=True)
            raw = with_channels(raw, config.channels, raw) if config.channels else raw
    except BackendError as problem:
        raise ValueError(str(problem)) from problem
    questions = [
        (word, _query(word, raw if word.group in RAW_GROUPS else encoder))
        for word in query_words(load_vocabulary(SHIPPED))
    ]
    outcomes: list[QueryOutcome] = []
    for number, seed in enumerate(SEEDS[:apartments], 1):
        for style in STYLES:
            mapped = map_scene(generate_apartment(seed, style), encoder, seed, images)
            outcomes += query_map(mapped, questions, seed)
        tell(f"{number} of {apartments} apartments")
    return {
        "encoder_id": encoder.encoder_id,
        "apartments": apartments,
        "images": images,
        **summarise(outcomes),
        **machine_facts(),
    }


def _query(word: QueryWord, encoder: Encoder) -> TextQuery:
    """The query for a word, without its calibrated minimum score."""
    embedded = encoder.embed_text([word.text])
    return replace(text_query(embedded, 0, torch.device("cpu")), min_score=0.0, controls=0)


def map_scene(scene: Scene, encoder: Encoder, seed: int, images: int) -> MappedScene:
    """The map of images of ``images`` poses drawn from the seed."""
    observed = set[str]()
    poses = sample_camera_poses(scene, np.random.default_rng(seed), images)

    def frames() -> Iterator[RgbdFrame]:
        for frame, view in rendered_frames(scene, CameraParams(), poses):
            observed.update(observed_categories(scene, view))
            yield frame

    belief = map_of(frames(), encoder, VarianceParams(), MapParams())
    return MappedScene(scene, belief, frozenset(observed))


def rendered_frames(
    scene: Scene, camera: CameraParams, poses: Iterable[F64]
) -> Iterator[tuple[RgbdFrame, RenderedImage]]:
    """What the camera sees from poses T_map_camera (4, 4), and what the renderer says of it."""
    renderer = Renderer(scene)
    for index, pose in enumerate(poses):
        view = renderer.render(pose, camera.intrinsics, width=camera.width, height=camera.height)
        depth_mm = measured_mm(view.depth_m, camera.min_depth_m, camera.max_depth_m)
        stamp_ns = (index + 1) * FRAME_NS
        yield RgbdFrame(index, stamp_ns, view.rgb, depth_mm, camera.intrinsics, pose), view


def map_of(
    frames: Iterable[RgbdFrame], encoder: Encoder, variance: VarianceParams, params: MapParams
) -> BeliefMap:
    """The map of all frames."""
    belief = BeliefMap(params)
    for frame in frames:
        field = feature_field(frame, encoder.encode(frame.rgb), encoder, variance)
        belief.fuse(compute_update(field, params))
    return belief


def observed_categories(scene: Scene, view: RenderedImage) -> set[str]:
    """Categories of which one object fills enough pixels within range."""
    near = view.labels[(view.labels >= 0) & (view.depth_m <= MAX_OBSERVED_RANGE_M)]
    counts = np.bincount(near, minlength=len(scene.objects))
    return {scene.objects[i].category for i in np.flatnonzero(counts >= MIN_OBSERVED_PIXELS)}


def query_words(vocabulary: Vocabulary) -> tuple[QueryWord, ...]:
    """The query words: names, synonyms, aliases and unrelated words."""
    classes = [entry for entry in vocabulary.classes if entry.name not in EXCLUDED_CLASSES]
    groups = {
        "names": [(entry.name, entry.name) for entry in classes],
        "synonyms": [(word, entry.name) for entry in classes for word in entry.held_out],
        "aliases": [(word, entry.name) for entry in classes for word in entry.query_aliases],
        "unrelated": [(word, "") for word in (*vocabulary.neutral, *UNRELATED)],
    }
    return tuple(QueryWord(text, name, group) for group in groups for text, name in groups[group])


def query_map(
    mapped: MappedScene, questions: Sequence[tuple[QueryWord, TextQuery]], seed: int
) -> Iterator[QueryOutcome]:
    """Query a map for every word that is clearly present or absent."""
    categories = set(mapped.scene.categories)
    for word, query in questions:
        present = word.category in mapped.observed
        if not present and word.category in categories:
            continue  # in the apartment, but not shown well enough
        request = SimilarityRequest(query.text, max_regions=1)
        reply = similarity_reply(MapScores(mapped.belief).of([query]), request=request)
        near = present and distance_m(mapped.scene, word.category, reply.centres_m[0]) <= NEAR_M
        yield QueryOutcome(word, seed, present, reply.best_score, near)


def distance_m(scene: Scene, category: str, place: F32) -> float:
    """Horizontal distance from a place (2,) to the nearest object of the category."""
    things = [i for i, thing in enumerate(scene.objects) if thing.category == category]
    faces = scene.faces[np.isin(scene.face_object, things)]
    triangles = scene.vertices[faces].astype(np.float64)
    return float(horizontal_distances(triangles, place.astype(np.float64)).min())


def summarise(outcomes: Sequence[QueryOutcome]) -> dict[str, Any]:
    """The floor, and the rates of each group of words at it and without one."""
    floor = choose_floor([one for one in outcomes if one.seed % 2])
    even = [one for one in outcomes if not one.seed % 2]
    groups = {
        group: [one for one in even if one.word.group == group]
        for group in dict.fromkeys(one.word.group for one in outcomes)
    }
    return {
        "floor": floor,
        "rates": {group: rates(each, floor) for group, each in groups.items()},
        "without_floor": {group: rates(each, 0.0) for group, each in groups.items()},
    }


def choose_floor(outcomes: Sequence[QueryOutcome]) -> float:
    """The lowest candidate that keeps ``MAX_FALSE_POSITIVE_RATE``; ValueError if none does."""
    scores = np.array([one.score for one in outcomes if one.word.group == "unrelated"])
    for floor in FLOORS:
        if np.mean(scores >= floor) <= MAX_FALSE_POSITIVE_RATE:
            return floor
    raise ValueError("no floor keeps out unrelated words: scores of this encoder say little")


def rates(outcomes: Sequence[QueryOutcome], floor: float) -> dict[str, float | int | None]:
    """Shares of absent words answered, and of present words answered and answered correctly."""
    absent = [one.score >= floor for one in outcomes if not one.present]
    present = [one for one in outcomes if one.present]
    return {
        "absent": len(absent),
        "false_positive_rate": _share(absent),
        "present": len(present),
        "answered_rate": _share([one.score >= floor for one in present]),
        "right_rate": _share([one.score >= floor and one.near for one in present]),
    }


def _share(flags: Sequence[bool]) -> float | None:
    return round(float(np.mean(flags)), 3) if flags else None


def lines(result: dict[str, Any]) -> list[str]:
    """The report as a table."""
    rows = [
        f"encoder {result['encoder_id']}: floor {result['floor']:g}, chosen and "
        f"measured on {result['apartments']} apartments of {result['images']} images",
        f"{'words':12}{'absent':>8}{'answered':>10}{'present':>9}{'answered':>10}{'right':>8}",
    ]
    for group, each in result["rates"].items():
        shares = [each[key] for key in ("false_positive_rate", "answered_rate", "right_rate")]
        wrong, answered, right = ("-" if s is None else f"{s:.3f}" for s in shares)
        rows.append(
            f"{group:12}{each['absent']:>8}{wrong:>10}{each['present']:>9}{answered:>10}{right:>8}"
        )
    return rows
