"""Lockstep simulation: a whole search in simulated time, with the services' pure modules.

Each step renders and encodes a frame if one is due, fuses it, plans, computes a velocity command
and moves the robot, at the rates of the configuration and without latency. The result is a
function of configuration and seed; no bus is involved. The planner keeps the usual camera, not the
one that the mapper would tell it, so that searches compare with those of before.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from math import dist
from pathlib import Path
from typing import Any, Protocol

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.config import MapperConfig
from onemap_mapper.frame.update import compute_update
from onemap_mapper.places.keeper import map_places
from onemap_mapper.places.memory import PlaceMemory
from onemap_mapper.places.rooms import RoomKeeper
from onemap_mapper.query.replies import ViewReplies, search_view
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.similarity import TextQuery, text_query
from onemap_perception.config import PerceptionConfig
from onemap_perception.detectors.protocol import Detector
from onemap_perception.encoders.protocol import Encoder
from onemap_perception.factory import make_detector, make_encoder
from onemap_perception.feature_field import VarianceParams, feature_field
from onemap_perception.target_detection import Target, detect_in_frame, make_target, with_picture
from onemap_planner.config import PlannerConfig
from onemap_planner.motion.motions import Pose2d
from onemap_planner.motion.velocity_controller import ControllerInputs, Plan, VelocityController
from onemap_planner.policy.ledger import Ledger
from onemap_planner.policy.names import synonyms_of, view_request
from onemap_planner.policy.outcome import Observation
from onemap_planner.policy.state import PlannerState
from onemap_planner.policy.step import step
from onemap_planner.search.state_machine import EventStamp, Search, Starting, new_search
from onemap_planner.world.map_view import AssembledView, PlanningView, after
from onemap_shared.config import read, section
from onemap_shared.geometry import F64, Velocity2d, pose_2d, yaw_of
from onemap_shared.messages import (
    NO_VIEW,
    Detail,
    Detections,
    FeatureField,
    MapPlaces,
    Place,
    RgbdFrame,
    SearchViewRequest,
    ViewChangesRequest,
)
from onemap_shared.places import NOWHERE
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.errors import true_place
from onemap_simulator.parts import RobotParts
from onemap_simulator.physics.people import Bystanders
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.rendering.rgbd_camera import SceneRenderer
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.navigation.methods import ONEMAP, ConfidenceValueMap, SearchMethod

START_S = 1.0  # of stamps: 0 would mean that the map is empty
PLACES_HZ = 1.0  # as the planner asks for them
COMMAND_VALID_S = 0.3  # as ``VelocityCommand`` has it by default


@dataclass(frozen=True, slots=True)
class SystemConfig:
    """The sections of the configuration that determine a search."""

    simulator: SimulatorConfig = field(default_factory=SimulatorConfig)
    perception: PerceptionConfig = field(default_factory=PerceptionConfig)
    mapper: MapperConfig = field(default_factory=MapperConfig)
    planner: PlannerConfig = field(default_factory=PlannerConfig)

    @classmethod
    def read(cls, config: Path | None, **simulator: Any) -> SystemConfig:
        """The sections of a configuration file, with these settings of the simulator."""
        sections = read(config)
        robot = {**sections.get("simulator", {}), **simulator}
        return cls(
            section({"simulator": robot}, "simulator", SimulatorConfig),
            section(sections, "perception", PerceptionConfig),
            section(sections, "mapper", MapperConfig),
            section(sections, "planner", PlannerConfig),
        )

    def document(self) -> dict[str, Any]:
        """As a JSON object."""
        return {name: getattr(self, name).model_dump(mode="json") for name in self.__slots__}

    def searching(self, *, rgbd_hz: float, limit_s: float, **simulator: Any) -> SystemConfig:
        """The same at a rate of frames and with simulated seconds per object."""
        explore = self.planner.explore.model_copy(update={"object_limit_s": limit_s})
        return replace(
            self,
            simulator=self.simulator.model_copy(update={"rgbd_hz": rgbd_hz, **simulator}),
            planner=self.planner.model_copy(update={"explore": explore}),
        )


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
    """A robot whose time is an argument, in seconds; poses are T_map_body (4, 4).

    collided: whether an obstacle stopped it during the last ``advance``.
    """

    collided: bool

    @property
    def pose(self) -> F64:
        """The true pose."""

    def odometry(self) -> F64:
        """The pose as odometry reports it."""

    def advance(self, command: Velocity2d, before_s: float, now_s: float) -> None:
        """Move until ``now_s`` under a command received at ``before_s``."""

    def frames(self, now_s: float, *, capture: bool) -> list[RgbdFrame]:
        """The frames that arrived up to ``now_s``, after another was captured if it is due."""


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
        return place and (*true_place(self.T_reported, self.T_true, place), *place[2:])


class SimulatedRobot:
    """The simulator's robot and camera in simulated time; a ``Robot``."""

    def __init__(
        self, scene: Scene, config: SimulatorConfig, renderer: SceneRenderer | None = None
    ) -> None:
        parts = RobotParts.of(scene, config, renderer or Renderer(scene), now_s=0.0)
        self.localisation, self.link = parts.localisation, parts.link
        self.simulation, self._camera = parts.simulation, parts.camera
        self._truths: dict[int, FrameTruth] = {}  # by the frame's sequence
        self.collided = False

    @property
    def pose(self) -> F64:
        """See ``Robot``."""
        return self.simulation.state.pose

    def odometry(self) -> F64:
        """See ``Robot``: with the configured errors."""
        return self.localisation.reported(self.pose)

    def advance(self, command: Velocity2d, before_s: float, now_s: float) -> None:
        """See ``Robot``."""
        self.simulation.receive_command(command, before_s, COMMAND_VALID_S)
        self.collided = self.simulation.advance(now_s)

    def frames(self, now_s: float, *, capture: bool) -> list[RgbdFrame]:
        """See ``Robot``."""
        if capture:
            self.link.send(self.frame(now_s), now_s)
        return self.link.arrived(now_s)

    def truth_of(self, frame: RgbdFrame) -> FrameTruth:
        """How it truly was when the frame was captured."""
        return self._truths[frame.sequence]

    def frame(self, now_s: float) -> RgbdFrame:
        """The camera's frame at ``now_s``."""
        people, camera, sequence = self.simulation.bystanders, self._camera, len(self._truths) + 1
        image = camera.capture(self.pose, people)
        self._truths[sequence] = FrameTruth(self.pose @ camera.T_body_camera, people)
        T_map_camera = self.odometry() @ camera.T_body_camera
        stamp_ns = stamp_of(now_s)
        return RgbdFrame(
            sequence, stamp_ns, image.rgb, image.depth_mm, camera.intrinsics, T_map_camera
        )


class LockstepSimulation:
    """One robot that searches, wherever it is.

    watch: told of every frame of a search, and of what was detected in it; places: named on the
    map; path: the robot's true positions after each step, metres.
    """

    state: PlannerState  # from the first search on

    def __init__(
        self,
        robot: Robot,
        config: SystemConfig,
        perception: PerceptionPipeline,
        *,
        method: SearchMethod = ONEMAP,
        watch: Callable[[RgbdFrame, Detections], None] | None = None,
        places: Sequence[Place] = (),
    ) -> None:
        self.robot, self.now_s = robot, 0.0  # simulated seconds since the start
        self.path: list[tuple[float, float]] = [self.xy]
        self._named = tuple(places)
        self.planning_s: list[float] = []  # processor time of each step
        self.ends: list[SearchEnd] = []  # one for each result of the search
        self._config, self._perception = config, perception
        self._method, self._watch = method, watch
        self._take_map(BeliefMap(config.mapper.map))
        self._queries: dict[str, TextQuery] = {}
        self._wanted: dict[str, Target] = {}  # by the method's value map, for each object
        self._due_s: dict[str, float] = {}  # of each periodic task
        self._controller = VelocityController()
        self._motion_plan: Plan | None = None
        self.odometer_m = self._seen_s = 0.0  # seen_s: when the newest frame in the map was taken
        self._detections: list[Detections] = []
        self._reset_for: tuple[str, int] | None = None
        self._map_of: int | None = None  # index of the object that the last frame was taken for

    @property
    def xy(self) -> tuple[float, float]:
        """True position of the robot in the map, metres."""
        x, y = self.robot.pose[:2, 3].tolist()
        return x, y

    def search(
        self,
        objects: tuple[str, ...],
        limit_s: float,
        details: tuple[Detail, ...] = (),
    ) -> Search:
        """Search for the objects, until the search ends or ``limit_s`` have passed."""
        synonyms = synonyms_of(self._perception.encoder.embed_text(objects))
        stamp = EventStamp(self.now_s, 0.0, self.xy, self.odometer_m)
        search = replace(new_search("lockstep", objects, stamp, 0), details=details)
        return self._run(PlannerState(search, synonyms=synonyms), limit_s)

    def _run(self, state: PlannerState, limit_s: float) -> Search:
        self.state = state
        self.ends.clear()
        end_s = self.now_s + limit_s
        while self.state.search.active and self.now_s < end_s:
            self.step()
        return self.state.search

    def step(self) -> None:
        """One period of the velocity controller."""
        robot, planner = self.robot, self._config.planner
        rgbd_hz = self._config.simulator.rgbd_hz
        for frame in robot.frames(self.now_s, capture=self._is_due("frame", rgbd_hz)):
            self._process_frame(self.state.search, frame)
        T_map_body = robot.odometry()
        pose = Pose2d(float(T_map_body[0, 3]), float(T_map_body[1, 3]), yaw_of(T_map_body))
        if self._is_due("plan", planner.plan_hz):
            self._plan(self.state, pose)
        search = self.state.search
        search_id = search.search_id if search.active else ""
        age_s = max(self.now_s - self._seen_s, 1.0 / rgbd_hz)
        inputs = ControllerInputs(self.now_s, search_id, pose, "", map_age_s=age_s)
        self._controller, _ = self._controller.update(
            self._motion_plan,
            inputs,
            planner.drive,
            max_plan_age_s=planner.staleness.max_plan_age_s,
        )
        before, before_s = self.xy, self.now_s
        self.now_s += 1.0 / planner.control_hz
        robot.advance(self._controller.command, before_s, self.now_s)
        self.path.append(self.xy)
        self.odometer_m += dist(self.xy, before)

    def _is_due(self, task: str, rate_hz: float) -> bool:
        """Whether the task is due; if so, schedules it again after its period."""
        due_s = self._due_s.get(task, 0.0)
        if self.now_s + 1e-9 < due_s:
            return False
        self._due_s[task] = due_s + 1.0 / rate_hz
        return True

    def _take_map(self, belief: BeliefMap) -> None:
        self._places = NOWHERE
        self.belief = belief
        self._replies = ViewReplies(MapScores(belief), "lockstep")
        self._views: dict[SearchViewRequest, AssembledView] = {}  # the newest of each
        self._rooms = RoomKeeper(nullcontext())

    def _process_frame(self, search: Search, frame: RgbdFrame) -> None:
        field = self._perception.field(frame)
        if self._map_of != search.index:
            self._begin_object(search.index)
        self.belief.fuse(compute_update(field, self.belief.params))
        self._seen_s = frame.stamp_ns * 1e-9 - START_S
        if not search.target:
            return
        names = (*search.objects, *search.detail.anchors)
        target = make_target(self._perception.encoder, search.target, names)
        detections = detect_in_frame(self._perception.detector, target, frame, field.features)
        if search.detail.colour:
            detections = with_picture(detections, frame.rgb, search.target)
        self._detections.append(detections)
        if (values := self._method.value_map) is not None:
            self._add_value(values, search.target, frame, field)
        if self._watch is not None:
            self._watch(frame, detections)

    def _add_value(
        self, values: ConfidenceValueMap, name: str, frame: RgbdFrame, field: FeatureField
    ) -> None:
        wanted = self._wanted.get(name)
        if wanted is None:
            wanted = make_target(self._perception.encoder, name, values.names)
            self._wanted[name] = wanted
        others = replace(wanted, queries=wanted.queries if values.names else None)
        seen = detect_in_frame(self._perception.detector, others, frame, field.features)
        if wanted.queries is not None:
            values.add(field, wanted.queries, seen)

    def _begin_object(self, index: int) -> None:
        """Clear what the method does not keep from one object to the next."""
        if self._method.value_map is not None:
            self._method.value_map.clear()
        if self._method.forgets and index > 0:
            self._take_map(BeliefMap(self.belief.params, first_revision=self.belief.revision))
            self.state = replace(
                self.state, ledger=Ledger(), found_objects=(), trail=(), known_m2=0.0
            )
        self._map_of = index

    def _plan(self, state: PlannerState, pose: Pose2d) -> None:
        observation = Observation(
            now_s=self.now_s,
            pose=pose,
            odometer_m=self.odometer_m,
            command=self._controller.wanted,
            collided=self.robot.collided,
            view=self._view(state),
            detections=tuple(self._detections),
            stale_reason="",
            anchor_views=tuple(self._anchor_view(name) for name in state.search.detail.anchors),
            blocked=self._controller.blocked,
            creeps=self._controller.creeps(self._config.planner.drive),
            places=self._map_places(),
            offset_m=self.belief.history().offset_m,
        )
        self._detections.clear()
        method, began_s = self._method, time.process_time()
        outcome = step(
            state, observation, self._config.planner, method.exploration, method.consensus
        )
        self.planning_s.append(time.process_time() - began_s)
        self.state, decision = outcome.state, outcome.decision
        if len(self.state.search.results) > len(self.ends):
            reported = pose_2d(pose.x_m, pose.y_m, pose.yaw_rad)
            self.ends.append(SearchEnd(reported, self.robot.pose))
        if decision is not None:
            self._motion_plan = Plan(
                state.search.search_id, decision.motion, decision.costmap, self.now_s
            )

    def _map_places(self) -> MapPlaces:
        """The places as the mapper would tell them, with the rooms of at most a second ago."""
        if self._named and self._is_due("places", PLACES_HZ):
            view = search_view(MapScores(self.belief).of([]), text="")
            self._places = map_places(PlaceMemory(self._named, 1), self._rooms.of(view))
        return self._places

    def _view(self, state: PlannerState) -> PlanningView:
        search = state.search
        if not search.target:
            return self._newest(view_request(state))
        target = (search.search_id, search.index)
        if isinstance(search.phase, Starting) and self._reset_for != target:
            self.belief.reset_searched()
            self._reset_for = target
        return self._changed(self._newest(view_request(state)), self._method.value_map)

    def _anchor_view(self, name: str) -> PlanningView:
        return self._changed(self._newest(SearchViewRequest(name)), None)

    def _changed(self, view: AssembledView, value_map: ConfidenceValueMap | None) -> PlanningView:
        """What the method makes of a view of the map."""
        if value_map is None and self._method.view is None:
            return view
        whole = view.whole()
        if value_map is not None:
            whole = value_map.view(whole)
        return whole if self._method.view is None else self._method.view(whole)

    def _newest(self, request: SearchViewRequest) -> AssembledView:
        kept = self._views.get(request)
        sought = (request.text, *request.negatives)
        texts = (*sought, *request.rivals) if request.text else ()
        have = NO_VIEW if kept is None else kept.key
        also = request.negatives, request.colour
        question = ViewChangesRequest(request.text, request.rivals, have, *also)
        made = after(kept, self._replies.reply(question, [self._query(text) for text in texts]))
        self._views[request] = made
        return made

    def _query(self, text: str) -> TextQuery:
        if text not in self._queries:
            embeddings = self._perception.encoder.embed_text((text,))
            self._queries[text] = text_query(embeddings, 0, self.belief.params.torch_device)
        return self._queries[text]


def stamp_of(now_s: float) -> int:
    """The stamp in nanoseconds of a simulated second."""
    return int((now_s + START_S) * 1e9)
