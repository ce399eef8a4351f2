"""Runs one episode in Habitat, in simulated time, and judges it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import inf, nan
from pathlib import Path

import numpy as np

from onemap_planner.search.phases import Search
from onemap_shared.geometry import yaw_of
from onemap_shared.messages import Detections, ObjectResult, RgbdFrame
from onemap_tools.bench.habitat.choices import SuccessRule
from onemap_tools.bench.habitat.coordinates import Point, to_habitat
from onemap_tools.bench.habitat.episode_layout import CategoryGoals, HabitatEpisode, goals_of
from onemap_tools.bench.habitat.lockstep_robot import LockstepHabitatRobot
from onemap_tools.bench.habitat.params import HabitatRobotParams
from onemap_tools.bench.habitat.robot import as_point
from onemap_tools.bench.habitat.truth import CategoryTruth, SearchPlaces
from onemap_tools.bench.habitat.world import World
from onemap_tools.bench.lockstep import LockstepSimulation, PerceptionPipeline, SystemConfig
from onemap_tools.bench.navigation.choices import Method
from onemap_tools.bench.navigation.episode_run import (
    IN_VIEW_SHARE,
    OVERALL_LIMIT,
    RGBD_HZ,
    FrameCounts,
    not_sought,
    object_record,
)
from onemap_tools.bench.navigation.methods import planner_config, search_method
from onemap_tools.bench.navigation.records import EpisodeRecord
from onemap_tools.demo.summary import ObjectSummary

# What is asked for in place of a category whose name is no English word for the object.
WORDS = {"plant": "potted plant", "tv_monitor": "television"}

Goals = Mapping[tuple[str, str], CategoryGoals]


@dataclass(frozen=True, slots=True)
class HabitatSetup:
    """How episodes are run. scenes: folder of all scenes; limit_s: simulated seconds per object."""

    config: SystemConfig
    method: Method
    rule: SuccessRule
    scenes: Path
    limit_s: float
    robot: HabitatRobotParams = HabitatRobotParams()  # noqa: RUF009 (frozen)

    @property
    def system(self) -> SystemConfig:
        """The configuration with the benchmark's frame rate and the method's planner."""
        simulator = self.config.simulator.model_copy(update={"rgbd_hz": RGBD_HZ})
        planner = planner_config(self.config.planner, self.limit_s)
        return replace(self.config, simulator=simulator, planner=planner)


@dataclass(slots=True)
class FloorHeights:
    """The body's height in the map, metres, in the first and last frame of each object."""

    first: dict[int, float] = field(default_factory=dict)
    last: dict[int, float] = field(default_factory=dict)

    def add(self, index: int, z_m: float) -> None:
        """Take in a frame."""
        self.first.setdefault(index, z_m)
        self.last[index] = z_m


class EpisodeRun:
    """One episode: opens its scene, searches for its objects, judges every result."""

    def __init__(
        self,
        episode: HabitatEpisode,
        goals: Goals,
        world: World,
        setup: HabitatSetup,
        perception: PerceptionPipeline,
    ) -> None:
        self._episode, self._setup, self._world = episode, setup, world
        world.open(setup.scenes / episode.scene, setup.scenes / episode.scene_config)
        world.place(episode.start, episode.rotation)
        boxes = world.boxes()
        self.words = tuple(word_of(category) for category in episode.objects)
        self._truth = [
            CategoryTruth.of(name, goals_of(goals, episode.scene, name), boxes, setup.rule)
            for name in episode.objects
        ]
        self._robot = LockstepHabitatRobot(world, setup.robot)
        system = setup.system
        self._simulation = LockstepSimulation(
            self._robot,
            system,
            perception,
            method=search_method(setup.method, system.mapper.cell_size_m),
            watch=self._watch,
        )
        self._counts, self._heights = FrameCounts(()), FloorHeights()

    def run(self) -> EpisodeRecord:
        """Search and judge; ``wall_s`` stays 0."""
        T_map_body = self._robot.odometry()
        (x, y), yaw = self._robot.xy, yaw_of(T_map_body)
        limit_s = self._setup.limit_s * len(self.words) * OVERALL_LIMIT
        search = self._simulation.search(self.words, limit_s)
        return EpisodeRecord(
            index=self._episode.index,
            seed=self._episode.index,
            start=(x, y, yaw),
            objects=tuple(object_record(item, self._counts) for item in self._judged(search)),
            contacts=self._robot.contacts,
            simulated_s=round(self._simulation.now_s, 3),
            trajectory=tuple(self._counts.trajectory),
            wall_s=0.0,
            scene=f"{Path(self._episode.scene).stem} episode {self._episode.index}",
        )

    def _watch(self, _frame: RgbdFrame, found: Detections) -> None:
        counts, state, image = self._counts, self._simulation.state, self._robot.adapter.image
        counts.trajectory.append(self._robot.xy)
        if state is None or image is None or not state.search.active:
            return
        index, name = state.search.index, state.search.target
        self._heights.add(index, float(self._robot.odometry()[2, 3]))
        wanted = list(self._truth[index].semantic_ids)
        if np.isin(image.semantic_ids, wanted).mean() >= IN_VIEW_SHARE:
            counts.in_view[name] = counts.in_view.get(name, 0) + 1
            counts.detected[name] = counts.detected.get(name, 0) + (name in found.names)

    def _judged(self, search: Search) -> list[ObjectSummary]:
        results = search.results
        missing = [not_sought(word) for word in self.words[len(results) :]]
        return [
            self._judge(index, result) if result.end_xy_m else unjudged(result)
            for index, result in enumerate((*results, *missing))
        ]

    def _judge(self, index: int, result: ObjectResult) -> ObjectSummary:
        end_m = self._heights.last.get(index, 0.0)
        start_m = self._heights.first.get(index, end_m)
        claimed = self._place(result.position_m[:2], end_m) if result.position_m else None
        places = SearchPlaces(
            self._place(result.start_xy_m or result.end_xy_m, start_m),
            self._place(result.end_xy_m, end_m),
            claimed,
        )
        return self._truth[index].judged(result, places, self._world)

    def _place(self, xy_m: tuple[float, ...], z_m: float) -> Point:
        """A place of the map in Habitat's coordinates."""
        return as_point(to_habitat(np.array([*xy_m, z_m]), self._robot.adapter.floor_y_m))


def word_of(category: str) -> str:
    """What is asked for: the category as an English word."""
    return WORDS.get(category, category.replace("_", " "))


def unjudged(result: ObjectResult) -> ObjectSummary:
    """Not found, and without any length: the search did not come to it."""
    return ObjectSummary(
        name=result.name,
        outcome=result.outcome.value,
        reason=result.reason,
        position_m=(),
        time_s=0.0,
        path_length_m=0.0,
        shortest_path_m=nan,
        true_distance_m=inf,
        goal_distance_m=inf,
    )
