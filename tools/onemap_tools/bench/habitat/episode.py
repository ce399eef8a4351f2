"""One episode in Habitat, in simulated time: the robot, the search, the verdict.

Two rules say what is found. The paper's: the robot stopped less than 1.5 m, in a straight line seen
from above, from the box of an instance; what an instance is follows the released evaluation, by
semantic ids and by the annotators' names. Habitat's ObjectNav: at most 0.1 m of way from one of the
episode file's view points. Shortest paths lead to the nearest view point under both, as the files'
own do.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from math import inf, nan
from pathlib import Path

import numpy as np

from onemap_shared.geometry import F64, Velocity2d, yaw_of
from onemap_shared.messages import Detections, ObjectResult, RgbdFrame
from onemap_simulator.ground_truth import SUCCESS_RADIUS_M
from onemap_simulator.rendering.rgbd_camera import measured_mm
from onemap_tools.bench.habitat.episode_files import (
    CategoryGoals,
    GoalsOfScene,
    HabitatEpisode,
    goals_of,
)
from onemap_tools.bench.habitat.world import (
    AgentImage,
    AgentParams,
    AnnotatedBox,
    HabitatWorld,
    Point,
    as_point,
    body_pose,
    habitat_rotation,
    to_habitat,
)
from onemap_tools.bench.lockstep import (
    LockstepSimulation,
    PerceptionPipeline,
    SystemConfig,
    stamp_of,
)
from onemap_tools.bench.navigation.episode import (
    IN_VIEW_SHARE,
    OVERALL_LIMIT,
    RGBD_HZ,
    FrameCounts,
    not_sought,
    object_record,
)
from onemap_tools.bench.navigation.methods import planner_config, search_method
from onemap_tools.bench.navigation.records import EpisodeRecord
from onemap_tools.bench.options import HabitatBench, SuccessRule
from onemap_tools.demo.summary import ObjectSummary

MAX_STEP_S = 0.05  # at 0.7 m/s 35 mm: an arc is that near to its chord
BLOCKED_M = 1e-3  # the navigation mesh stopped a step that ends so far from where it should
IMPACT_MPS = 0.05  # below this speed, contact is not counted
# What is asked for in place of a category whose name is no English word for the object.
WORDS = {"plant": "potted plant", "tv_monitor": "television"}
# Annotators' names, or parts of them, that the released evaluation counts beside a category's own.
ALSO_NAMED = {"plant": "flower", "sofa": "couch"}


class HabitatRobot:
    """Implements ``Robot`` of the lockstep simulation; a new one for each episode.

    The agent must stand at the start of its episode: its height becomes the map's z = 0.
    """

    def __init__(self, world: HabitatWorld, params: AgentParams) -> None:
        self._world, self._params = world, params
        self.floor_y_m = world.pose[0][1]
        self.collided = self._touches = False
        self.contacts = self.edges_crossed = self._frames = 0
        self.image: AgentImage | None = None

    @property
    def xy(self) -> tuple[float, float]:
        """True position in the map, metres; odometry has no error here."""
        x, y, _ = self.odometry()[:3, 3]
        return float(x), float(y)

    def odometry(self) -> F64:
        """T_map_body (4, 4)."""
        return body_pose(*self._world.pose, self.floor_y_m)

    def advance(self, command: Velocity2d, before_s: float, now_s: float) -> None:
        """Drive along the arc of a command from ``before_s`` to ``now_s``."""
        p = self._params
        linear_mps = float(np.clip(command.linear_mps, -p.max_linear_mps, p.max_linear_mps))
        turn = float(np.clip(command.angular_radps, -p.max_angular_radps, p.max_angular_radps))
        self.collided = False
        steps = int(np.ceil((now_s - before_s) / MAX_STEP_S - 1e-6))
        for _ in range(steps if linear_mps or turn else 0):
            self._drive(linear_mps, turn, (now_s - before_s) / steps)

    def _drive(self, linear_mps: float, turn_radps: float, dt_s: float) -> None:
        T_map_body = self.odometry()
        yaw, turned = yaw_of(T_map_body), turn_radps * dt_s
        heading = yaw + turned / 2
        chord_m = linear_mps * dt_s * float(np.sinc(turned / 2 / np.pi))  # sinc has pi in it
        goal = T_map_body[:3, 3] + [chord_m * np.cos(heading), chord_m * np.sin(heading), 0.0]
        target = to_habitat(goal, self.floor_y_m)
        reached = self._world.move(as_point(target), habitat_rotation(yaw + turned))
        off_m = float(np.hypot(reached[0] - target[0], reached[2] - target[2]))
        touched, self._touches = self._touches, off_m > BLOCKED_M
        self.collided |= self._touches
        if self._touches and not touched and abs(linear_mps) > IMPACT_MPS:
            self.contacts += 1

    def frame(self, now_s: float) -> RgbdFrame:
        """The camera's frame; ``image`` keeps it with what only the benchmark may know."""
        p, self.image = self._params, self._world.capture()
        self._frames += 1
        depth_mm = measured_mm(self.image.depth_m, p.min_depth_m, p.max_depth_m)
        T_map_camera = self.odometry() @ p.mount
        return RgbdFrame(
            self._frames, stamp_of(now_s), self.image.rgb, depth_mm, p.intrinsics, T_map_camera
        )


@dataclass(frozen=True, slots=True)
class CategoryTruth:
    """Ground truth of one category in the open scene."""

    goals: CategoryGoals
    instances: tuple[AnnotatedBox, ...]
    others: tuple[AnnotatedBox, ...]
    rule: SuccessRule

    @classmethod
    def of(
        cls, category: str, goals: CategoryGoals, boxes: Iterable[AnnotatedBox], rule: SuccessRule
    ) -> CategoryTruth:
        """ValueError if the paper's rule has no box of an instance to measure from."""
        every = tuple(boxes)
        instances = tuple(box for box in every if is_instance(box, category, goals))
        if rule == "paper" and not instances:
            raise ValueError(
                f"no annotated object of the scene is a {category!r}: the paper's rule needs the "
                "semantic annotations of HM3D; without them choose --success habitat"
            )
        others = tuple(box for box in every if box not in instances)
        return cls(goals, instances, others, rule)

    @property
    def semantic_ids(self) -> frozenset[int]:
        """Of all instances."""
        return self.goals.object_ids | {box.semantic_id for box in self.instances}

    def distance_m(self, place: Point) -> float:
        """Straight line, seen from above, to the box of the nearest instance."""
        return min((horizontal_m(box, place) for box in self.instances), default=inf)

    def judged(
        self,
        result: ObjectResult,
        world: HabitatWorld,
        *,
        start: Point,
        end: Point,
        claimed: Point | None,
    ) -> ObjectSummary:
        """The result beside the truth; ``goal_distance_m`` is 0 where the rule counts it.

        Places are Habitat's: where the search began and ended, and what it claims to have found.
        """
        near_m = self.distance_m(end)
        path_m = world.path_m(end, self.goals.view_points)
        if self.rule == "paper":
            path_m = 0.0 if near_m < SUCCESS_RADIUS_M else max(path_m, near_m)
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
            goal_distance_m=path_m,
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


@dataclass(frozen=True, slots=True)
class HabitatSetup:
    """How episodes are run: as the command has it, with the services' configuration."""

    options: HabitatBench
    config: SystemConfig
    agent: AgentParams = field(default_factory=AgentParams)


class EpisodeRun:
    """One episode: opens its scene, searches for its objects, judges every result."""

    def __init__(
        self,
        episode: HabitatEpisode,
        goals: GoalsOfScene,
        world: HabitatWorld,
        setup: HabitatSetup,
        perception: PerceptionPipeline,
    ) -> None:
        options = setup.options
        self._episode, self._setup, self._world = episode, setup, world
        world.open(options.scenes / episode.scene, options.scenes / episode.scene_config)
        world.place(episode.start, episode.rotation)
        boxes = world.boxes()
        self._words = tuple(
            WORDS.get(category, category.replace("_", " ")) for category in episode.objects
        )
        self._truth = [
            CategoryTruth.of(name, goals_of(goals, episode.scene, name), boxes, options.success)
            for name in episode.objects
        ]
        self._robot = HabitatRobot(world, setup.agent)
        simulator = setup.config.simulator.model_copy(update={"rgbd_hz": RGBD_HZ})
        planner = planner_config(setup.config.planner, options.limit)
        self._simulation = LockstepSimulation(
            self._robot,
            replace(setup.config, simulator=simulator, planner=planner),
            perception,
            method=search_method(options.method, setup.config.mapper.cell_size_m),
            watch=self._watch,
        )
        self._counts = FrameCounts(())
        self._heights_m: dict[int, list[float]] = {}  # of the body, in the frames of each object

    def run(self) -> EpisodeRecord:
        """Search and judge; ``wall_s`` stays 0."""
        (x, y), yaw = self._robot.xy, yaw_of(self._robot.odometry())
        limit_s = self._setup.options.limit * len(self._words) * OVERALL_LIMIT
        search = self._simulation.search(self._words, limit_s)
        missing = [not_sought(word) for word in self._words[len(search.results) :]]
        return EpisodeRecord(
            index=self._episode.index,
            seed=self._episode.index,
            start=(x, y, yaw),
            objects=tuple(
                object_record(self._judge(index, result), self._counts)
                for index, result in enumerate((*search.results, *missing))
            ),
            contacts=self._robot.contacts,
            simulated_s=round(self._simulation.now_s, 3),
            trajectory=tuple(self._counts.trajectory),
            wall_s=0.0,
            scene=f"{Path(self._episode.scene).stem} episode {self._episode.index}",
        )

    def _watch(self, _frame: RgbdFrame, found: Detections) -> None:
        counts, state, image = self._counts, self._simulation.state, self._robot.image
        counts.trajectory.append(self._robot.xy)
        if state is None or image is None or not state.search.active:
            return
        index, name = state.search.index, state.search.target
        self._heights_m.setdefault(index, []).append(float(self._robot.odometry()[2, 3]))
        wanted = list(self._truth[index].semantic_ids)
        if np.isin(image.semantic_ids, wanted).mean() >= IN_VIEW_SHARE:
            counts.in_view[name] = counts.in_view.get(name, 0) + 1
            counts.detected[name] = counts.detected.get(name, 0) + (name in found.names)

    def _judge(self, index: int, result: ObjectResult) -> ObjectSummary:
        if not result.end_xy_m:  # the search did not come to it
            outcome = result.outcome.value
            return ObjectSummary(
                result.name, outcome, result.reason, (), 0.0, 0.0, nan, inf, goal_distance_m=inf
            )
        heights_m = self._heights_m.get(index, [0.0])

        def place(xy_m: tuple[float, ...], z_m: float) -> Point:
            return as_point(to_habitat(np.array([*xy_m, z_m]), self._robot.floor_y_m))

        return self._truth[index].judged(
            result,
            self._world,
            start=place(result.start_xy_m or result.end_xy_m, heights_m[0]),
            end=place(result.end_xy_m, heights_m[-1]),
            claimed=place(result.position_m[:2], heights_m[-1]) if result.position_m else None,
        )
