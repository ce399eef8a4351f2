"""Verdicts of the map at several stages of exploration, judged by the ground truth.

A robot's camera drives through a generated apartment until all of the floor was seen. At each
stage the map is asked for every class and for words that name nothing there.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy import ndimage

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.config import MapperConfig
from onemap_mapper.frame.cloud import PointCloud
from onemap_mapper.frame.update import compute_update
from onemap_mapper.query.replies import similarity_reply
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.similarity import TextQuery
from onemap_mapper.query.verdicts import floor_coverage
from onemap_perception.encoders.mini import SHIPPED
from onemap_perception.encoders.params import EncoderParams
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.errors import BackendError
from onemap_perception.text.vocabulary import Vocabulary, load_vocabulary
from onemap_shared.geometry import F64, Bool
from onemap_shared.messages import SimilarityRequest
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import STYLES
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.rendering.rendered_image import RenderedImage
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.exploration_tour import CELL_SIZE_M, ROBOT_RADIUS_M, exploration_poses
from onemap_tools.bench.mapping import CAMERA, INTRINSICS, observed_categories, rendered_field
from onemap_tools.bench.queries import NEAR_M, distance_m, encoder_pair, query_words
from onemap_tools.bench.query_report import QueryWord
from onemap_tools.bench.verdict_report import VerdictOutcome

STAGES = (0.06, 0.2, 0.4, 0.7, 1.0)  # shares of the images of a drive: the first is one turn
EVERY = 4  # of the unrelated words; there are twice as many as classes
SEEN_RANGE_M = 5.0  # of floor; farther, a pixel is as long as a cell
ON_FLOOR_M = 0.05

Question = tuple[QueryWord, TextQuery]


@dataclass(frozen=True, slots=True)
class VerdictBenchParams:
    """The apartments; ``out``: a file of finished ones, from which a stopped run goes on."""

    seeds: tuple[int, ...]
    style: str
    out: Path | None = None


def run(
    config: EncoderParams, params: VerdictBenchParams, report: Callable[[str], None]
) -> list[VerdictOutcome]:
    """The outcomes of all apartments; ValueError if the encoder cannot be loaded."""
    outcomes = _finished(params)
    left = [seed for seed in params.seeds if seed not in {one.seed for one in outcomes}]
    if not left:
        return outcomes
    try:
        encoders = encoder_pair(config)
    except BackendError as problem:
        raise ValueError(str(problem)) from problem
    words = asked_words(load_vocabulary(SHIPPED))
    questions = list(zip(words, encoders.queries(words), strict=True))
    for seed in left:
        scene = generate_apartment(seed, STYLES[params.style])
        found = list(explored(scene, encoders.configured, questions, seed))
        outcomes += found
        _keep(params, found)
        report(f"apartment {seed}: {len({one.stage for one in found})} stages")
    return outcomes


def asked_words(vocabulary: Vocabulary) -> tuple[QueryWord, ...]:
    """The names of the classes, and some words that name nothing in any apartment."""
    words = query_words(vocabulary)
    names = [word for word in words if word.group == "names"]
    return (*names, *[word for word in words if word.group == "unrelated"][::EVERY])


def explored(
    scene: Scene, encoder: Encoder, questions: Sequence[Question], seed: int
) -> Iterator[VerdictOutcome]:
    """The outcomes of all stages of one drive."""
    poses = exploration_poses(scene, CAMERA)
    stops = {max(1, round(stage * len(poses))): stage for stage in STAGES}
    belief, renderer, floor = BeliefMap(MapperConfig()), Renderer(scene), SeenFloor(scene)
    shown: set[str] = set()
    for number, pose in enumerate(poses, 1):
        view = renderer.render(pose, INTRINSICS, width=CAMERA.width, height=CAMERA.height)
        belief.fuse(compute_update(rendered_field(view, pose, number, encoder), belief.params))
        shown |= observed_categories(scene, view)
        floor.add(view, pose)
        if number in stops:
            context = (seed, stops[number], coverage_share(belief, pose), floor.hidden_m2())
            yield from asked(belief, scene, questions, shown, context)


def asked(
    belief: BeliefMap,
    scene: Scene,
    questions: Sequence[Question],
    shown: set[str],
    context: tuple[int, float, float, float],
) -> Iterator[VerdictOutcome]:
    """Ask one map everything. context: seed, stage, share looked at, hidden square metres."""
    seed, stage, share, hidden_m2 = context
    scores, config = MapScores(belief), MapperConfig()
    for word, query in questions:
        request = SimilarityRequest(word.text, max_regions=1)
        reply = similarity_reply(scores.of([query]), request=request, params=config)
        present = word.category in scene.categories
        near = present and distance_m(scene, word.category, reply.centres_m[0]) <= NEAR_M
        yield VerdictOutcome(
            seed=seed,
            stage=stage,
            text=word.text,
            score=round(reply.best_score, 4),
            looked_share=round(share, 4),
            present=present,
            shown=word.category in shown,
            near=bool(near),
            hidden_m2=round(hidden_m2, 2),
        )


def coverage_share(belief: BeliefMap, pose: F64) -> float:
    """The share that the map says was looked at, for a camera at T_map_camera (4, 4)."""
    return floor_coverage(
        belief.occupancy_grid(),
        belief.layers(),
        belief.grid,
        robot_xy_m=(float(pose[0, 3]), float(pose[1, 3])),
        area=None,
        params=MapperConfig(),
    ).share


class SeenFloor:
    """Which of the floor that a robot can reach was seen, by the true depth."""

    def __init__(self, scene: Scene) -> None:
        collision = CollisionMap.of(scene, CAMERA.height_m, CELL_SIZE_M)
        centres = collision.reachable_cells(scene.start[0], scene.start[1], ROBOT_RADIUS_M)
        width = round(ROBOT_RADIUS_M / CELL_SIZE_M)
        self._grid = collision.grid
        self._floor: Bool = ndimage.binary_dilation(centres, np.ones((3, 3)), width)
        self._seen: Bool = np.zeros_like(self._floor)

    def add(self, view: RenderedImage, T_map_camera: F64) -> None:
        """Floor in an image."""
        depth_m = np.where(view.depth_m <= SEEN_RANGE_M, view.depth_m, 0).astype(np.float32)
        cloud = PointCloud.of(depth_m, intrinsics=INTRINSICS, T_map_camera=T_map_camera)
        low = (depth_m > 0) & (np.abs(cloud.points_m[..., 2]) < ON_FLOOR_M)
        cells = self._grid.cells(cloud.points_m[low].astype(np.float64))
        inside = cells[self._grid.contains(cells)]
        self._seen[inside[:, 0], inside[:, 1]] = True

    def hidden_m2(self) -> float:
        """Area of the largest connected part that was not seen, square metres."""
        seen = ndimage.binary_closing(self._seen, np.ones((3, 3)))  # gaps between far pixels
        parts, _ = ndimage.label(self._floor & ~seen)
        return float(np.bincount(parts.ravel())[1:].max(initial=0)) * CELL_SIZE_M**2


def _finished(params: VerdictBenchParams) -> list[VerdictOutcome]:
    """The outcomes in the file of an earlier run, of the seeds that are asked for."""
    if params.out is None or not params.out.exists():
        return []
    documents: list[dict[str, Any]] = [
        json.loads(line) for line in params.out.read_text(encoding="utf-8").splitlines()
    ]
    return [VerdictOutcome(**each) for each in documents if each["seed"] in params.seeds]


def _keep(params: VerdictBenchParams, outcomes: Sequence[VerdictOutcome]) -> None:
    if params.out is not None:
        lines = [json.dumps(asdict(one)) + "\n" for one in outcomes]
        before = params.out.read_text(encoding="utf-8") if params.out.exists() else ""
        params.out.write_text(before + "".join(lines), encoding="utf-8")
