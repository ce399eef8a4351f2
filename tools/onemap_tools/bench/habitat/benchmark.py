"""One episode in Habitat, in simulated time: the robot, the search, the verdict.

An object is found by the paper's rule: the robot stopped less than 1.5 m, in a straight line seen
from above, from the box of an instance; what an instance is follows the released evaluation, by
semantic ids and by the annotators' names. Shortest paths lead to the nearest of the episode file's
view points, as the files' own do.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from contextlib import closing
from dataclasses import asdict, dataclass, replace
from functools import partial
from math import inf, nan
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, cast

import numpy as np

from onemap_perception.service import PerceptionComponents, components_of
from onemap_shared.geometry import yaw_of
from onemap_shared.messages import Detections, ObjectResult, SearchRequest, SearchStatus
from onemap_simulator.ground_truth import SUCCESS_RADIUS_M
from onemap_tools.bench.habitat.episode_files import (
    CategoryGoals,
    GoalsOfScene,
    HabitatEpisode,
    goals_of,
    read_episodes,
)
from onemap_tools.bench.habitat.robot import HabitatDriver, InOneThread
from onemap_tools.bench.habitat.world import (
    AgentParams,
    AnnotatedBox,
    HabitatWorld,
    Point,
    as_point,
    body_pose,
    to_habitat,
)
from onemap_tools.bench.navigation.episode import (
    IN_VIEW_SHARE,
    OVERALL_LIMIT,
    RGBD_HZ,
    FrameCounts,
    not_sought,
    object_record,
)
from onemap_tools.bench.navigation.methods import search_method
from onemap_tools.bench.navigation.results import (
    EPISODE,
    EpisodeRecord,
    ResultsFolder,
    episode_line,
    summary,
    table_lines,
)
from onemap_tools.bench.navigation.search import WatchedSearch
from onemap_tools.bench.options import HabitatBench
from onemap_tools.judgement import ObjectSummary
from onemap_tools.virtual.config import SystemConfig
from onemap_tools.virtual.system import Equipment

# What is asked for in place of a category whose name is no English word for the object.
WORDS = {"plant": "potted plant", "tv_monitor": "television"}
# Annotators' names, or parts of them, that the released evaluation counts beside a category's own.
ALSO_NAMED = {"plant": "flower", "sofa": "couch"}


@dataclass(frozen=True, slots=True)
class CategoryTruth:
    """Ground truth of one category in the open scene."""

    goals: CategoryGoals
    instances: tuple[AnnotatedBox, ...]
    others: tuple[AnnotatedBox, ...]

    @classmethod
    def of(
        cls, category: str, goals: CategoryGoals, boxes: Iterable[AnnotatedBox]
    ) -> CategoryTruth:
        """ValueError if there is no box of an instance to measure from."""
        every = tuple(boxes)
        instances = tuple(box for box in every if is_instance(box, category, goals))
        if not instances:
            raise ValueError(
                f"no annotated object of the scene is a {category!r}: success is measured by the "
                "semantic annotations of HM3D"
            )
        others = tuple(box for box in every if box not in instances)
        return cls(goals, instances, others)

    @property
    def semantic_ids(self) -> frozenset[int]:
        """Of all instances."""
        return self.goals.object_ids | {box.semantic_id for box in self.instances}

    def distance_m(self, place: Point) -> float:
        """Straight line, seen from above, to the box of the nearest instance."""
        return min(horizontal_m(box, place) for box in self.instances)

    def judged(
        self,
        result: ObjectResult,
        world: HabitatWorld,
        *,
        start: Point,
        end: Point,
        claimed: Point | None,
    ) -> ObjectSummary:
        """The result beside the truth; ``goal_distance_m`` is 0 where it counts as found.

        Places are Habitat's: where the search began and ended, and what it claims to have found.
        """
        near_m = self.distance_m(end)
        path_m = max(world.path_m(end, self.goals.view_points), near_m)
        nearest = ""
        if claimed is not None and self.distance_m(claimed) < SUCCESS_RADIUS_M:
            nearest = result.name
        elif claimed is not None and self.others:
            nearest = min(self.others, key=lambda box: horizontal_m(box, claimed)).category
        return ObjectSummary(
            name=result.name,
            outcome=result.outcome.value,
            reason=result.reason,
            position_m=result.position_m,
            time_s=result.duration_s,
            path_length_m=result.path_length_m,
            shortest_path_m=world.path_m(start, self.goals.view_points),
            true_distance_m=near_m,
            goal_distance_m=0.0 if near_m < SUCCESS_RADIUS_M else path_m,
            nearest=nearest,
        )


def is_instance(box: AnnotatedBox, category: str, goals: CategoryGoals) -> bool:
    """Whether an annotated object counts as of the category.

    By the ids of the episode file, or by its name as the released evaluation compares: one name
    is part of the other, or it holds the other word for a plant or a sofa.
    """
    name, other = box.category.strip().lower(), ALSO_NAMED.get(category)
    if box.semantic_id in goals.object_ids:
        return True
    return bool(name) and (
        name in category or category in name or (other is not None and other in name)
    )


def horizontal_m(box: AnnotatedBox, place: Point) -> float:
    """Distance of a place from a box, seen from above: Habitat's x and z; 0 inside."""
    gaps = [max(box.lower[k] - place[k], 0.0, place[k] - box.upper[k]) for k in (0, 2)]
    return float((gaps[0] ** 2 + gaps[1] ** 2) ** 0.5)


def truths_of(
    episode: HabitatEpisode, goals: GoalsOfScene, boxes: tuple[AnnotatedBox, ...]
) -> list[CategoryTruth]:
    """Of each object of an episode, in the scene with these boxes."""
    return [
        CategoryTruth.of(name, goals_of(goals, episode.scene, name), boxes)
        for name in episode.objects
    ]


def run_episode(
    episode: HabitatEpisode,
    goals: GoalsOfScene,
    world: HabitatWorld,
    *,
    options: HabitatBench,
    config: SystemConfig,
    perception: PerceptionComponents,
) -> EpisodeRecord:
    """Open the scene, search for the objects, judge every result; ``wall_s`` stays 0."""
    world.open(options.scenes / episode.scene, options.scenes / episode.annotations)
    world.place(episode.start, episode.rotation)
    floor_y_m = world.pose[0][1]
    words = tuple(WORDS.get(name, name.replace("_", " ")) for name in episode.objects)
    truths = truths_of(episode, goals, world.boxes())
    counts = FrameCounts()
    heights_m: list[list[float]] = [[] for _ in words]  # of the body, in the frames of each object

    def detected(found: Detections, status: SearchStatus) -> None:
        assert isinstance(search.robot, HabitatDriver)
        image = search.robot.image
        if image is None or not status.target:
            return
        heights_m[status.index].append(float(search.robot.pose.T_true[2, 3]))
        shown = np.isin(image.semantic_ids, list(truths[status.index].semantic_ids))
        if shown.mean() >= IN_VIEW_SHARE:
            counts.add(status.target, status.target in found.names)

    def judged(index: int, result: ObjectResult) -> ObjectSummary:
        heights = heights_m[index] or [0.0]

        def place(xy_m: tuple[float, ...], z_m: float) -> Point:
            return as_point(to_habitat(np.array([*xy_m[:2], z_m]), floor_y_m))

        return truths[index].judged(
            result,
            world,
            start=place(result.start_xy_m or result.end_xy_m, heights[0]),
            end=place(result.end_xy_m, heights[-1]),
            claimed=place(result.position_m, heights[-1]) if result.position_m else None,
        )

    T_map_body = body_pose(*world.pose, floor_y_m)
    with TemporaryDirectory() as folder:
        asked = config.searching(rgbd_hz=RGBD_HZ, limit_s=options.limit)
        robot = partial(HabitatDriver, world=world, rgbd_hz=RGBD_HZ)
        search = WatchedSearch(
            Equipment(asked, robot, perception, Path(folder)),
            episode.index,
            method=search_method(options.method, config.mapper.cell_size_m),
            detected=detected,
        )
        with closing(search):
            limit_s = options.limit * len(words) * OVERALL_LIMIT
            results = search.run(SearchRequest(words), limit_s).results
    summaries = [judged(index, result) for index, result in enumerate(results)]
    summaries += [not_come_to(word) for word in words[len(summaries) :]]
    assert isinstance(search.robot, HabitatDriver)
    return EpisodeRecord(
        index=episode.index,
        seed=episode.index,
        start=(float(T_map_body[0, 3]), float(T_map_body[1, 3]), yaw_of(T_map_body)),
        objects=tuple(object_record(each, counts) for each in summaries),
        contacts=search.robot.robot.contacts,
        simulated_s=round(search.simulated_s, 3),
        trajectory=tuple(search.trajectory),
        scene=f"{Path(episode.scene).stem} episode {episode.index}",
    )


def not_come_to(word: str) -> ObjectSummary:
    """Of an object that the search did not come to."""
    result = not_sought(word)
    return ObjectSummary(
        word, result.outcome.value, result.reason, (), 0.0, 0.0, nan, inf, goal_distance_m=inf
    )


BOOTSTRAP_SEED = 0
lines = table_lines


def run(options: HabitatBench, tell: Callable[[str], None]) -> dict[str, Any]:
    """Run what is not yet in the folder, write the summary there.

    ValueError for a method that Habitat's episodes do not have, and for what cannot be read.
    """
    if options.method == "oracle":  # needs the simulator's ground truth
        raise ValueError("--method oracle runs in generated apartments only: choose another")
    system, agent = SystemConfig.read(options.config), AgentParams()
    files = read_episodes(options.episodes, options.goals, options.count)
    described = {
        "method": options.method,
        "features": system.perception.encoder.backend,
        "episode_files": str(options.episodes),
        "goals": None if options.goals is None else str(options.goals),
        "count": options.count,
        "limit_s": options.limit,
    }
    config = system.document() | asdict(agent)
    del config["simulator"]  # which does not run here
    folder = ResultsFolder(options.out, {**described, "config": config})
    done = {record.index: record for record in folder.finished}
    if todo := [episode for episode in files.episodes if episode.index not in done]:
        with closing(cast(HabitatWorld, InOneThread(HabitatWorld(agent)))) as world:
            perception = components_of(system.perception)
            for episode in todo:
                started_s = time.perf_counter()
                record = run_episode(
                    episode,
                    files.goals,
                    world,
                    options=options,
                    config=system,
                    perception=perception,
                )
                record = replace(record, wall_s=round(time.perf_counter() - started_s, 1))
                record = EPISODE.validate_python(record.document())  # rounded, as one that is read
                done[episode.index] = record
                folder.add(record)
                tell(episode_line(record))
    records = [done[index] for index in sorted(done)]
    result = {
        "benchmark": "habitat",
        **described,
        "objects_per_episode": max(len(episode.objects) for episode in files.episodes),
        **summary(records, BOOTSTRAP_SEED),
        "compared_with": {},
        "wall_s": round(sum(record.wall_s for record in records), 1),
    }
    folder.write_results(result)
    return result
