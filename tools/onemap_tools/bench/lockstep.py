"""Lockstep simulation: a whole search in simulated time, with the services' pure modules.

Each step renders and encodes a frame if one is due, fuses it, plans, computes a velocity command
and moves the simulated robot, at the rates of the configuration and without latency. The result
is a function of configuration and seed; no bus is involved. The planner keeps the usual camera, not
the one that the mapper would tell it, so that searches compare with those of before.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.config import MapperConfig
from onemap_mapper.frame.update import compute_update
from onemap_mapper.query.replies import ViewReplies
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.similarity import TextQuery, text_query
from onemap_perception.config import PerceptionConfig
from onemap_perception.detectors.protocol import Detector
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.factory import make_detector, make_encoder
from onemap_perception.feature_field import VarianceParams, feature_field
from onemap_perception.target_detection import detect_in_frame, make_target
from onemap_planner.config import PlannerConfig
from onemap_planner.motion.motions import Pose2d
from onemap_planner.motion.velocity_controller import (
    ControllerInputs,
    Plan,
    VelocityController,
)
from onemap_planner.policy.evidence import rival_names, synonyms_of
from onemap_planner.policy.explore import explore
from onemap_planner.policy.memory import PlannerState
from onemap_planner.policy.object_order import name_to_ask
from onemap_planner.policy.outcome import Observation
from onemap_planner.policy.step import Exploration, step
from onemap_planner.search.phases import Destination, EventStamp, Search, Starting
from onemap_planner.search.state_machine import new_search
from onemap_planner.world.candidates import CONSENSUS, Consensus
from onemap_planner.world.map_view import AssembledView, PlanningView, after
from onemap_shared.config import read, section
from onemap_shared.geometry import F64, Velocity2d, pose_2d, yaw_of
from onemap_shared.messages import (
    NO_VIEW,
    Detections,
    FeatureField,
    RgbdFrame,
    SearchOrder,
    SearchView,
    SearchViewRequest,
    TextEmbeddings,
    ViewChangesRequest,
)
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.errors import true_place
from onemap_simulator.parts import RobotParts
from onemap_simulator.physics.people import Bystanders
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.rendering.rgbd_camera import SceneRenderer
from onemap_simulator.scene.scene import Scene

START_S = 1.0  # of stamps: 0 would mean that the map is empty
COMMAND_VALID_S = 0.3  # as ``VelocityCommand`` has it by default


@dataclass(frozen=True, slots=True)
class SystemConfig:
    """The sections of the configuration that determine a search."""

    simulator: SimulatorConfig = field(default_factory=SimulatorConfig)
    perception: PerceptionConfig = field(default_factory=PerceptionConfig)
    mapper: MapperConfig = field(default_factory=MapperConfig)
    planner: PlannerConfig = field(default_factory=PlannerConfig)

    @classmethod
    def read(cls, config: Path | None, seed: int, style: str) -> SystemConfig:
        """The sections of a configuration file, in the apartment of a seed and style."""
        sections = read(config)
        simulator = {**sections.get("simulator", {}), "seed": seed, "style": style}
        return cls(
            simulator=section({"simulator": simulator}, "simulator", SimulatorConfig),
            perception=section(sections, "perception", PerceptionConfig),
            mapper=section(sections, "mapper", MapperConfig),
            planner=section(sections, "planner", PlannerConfig),
        )

    def document(self, *sections: str) -> dict[str, Any]:
        """These sections as a JSON object."""
        return {name: getattr(self, name).model_dump(mode="json") for name in sections}


class PerceptionPipeline:
    """Encoder and detector: those of a configuration, or given ones."""

    def __init__(
        self,
        config: PerceptionConfig,
        *,
        encoder: Encoder | None = None,
        detector: Detector | None = None,
    ) -> None:
        self.encoder: Encoder = encoder or make_encoder(config.encoder)
        self.detector: Detector = detector or make_detector(config.detector, self.encoder)
        self._variance = VarianceParams(config.variance)

    def field(self, frame: RgbdFrame) -> FeatureField:
        """The frame's features and variances, as perception publishes them."""
        features = self.encoder.encode(frame.rgb)
        return feature_field(frame, features, self.encoder, self._variance)


class Robot(Protocol):
    """A robot whose time is an argument, in seconds."""

    @property
    def xy(self) -> tuple[float, float]:
        """True position in the map, metres."""

    @property
    def collided(self) -> bool:
        """Whether an obstacle stopped it during the last ``advance``."""

    @property
    def contacts(self) -> int:
        """How often an obstacle stopped it from above the speed of a contact."""

    @property
    def edges_crossed(self) -> int:
        """How often it came over a place without floor."""

    def advance(self, command: Velocity2d, before_s: float, now_s: float) -> None:
        """Move until ``now_s`` under a command received at ``before_s``."""

    def odometry(self) -> F64:
        """T_map_body (4, 4) as odometry reports it."""

    def frame(self, now_s: float) -> RgbdFrame:
        """The camera's frame at ``now_s``."""


@dataclass(slots=True)
class SimulatedClock:
    """Simulated seconds, and the next due time of each periodic task."""

    now_s: float = 0.0
    due_s: dict[str, float] = field(default_factory=dict)

    def is_due(self, task: str, rate_hz: float) -> bool:
        """Whether the task is due; if so, schedules it again after its period."""
        due_s = self.due_s.get(task, 0.0)
        if self.now_s + 1e-9 < due_s:
            return False
        self.due_s[task] = due_s + 1.0 / rate_hz
        return True


class ValueMap(Protocol):
    """Scores of cells for one object, from all frames since the last ``clear``."""

    def clear(self) -> None:
        """Forget all frames."""

    def add(self, field: FeatureField, query: TextEmbeddings) -> None:
        """Take in a frame for the query's first text."""

    def view(self, view: SearchView) -> SearchView:
        """The view with these scores in place of the similarity."""


@dataclass(frozen=True, slots=True)
class SearchMethod:
    """exploration: where to drive while nothing is approached; consensus: when detector and map
    agree; view: changes what the planner sees of the map, None: nothing; value_map: scores cells
    in place of the belief map; forgets: the map and what the planner knows of it are cleared for
    each object."""

    exploration: Exploration = explore
    consensus: Consensus = CONSENSUS
    view: Callable[[SearchView], SearchView] | None = None
    value_map: ValueMap | None = None
    forgets: bool = False


ONEMAP = SearchMethod()


@dataclass(frozen=True, slots=True)
class FrameTruth:
    """Of a frame: the true T_map_camera (4, 4) of its capture, and where people were then."""

    T_map_camera: F64
    people: Bystanders


@dataclass(frozen=True, slots=True)
class SearchEnd:
    """Reported and true T_map_body (4, 4) when the search for an object ended."""

    T_reported: F64
    T_true: F64

    def true_place(self, place: tuple[float, ...]) -> tuple[float, ...]:
        """Where a place (x, y, ...) truly is that the search told at that time; empty if it is."""
        if not place:
            return place
        return (*true_place(self.T_reported, self.T_true, place), *place[2:])


class SimulatedRobot:
    """The simulator's robot and camera in simulated time."""

    def __init__(
        self, scene: Scene, config: SimulatorConfig, renderer: SceneRenderer | None = None
    ) -> None:
        parts = RobotParts.of(scene, config, renderer or Renderer(scene), now_s=0.0)
        self.localisation, self.link = parts.localisation, parts.link
        self._simulation, self._camera = parts.simulation, parts.camera
        self._frames = 0
        self._truths: dict[int, FrameTruth] = {}  # by the frame's sequence
        self.collided = False

    @property
    def xy(self) -> tuple[float, float]:
        """True position in the map, metres."""
        T_map_body = self._simulation.state.pose
        return float(T_map_body[0, 3]), float(T_map_body[1, 3])

    @property
    def speed_mps(self) -> float:
        """True forward speed, m/s."""
        return self._simulation.state.velocity.linear_mps

    @property
    def contacts(self) -> int:
        """How often an obstacle stopped the robot from above ``IMPACT_MPS``."""
        return self._simulation.counts.collisions

    @property
    def people_touched(self) -> int:
        """How many of the contacts were with people."""
        return self._simulation.counts.people_touched

    @property
    def edges_crossed(self) -> int:
        """How often the robot's disc came over a place without floor."""
        return self._simulation.counts.edges_crossed

    def advance(self, command: Velocity2d, before_s: float, now_s: float) -> None:
        """Move until ``now_s`` under a command received at ``before_s``."""
        self._simulation.receive_command(command, before_s, COMMAND_VALID_S)
        self.collided = self._simulation.advance(now_s)

    @property
    def pose(self) -> F64:
        """True T_map_body (4, 4)."""
        return self._simulation.state.pose

    def odometry(self) -> F64:
        """T_map_body (4, 4) as odometry reports it: with the configured errors."""
        return self.localisation.reported(self.pose)

    def frames(self, now_s: float, *, capture: bool) -> list[RgbdFrame]:
        """The frames that arrived up to ``now_s``, after another was captured if it is due."""
        if capture:
            self.link.send(self.frame(now_s), now_s)
        return self.link.arrived(now_s)

    def truth_of(self, frame: RgbdFrame) -> FrameTruth:
        """How it truly was when the frame was captured."""
        return self._truths[frame.sequence]

    def frame(self, now_s: float) -> RgbdFrame:
        """The camera's frame at ``now_s``."""
        people = self._simulation.bystanders
        image = self._camera.capture(self.pose, people)
        self._frames += 1
        T_map_camera = self.pose @ self._camera.T_body_camera
        self._truths[self._frames] = FrameTruth(T_map_camera, people)
        return RgbdFrame(
            self._frames,
            stamp_of(now_s),
            image.rgb,
            image.depth_mm,
            self._camera.intrinsics,
            self.odometry() @ self._camera.T_body_camera,
        )


class LockstepViews:
    """Views of one map, by what was asked for."""

    def __init__(self, belief: BeliefMap) -> None:
        self._replies = ViewReplies(MapScores(belief), "lockstep")
        self._kept: dict[SearchViewRequest, AssembledView] = {}

    def view(self, request: SearchViewRequest, queries: Sequence[TextQuery]) -> AssembledView:
        """The newest view; queries: of the text and of its rivals, none in an empty map."""
        kept = self._kept.get(request)
        have = NO_VIEW if kept is None else kept.key
        question = ViewChangesRequest(request.text, request.rivals, have)
        made = after(kept, self._replies.reply(question, queries))
        self._kept[request] = made
        return made


# Told of every frame and of what was detected in it.
FrameWatch = Callable[[RgbdFrame, Detections], None]


class LockstepSimulation:
    """One robot that searches in one scene, or a given robot wherever it is."""

    def __init__(
        self,
        scene: Scene | Robot,
        config: SystemConfig,
        perception: PerceptionPipeline,
        *,
        method: SearchMethod = ONEMAP,
        renderer: SceneRenderer | None = None,
        watch: FrameWatch | None = None,
    ) -> None:
        self.robot: Robot = (
            SimulatedRobot(scene, config.simulator, renderer) if isinstance(scene, Scene) else scene
        )
        self.belief = BeliefMap(config.mapper.map)
        self.state: PlannerState | None = None
        self._config, self._perception = config, perception
        self._method, self._watch = method, watch
        self._views = LockstepViews(self.belief)
        self._queries: dict[str, TextQuery] = {}
        self._clock = SimulatedClock()
        self._controller = VelocityController()
        self._motion_plan: Plan | None = None
        self._odometer_m = self._seen_s = 0.0  # seen_s: when the newest frame in the map was taken
        self._detections: list[Detections] = []
        self._reset_for: tuple[str, int] | None = None
        self.ends: list[SearchEnd] = []  # of a simulated robot: one for each result of the search
        self._map_of: int | None = None  # index of the object that the last frame was taken for

    @property
    def now_s(self) -> float:
        """Simulated seconds since the start."""
        return self._clock.now_s

    def search(
        self, objects: tuple[str, ...], limit_s: float, order: SearchOrder = SearchOrder.GIVEN
    ) -> Search:
        """Search for the objects, until the search ends or ``limit_s`` have passed."""
        synonyms = synonyms_of(self._perception.encoder.embed_text(objects))
        search = new_search("lockstep", objects, self._stamp(), 0, order=order)
        return self._run(PlannerState(search, synonyms=synonyms), limit_s)

    def drive(self, destination: Destination, limit_s: float) -> Search:
        """Drive to a place, until the drive ends or ``limit_s`` have passed."""
        search = new_search("lockstep", (), self._stamp(), 0, destination)
        return self._run(PlannerState(search), limit_s)

    def _stamp(self) -> EventStamp:
        return EventStamp(self.now_s, 0.0, self.robot.xy, self._odometer_m)

    def _run(self, state: PlannerState, limit_s: float) -> Search:
        self.state = state
        self.ends.clear()
        end_s = self.now_s + limit_s
        while self.state.search.active and self.now_s < end_s:
            self._step(self.state)
        return self.state.search

    def _step(self, state: PlannerState) -> None:
        clock, robot = self._clock, self.robot
        planner, simulator = self._config.planner, self._config.simulator
        for frame in self._arrived(capture=clock.is_due("frame", simulator.rgbd_hz)):
            self._process_frame(state.search, frame)
            state = self.state or state
        T_map_body = robot.odometry()
        pose = Pose2d(float(T_map_body[0, 3]), float(T_map_body[1, 3]), yaw_of(T_map_body))
        if clock.is_due("plan", planner.plan_hz):
            self._plan(state, pose)
        active = self.state is not None and self.state.search.active
        search_id = state.search.search_id if active else ""
        age_s = max(clock.now_s - self._seen_s, 1.0 / simulator.rgbd_hz)
        inputs = ControllerInputs(clock.now_s, search_id, pose, "", map_age_s=age_s)
        self._controller, _ = self._controller.update(
            self._motion_plan,
            inputs,
            planner.drive,
            max_plan_age_s=planner.staleness.max_plan_age_s,
        )
        before, before_s = robot.xy, clock.now_s
        clock.now_s += 1.0 / planner.control_hz
        robot.advance(self._controller.command, before_s, clock.now_s)
        self._odometer_m += float(np.hypot(robot.xy[0] - before[0], robot.xy[1] - before[1]))

    def _arrived(self, *, capture: bool) -> list[RgbdFrame]:
        """The frames that arrived by now, after another was captured if it is due."""
        if isinstance(self.robot, SimulatedRobot):
            return self.robot.frames(self.now_s, capture=capture)
        return [self.robot.frame(self.now_s)] if capture else []

    def _process_frame(self, search: Search, frame: RgbdFrame) -> None:
        field = self._perception.field(frame)
        if self._map_of != search.index:
            self._begin_object(search.index)
        self.belief.fuse(compute_update(field, self.belief.params))
        self._seen_s = seconds_of(frame.stamp_ns)
        if not search.target:
            return
        target = make_target(self._perception.encoder, search.target, search.objects)
        detections = detect_in_frame(self._perception.detector, target, frame, field.features)
        self._detections.append(detections)
        if self._method.value_map is not None and target.queries is not None:
            self._method.value_map.add(field, target.queries)
        if self._watch is not None:
            self._watch(frame, detections)

    def _begin_object(self, index: int) -> None:
        """Clear what the method does not keep from one object to the next."""
        if self._method.value_map is not None:
            self._method.value_map.clear()
        if self._method.forgets and self.state is not None and index > 0:
            self.belief = BeliefMap(self._config.mapper.map, first_revision=self.belief.revision)
            self._views = LockstepViews(self.belief)
            self.state = replace(
                self.state, visited_frontiers=(), found_objects=(), trail=(), known_m2=0.0
            )
        self._map_of = index

    def _plan(self, state: PlannerState, pose: Pose2d) -> None:
        observation = Observation(
            now_s=self.now_s,
            pose=pose,
            odometer_m=self._odometer_m,
            command=self._controller.wanted,
            collided=self.robot.collided,
            view=self._view(state),
            detections=tuple(self._detections),
            stale_reason="",
            other_view=self._other_view(state),
            blocked=self._controller.blocked,
            creeps=self._controller.creeps(self._config.planner.drive),
        )
        self._detections.clear()
        method = self._method
        outcome = step(
            state, observation, self._config.planner, method.exploration, method.consensus
        )
        self.state, decision = outcome.state, outcome.decision
        ended = len(self.state.search.results) > len(self.ends)
        if ended and isinstance(self.robot, SimulatedRobot):
            reported = pose_2d(pose.x_m, pose.y_m, pose.yaw_rad)
            self.ends.append(SearchEnd(reported, self.robot.pose))
        if decision is not None:
            self._motion_plan = Plan(
                state.search.search_id, decision.motion, decision.costmap, self.now_s
            )

    def _view(self, state: PlannerState) -> PlanningView:
        search = state.search
        if not search.target:
            return self._views.view(SearchViewRequest(), [])
        target_key = (search.search_id, search.index)
        if isinstance(search.phase, Starting) and self._reset_for != target_key:
            self.belief.reset_searched()
            self._reset_for = target_key
        return self._changed(self._view_of(search.target, state), self._method.value_map)

    def _changed(self, view: AssembledView, value_map: ValueMap | None) -> PlanningView:
        """What the method makes of a view of the map."""
        if value_map is None and self._method.view is None:
            return view
        whole = view.whole()
        if value_map is not None:
            whole = value_map.view(whole)
        return whole if self._method.view is None else self._method.view(whole)

    def _other_view(self, state: PlannerState) -> PlanningView | None:
        """The view for a waiting object, if one is due."""
        name = name_to_ask(state)
        return self._changed(self._view_of(name, state), None) if name else None

    def _view_of(self, name: str, state: PlannerState) -> AssembledView:
        names = rival_names(name, state.search.objects, state.found_objects, state.synonyms)
        queries = [self._query(each) for each in (name, *names)]
        return self._views.view(SearchViewRequest(name, names), queries)

    def _query(self, text: str) -> TextQuery:
        if text not in self._queries:
            embeddings = self._perception.encoder.embed_text((text,))
            self._queries[text] = text_query(embeddings, 0, self.belief.params.torch_device)
        return self._queries[text]


def stamp_of(now_s: float) -> int:
    """The stamp in nanoseconds of a simulated second."""
    return int((now_s + START_S) * 1e9)


def seconds_of(stamp_ns: int) -> float:
    """The simulated second of a stamp."""
    return stamp_ns * 1e-9 - START_S
