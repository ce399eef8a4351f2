"""Grid world for whole searches: simulated walls, camera, similarity and detections.

Inputs of the other services are computed from a known floor plan, with simulated time, so
that a search takes seconds and is repeatable.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from onemap_planner.config import PlannerConfig
from onemap_planner.motion.motions import STOP, Pose2d
from onemap_planner.motion.pure_pursuit import ARRIVE_M
from onemap_planner.motion.velocity_controller import PathTracker, Plan
from onemap_planner.planning_thread import planned_path
from onemap_planner.policy.names import rival_names
from onemap_planner.policy.outcome import Decision, Observation
from onemap_planner.policy.state import PlannerState
from onemap_planner.policy.step import step
from onemap_planner.search import state_machine as sm
from onemap_planner.sentences import confirming
from onemap_shared.geometry import F32, F64, I64, U8, Bool, Velocity2d
from onemap_shared.grid import GridSpec
from onemap_shared.messages import (
    Detail,
    Detections,
    KeptObject,
    Layer,
    MapPlaces,
    Occupancy,
    SearchView,
)
from onemap_shared.places import NOWHERE
from tests.planner.drawn_maps import detections_of

CELL_M = 0.1
FOV_RAD = np.deg2rad(79.0)
RANGE_M = 4.5
BLIND_M = 0.8  # the camera sees no floor nearer than this
ASSUMED_M = 0.35  # around the first place, floor counts as free all the same, as in the mapper
DETECT_M = 3.0
STEP_S = 0.05
CONTROLS_PER_STEP = 10  # a plan every half second is as good, and searches take half the time


@dataclass
class FloorPlan:
    """A floor plan: solid (nx, ny) bool; things: name -> mask of the cells it covers."""

    solid: Bool
    things: dict[str, Bool] = field(default_factory=dict)

    @property
    def grid(self) -> GridSpec:
        return GridSpec(CELL_M, (-20, -10), (self.solid.shape[0], self.solid.shape[1]))

    def wall(self, x0: float, y0: float, x1: float, y1: float) -> None:
        """Solid from (x0, y0) to (x1, y1), metres from the plan's corner."""
        self.solid[self._box(x0, y0, x1, y1)] = True

    def door(self, x0: float, y0: float, x1: float, y1: float) -> None:
        self.solid[self._box(x0, y0, x1, y1)] = False

    def put(self, name: str, x: float, y: float, size: float) -> None:
        mask = np.zeros_like(self.solid)
        mask[self._box(x, y, x + size, y + size)] = True
        self.things[name] = self.things.get(name, np.zeros_like(mask)) | mask
        self.solid |= mask

    def _box(self, x0: float, y0: float, x1: float, y1: float) -> tuple[slice, slice]:
        a, b, c, d = (round(value / CELL_M) for value in (x0, x1, y0, y1))
        return slice(a, b), slice(c, d)


def four_rooms() -> FloorPlan:
    """10 x 8 m: four rooms around a cross of walls, with doors, and some furniture."""
    floor_plan = FloorPlan(np.zeros((100, 80), bool))
    for wall in ((0, 0, 10, 0.1), (0, 7.9, 10, 8), (0, 0, 0.1, 8), (9.9, 0, 10, 8)):
        floor_plan.wall(*wall)
    floor_plan.wall(5.0, 0, 5.1, 8)
    floor_plan.wall(0, 4.0, 10, 4.1)
    floor_plan.door(5.0, 1.5, 5.1, 2.4)
    floor_plan.door(5.0, 5.5, 5.1, 6.4)
    floor_plan.door(2.0, 4.0, 2.9, 4.1)
    floor_plan.put("table", 3.4, 0.8, 0.8)
    floor_plan.put("sofa", 8.6, 6.4, 0.9)
    floor_plan.put("bed", 0.3, 6.0, 1.4)
    floor_plan.put("vase", 9.4, 0.6, 0.3)
    return floor_plan


def two_rooms() -> FloorPlan:
    """5 x 8 m: the half of ``four_rooms`` with the table and the bed."""
    plan = FloorPlan(np.zeros((50, 80), bool))
    for wall in ((0, 0, 5, 0.1), (0, 7.9, 5, 8), (0, 0, 0.1, 8), (4.9, 0, 5, 8)):
        plan.wall(*wall)
    plan.wall(0, 4.0, 5, 4.1)
    plan.door(2.0, 4.0, 2.9, 4.1)
    plan.put("table", 3.4, 0.8, 0.8)
    plan.put("bed", 0.3, 6.0, 1.4)
    return plan


def one_room() -> FloorPlan:
    """5 x 4 m with a table and a bed."""
    plan = FloorPlan(np.zeros((50, 40), bool))
    for wall in ((0, 0, 5, 0.1), (0, 3.9, 5, 4), (0, 0, 0.1, 4), (4.9, 0, 5, 4)):
        plan.wall(*wall)
    plan.put("table", 3.4, 0.8, 0.8)
    plan.put("bed", 0.3, 2.2, 1.4)
    return plan


@dataclass
class GridWorld:
    """The robot in its floor plan and the map made so far; mutable."""

    floor_plan: FloorPlan
    pose: Pose2d
    confidence: F64 = field(init=False)
    since_reset: F64 = field(init=False)
    occupancy: U8 = field(init=False)
    velocity: Velocity2d = STOP
    wanted: Velocity2d = STOP  # by the plan, before the costmap was checked
    collided: bool = False
    sequence: int = 0
    odometer_m: float = 0.0
    entered_solid: bool = False

    def __post_init__(self) -> None:
        self.obstacles = self.floor_plan.grid.centres(np.argwhere(self.floor_plan.solid))
        cells = np.moveaxis(np.indices(self.floor_plan.solid.shape), 0, -1)
        self.centres = self.floor_plan.grid.centres(cells)
        self.likeness = {name: self._similarity(name) for name in (*self.floor_plan.things, "")}
        self._sight: tuple[Pose2d, Bool, I64, F64] | None = None
        self.forget()

    def forget(self) -> None:
        """An empty map, as after the mapper was restarted."""
        self.confidence = np.zeros(self.floor_plan.solid.shape)
        self.since_reset = np.zeros(self.floor_plan.solid.shape)
        self.occupancy = np.zeros(self.floor_plan.solid.shape, np.uint8)
        self.assumed = np.zeros(self.floor_plan.solid.shape, bool)
        self.start_xy: tuple[float, float] | None = None

    def drive(self, command: Velocity2d, dt_s: float) -> None:
        """Move by the command; solid cells stop the robot and set ``collided``."""
        yaw = self.pose.yaw_rad + command.angular_radps * dt_s
        x = self.pose.x_m + command.linear_mps * dt_s * np.cos(yaw)
        y = self.pose.y_m + command.linear_mps * dt_s * np.sin(yaw)
        self.collided = self._touches(x, y)
        if self.collided:
            x, y = self.pose.xy
        self.odometer_m += float(np.hypot(x - self.pose.x_m, y - self.pose.y_m))
        self.pose = Pose2d(float(x), float(y), float(yaw))
        self.velocity = command
        cell = self.floor_plan.grid.cells(np.array([x, y]))
        self.entered_solid |= bool(self.floor_plan.solid[tuple(cell)])

    def _touches(self, x: float, y: float) -> bool:
        away = np.hypot(self.obstacles[:, 0] - x, self.obstacles[:, 1] - y)
        return bool((away < 0.2).any())

    def look(self) -> Bool:
        """Take one frame into the map; returns which cells were seen."""
        self.sequence += 1
        seen, blind, distance = self._in_sight()
        self.assumed &= ~seen
        self._assume(blind)
        gain = np.where(seen, 0.4 * np.exp(-(((distance - 1.5) / 1.5) ** 2) / 3), 0.0)
        self.confidence += gain
        self.since_reset += gain
        self.occupancy[seen] = np.where(
            self.floor_plan.solid[seen], Occupancy.OCCUPIED, Occupancy.FREE
        ).astype(np.uint8)
        return seen

    def _in_sight(self) -> tuple[Bool, I64, F64]:
        """Which cells are seen, those too near for it, and each one's distance; as the last time
        if the robot stands: the plan does not change."""
        if self._sight is not None and self._sight[0] == self.pose:
            return self._sight[1:]
        angles = self.pose.yaw_rad + np.linspace(-FOV_RAD / 2, FOV_RAD / 2, 160)
        ranges = np.arange(0.0, RANGE_M, CELL_M / 2)
        points = (
            np.asarray(self.pose.xy)
            + ranges[None, :, None]
            * np.stack([np.cos(angles), np.sin(angles)], axis=-1)[:, None, :]
        )
        cells = self.floor_plan.grid.cells(points)
        inside = self.floor_plan.grid.contains(cells)
        cells = np.clip(cells, 0, np.array(self.floor_plan.solid.shape) - 1)
        hit = self.floor_plan.solid[cells[..., 0], cells[..., 1]] | ~inside
        before: Bool = np.cumsum(hit, axis=1) - hit == 0  # up to and including the first hit
        visible = before & inside & ((ranges >= BLIND_M) | hit)
        seen = np.zeros(self.floor_plan.solid.shape, bool)
        seen[cells[visible][:, 0], cells[visible][:, 1]] = True
        blind = cells[before & inside & ~hit & (ranges < BLIND_M)]
        self._sight = self.pose, seen, blind, self._distance()
        return self._sight[1:]

    def _assume(self, blind: I64) -> None:
        """Take unseen floor for free: where the map begins, and from there to what is seen."""
        self.start_xy = self.start_xy or self.pose.xy
        if self.pose.distance_to(self.start_xy) > ASSUMED_M:
            return
        cells = np.zeros_like(self.assumed)
        cells[tuple(blind.T)] = True
        cells |= (self._distance() <= ASSUMED_M) & ~self.floor_plan.solid
        self.assumed |= cells & (self.occupancy == Occupancy.UNKNOWN)
        self.occupancy[self.assumed] = Occupancy.FREE

    def view(self, text: str, rivals: tuple[str, ...] = ()) -> SearchView:
        observed = self.confidence > 0
        best = [self.likeness.get(name, self.likeness[""]) for name in rivals]
        layers = (
            observed * Layer.OBSERVED
            + (self.confidence > 1.0) * Layer.EXPLORED
            + (self.since_reset > 1.0) * Layer.SEARCHED
            + self.assumed * Layer.ASSUMED
        )
        return SearchView(
            text=text,
            revision=self.sequence,
            sequence=self.sequence,
            stamp_ns=0,
            grid=self.floor_plan.grid,
            occupancy=self.occupancy.copy(),
            layers=layers.astype(np.uint8),
            similarity=np.where(
                observed, self.likeness.get(text, self.likeness[""]), np.nan
            ).astype(np.float32),
            rival=np.max(best, axis=0) if rivals else np.zeros((0, 0), np.float32),
        )

    def detect(self, text: str, seen: Bool) -> Detections:
        """A detection of the thing if enough of it was seen from near."""
        thing = self.floor_plan.things.get(text, np.zeros_like(seen))
        cells = np.argwhere(thing & seen & (self._distance() < DETECT_M))
        points = np.column_stack([self.floor_plan.grid.centres(cells), np.full(len(cells), 0.5)])
        found = detections_of({text: points.tolist()} if len(cells) else {}, score=0.9)
        return replace(found, sequence=self.sequence)

    def _distance(self) -> F64:
        away = self.centres - np.asarray(self.pose.xy)
        distance: F64 = np.hypot(away[..., 0], away[..., 1])
        return distance

    def _similarity(self, text: str) -> F32:
        thing = self.floor_plan.things.get(text)
        cells = np.moveaxis(np.indices(self.floor_plan.solid.shape), 0, -1)
        ripple = 0.04 * np.sin(cells[..., 0] * 0.7) * np.cos(cells[..., 1] * 0.9) + 0.06
        if thing is None:
            return np.asarray(ripple, np.float32)
        targets = np.argwhere(thing)
        nearest = np.full(self.floor_plan.solid.shape, np.inf)
        for target in targets:
            nearest = np.minimum(nearest, np.hypot(*(cells - target).transpose(2, 0, 1)))
        peak = 0.85 * np.exp(-((nearest * CELL_M / 0.35) ** 2))
        return np.asarray(np.maximum(ripple, peak), np.float32)


@dataclass
class SimulatedSearch:
    """One search in the world, stepped from outside."""

    world: GridWorld
    search: sm.Search
    config: PlannerConfig = field(default_factory=PlannerConfig)
    now_s: float = 0.0
    decision: Decision | None = None
    stale_reason: str = ""
    patience_from_s: float = float("-inf")
    reached: Pose2d | None = None
    refused: Pose2d | None = None
    places: MapPlaces = NOWHERE
    finds: tuple[KeptObject, ...] = ()
    offset_m: float = 0.0
    controls_per_step: int = CONTROLS_PER_STEP
    off_m: float = 1.5 * ARRIVE_M  # from the goal to where the robot stands for it
    trace: list[tuple[float, float]] = field(default_factory=list)
    reasons: list[str] = field(default_factory=list)
    targets_reset: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.state = PlannerState(self.search)

    def step(self) -> None:
        """One planning period: a frame, a planning step, then driving until the next."""
        target = self.state.search.target
        if target and [self.state.search.index] != self.targets_reset[-1:]:
            self.targets_reset.append(self.state.search.index)
            self.world.since_reset = np.zeros_like(self.world.since_reset)
        seen = self.world.look()
        params = self.config
        found_objects = self.state.found_objects if target else ()
        observation = Observation(
            now_s=self.now_s,
            pose=self.world.pose,
            odometer_m=self.world.odometer_m,
            command=self.world.wanted,
            collided=self.world.collided,
            view=self.world.view(
                target, rival_names(target, self.state.search.objects, found_objects)
            ),
            detections=(self.world.detect(target, seen),),
            stale_reason=self.stale_reason,
            patience_from_s=self.patience_from_s,
            reached=self.reached,
            refused=self.refused,
            places=self.places,
            finds=self.finds,
            offset_m=self.offset_m,
            anchor_views=tuple(map(self.world.view, self.state.search.detail.anchors)),
        )
        outcome = step(self.state, observation, params)
        self.state, self.decision = outcome.state, outcome.decision or self.decision
        if outcome.decision is not None:
            self._check_explained(outcome.decision)
        if not self.reasons or self.reasons[-1] != self.state.search.reason:
            self.reasons.append(self.state.search.reason)
        for _ in range(self.controls_per_step):
            self._control()

    def _check_explained(self, decision: Decision) -> None:
        """At every step the goal that is explained is the one at the end of the path."""
        search = self.state.search
        explained = search.choice.chosen_xy
        if isinstance(search.phase, sm.Confirming):
            assert sm.reason_of(search) == confirming(search.target)
        for end in planned_path(search, decision, 0).goal_m:
            assert explained is not None, search
            off_m = np.hypot(*np.subtract(explained, end))
            stands = isinstance(search.phase, sm.Confirming) or self.reached is not None
            assert off_m < (self.off_m if stands else 1e-3)
        assert explained is None or isinstance(
            search.phase, sm.Exploring | sm.Approaching | sm.Confirming | sm.Driving
        )

    def _control(self) -> None:
        params = self.config.drive
        command = wanted = STOP
        if self.decision is not None and not self.stale_reason and self.state.search.active:
            plan = Plan("", self.decision.motion, self.decision.costmap, self.now_s)
            tracker = PathTracker(params, STEP_S)
            wanted, checked = tracker.velocity(plan, self.world.pose, self.world.velocity)
            command = checked.velocity
        self.world.wanted = wanted
        self.world.drive(command, STEP_S)
        self.trace.append(self.world.pose.xy)
        self.now_s += STEP_S

    def until_over(self, limit_s: float) -> sm.Search:
        while self.state.search.active and self.now_s < limit_s:
            self.step()
        return self.state.search


def start(world: GridWorld, *objects: str, detail: Detail | None = None) -> SimulatedSearch:
    """A search for the objects, about to begin; detail: what is said of the only one."""
    stamp = sm.EventStamp(0.0, 0.0, world.pose.xy, world.odometer_m)
    search = sm.new_search("search-1", objects, stamp, started_ns=0)
    return SimulatedSearch(world, replace(search, details=(detail,) if detail else ()))


def start_drive(world: GridWorld, destination: sm.Destination) -> SimulatedSearch:
    """A drive to a place, about to begin."""
    stamp = sm.EventStamp(0.0, 0.0, world.pose.xy, world.odometer_m)
    return SimulatedSearch(world, sm.new_search("drive-1", (), stamp, 0, destination))


def in_plan(floor_plan: FloorPlan, x: float = 1.0, y: float = 1.0, yaw: float = 0.0) -> GridWorld:
    """A robot at (x, y), metres from the corner of the floor plan."""
    ox, oy = floor_plan.grid.bounds_m[:2]
    return GridWorld(floor_plan, Pose2d(ox + x, oy + y, yaw))


def in_four_rooms(x: float = 1.0, y: float = 1.0, yaw_rad: float = 0.0) -> GridWorld:
    """A robot at (x, y), metres from the corner of the floor plan."""
    return in_plan(four_rooms(), x, y, yaw_rad)


def in_two_rooms() -> GridWorld:
    """A robot in the room with the table."""
    return in_plan(two_rooms())


def in_one_room() -> GridWorld:
    """A robot in the room with the table and the bed."""
    return in_plan(one_room())
