"""Planning thread: requests a view of the map, runs a planning step, publishes its plan
and sends what was found to the mapper.

The map may answer slowly or not at all; the control loop reads ``result`` and never waits.
"""
# Talks: the thread that plans while the loop steers, and calls the mapper.

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from onemap_planner.config import PlannerConfig
from onemap_planner.followed_places import FollowedFinds, FollowedPlaces
from onemap_planner.inputs import LatestInputs
from onemap_planner.method import ONEMAP, PlanningMethod
from onemap_planner.motion.motions import Drive, Rest, Reverse, Rotate
from onemap_planner.motion.staleness import view_problem
from onemap_planner.motion.velocity_controller import Plan
from onemap_planner.policy.goals import NO_AREAS, GoalKind
from onemap_planner.policy.names import view_request
from onemap_planner.policy.outcome import Decision, Observation
from onemap_planner.policy.state import PlannerState
from onemap_planner.search import state_machine as sm
from onemap_planner.searches import SearchRegistry
from onemap_planner.sentences import waiting_for
from onemap_planner.world.map_view import (
    AssembledView,
    ChangesDoNotFit,
    PlanningView,
    outside_reason,
    with_changes,
)
from onemap_shared import keys
from onemap_shared.geometry import F32, F64, Velocity2d
from onemap_shared.messages import (
    NO_VIEW,
    Detections,
    FailureCode,
    ObjectFind,
    PlannedPath,
    SearchState,
    SearchViewRequest,
    ViewChangesRequest,
    ViewKey,
)
from onemap_shared.transport import Bus, CallError, Counters, NoReply, QueryTimeout, RemoteError

KEPT_VIEWS = 8  # of the present object and its anchors


class ViewRequests:
    """Views by what was asked for; of one thread."""

    def __init__(self, bus: Bus, timeout_s: float) -> None:
        self._bus, self._timeout_s = bus, timeout_s
        self.whole = self.changed = 0  # views that came as a whole, and as what changed
        self._kept: dict[SearchViewRequest, AssembledView] = {}  # the newest last

    def view(self, request: SearchViewRequest) -> PlanningView:
        """The newest view. Raises ``CallError``.

        A lost reply costs nothing: the next request names the same view as the last one. A mapper
        of an earlier release, which serves no changes, sends the whole view. One that served them
        in this search is only away: while it comes back, its procedures appear one by one.
        """
        try:
            return self._updated(request)
        except NoReply:
            if self._kept:
                raise
            view = self._bus.call(keys.MAP_SEARCH_VIEW, request, self._timeout_s)
            self.whole += 1
            return view

    def _updated(self, request: SearchViewRequest) -> AssembledView:
        kept = self._kept.get(request)
        try:
            made = self._asked(request, kept)
        except ChangesDoNotFit:
            made = self._asked(request, None)
        self._kept.pop(request, None)
        self._kept[request] = made
        while len(self._kept) > KEPT_VIEWS:
            del self._kept[next(iter(self._kept))]
        return made

    def forget(self) -> None:
        """Free the memory of all views, 14 bytes for each cell."""
        self._kept.clear()

    def _asked(self, request: SearchViewRequest, kept: AssembledView | None) -> AssembledView:
        have: ViewKey = NO_VIEW if kept is None else kept.key
        also = request.negatives, request.colour
        question = ViewChangesRequest(request.text, request.rivals, have, *also)
        changes = self._bus.call(keys.MAP_VIEW_CHANGES, question, self._timeout_s)
        try:
            made = with_changes(kept, changes)
        except ChangesDoNotFit as problem:
            if kept is not None:
                raise
            said = f"{problem}, though the whole was asked for"
            raise RemoteError("internal", said) from problem
        self.whole += changes.base == NO_VIEW
        self.changed += changes.base != NO_VIEW
        return made


LOG = logging.getLogger("onemap.planner")

MAX_UNSENT = 20  # finds of one search; the oldest is dropped
CALL_TIMEOUT_S = 1.0  # the mapper writes a file of some MB before it answers


class FindOutbox:
    """Finds that the mapper has not acknowledged, oldest first. Any thread may use it."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._lock = bus.clock.lock()
        self._unsent: deque[ObjectFind] = deque(maxlen=MAX_UNSENT)
        self._refused: ObjectFind | None = None  # the last, so that it is logged once

    def add(self, finds: Iterable[ObjectFind]) -> None:
        """Take finds to send."""
        with self._lock:
            self._unsent.extend(finds)

    def clear(self) -> None:
        """Drop all finds: the map that they were found on is gone."""
        with self._lock:
            self._unsent.clear()

    def send(self) -> None:
        """Send what there is; ends at the first find that the mapper does not acknowledge.

        A find that the mapper refuses as invalid is dropped: it would be refused again.
        """
        while (find := self._oldest()) is not None:
            try:
                self._bus.call(keys.MAP_REMEMBER, find, CALL_TIMEOUT_S)
            except RemoteError as problem:
                if find is not self._refused:
                    LOG.error("the map does not keep %s: %s", find.name, problem)
                self._refused = find
                if problem.code != "invalid":
                    return
            except CallError:
                return  # the mapper is away; tried again in the next period
            self._remove(find)

    def _oldest(self) -> ObjectFind | None:
        with self._lock:
            return self._unsent[0] if self._unsent else None

    def _remove(self, find: ObjectFind) -> None:
        with self._lock:
            if self._unsent and self._unsent[0] is find:
                self._unsent.popleft()


NO_GOAL = "none"
MOTIONS = {Drive: "drive", Rotate: "rotate", Reverse: "reverse", Rest: "rest"}  # in messages


def planned_path(search: sm.Search, decision: Decision | None, stamp_ns: int) -> PlannedPath:
    """The message of a decision; empty without one, or when the search is over."""
    if not search.active:
        decision = None
    motion, goal = (decision.motion, decision.goal) if decision else (None, None)
    offered = decision.areas if decision else NO_AREAS
    kind = NO_GOAL
    look: tuple[float, ...] = ()
    points = np.zeros((0, 2))
    if isinstance(motion, Drive):  # else the robot rests, rotates or backs up
        points, look = motion.points_xy, motion.look_xy
        if isinstance(search.phase, sm.Approaching | sm.Confirming):
            kind = str(GoalKind.DETECTION)
        elif goal is not None and isinstance(search.phase, sm.Exploring | sm.Driving):
            phase = search.phase
            kind = str(phase.destination.kind if isinstance(phase, sm.Driving) else goal.kind)
    return PlannedPath(
        stamp_ns=stamp_ns,
        goal_kind=kind,
        goal_reason=sm.reason_of(search),
        points_m=points.astype(np.float32),
        goal_m=(points[-1:] if kind != NO_GOAL else points[:0]).astype(np.float32),
        frontiers_m=_stack([frontier.beyond_xy for frontier in offered.frontiers]),
        frontier_scores=np.array([f.score for f in offered.frontiers], np.float32),
        regions_m=_stack([region.peak_xy for region in offered.regions]),
        region_scores=np.array([region.score for region in offered.regions], np.float32),
        motion=MOTIONS[type(motion)] if motion is not None else "",
        look_m=tuple(map(float, look)),
    )


def _stack(places: list[F64]) -> F32:
    return np.array(places, dtype=np.float32).reshape(-1, 2)


# By which a plan begins earlier or later than its period says if the map changes then: it rests on
# a frame that has just come. At 8 Hz and more one always does; slower ones fall into step.
EARLIER_S, LATER_S = 0.07, 0.06
VIEW_TIMEOUT_S = 1.0  # a view of a large flat takes under 0.1 s
COLLISION_MEMORY_S = 0.3  # one planning period, so that no report in between is missed
# A second request would fail too.
PERMANENT_ERRORS = {"invalid": FailureCode.MAP_REFUSED, "unknown_word": FailureCode.UNKNOWN_WORD}


@dataclass(frozen=True, slots=True)
class PlanningResult:
    """The newest result of planning.

    stale_reason: why there is no view of the map, empty if there is one; view_at_s: when the
    last view was used, None before the first; goals: number of frontiers and regions.
    """

    plan: Plan | None = None
    stale_reason: str = ""
    plan_ms: float = 0.0
    view_at_s: float | None = None
    goals: int = 0


@dataclass(frozen=True, slots=True)
class ThreadInputs:
    """What the control loop provides: the latest inputs, and the velocity that it wants.

    blocked: the costmap does not allow this velocity; creeps: only that over unseen floor.
    """

    inputs: LatestInputs
    command: Velocity2d
    blocked: bool
    creeps: bool


class PlanningThread:
    """Plans at ``plan_hz``; ``result`` is replaced as a whole, so any thread may read it.

    planned: called after each new plan. map_changed: to be set at each change of the map.
    """

    def __init__(
        self,
        bus: Bus,
        registry: SearchRegistry,
        config: PlannerConfig,
        *,
        now: Callable[[], ThreadInputs],
        planned: Callable[[], None] = lambda: None,
        method: PlanningMethod = ONEMAP,
    ) -> None:
        self._bus, self._registry, self._params, self._now = bus, registry, config, now
        self._method = method
        self._clock = bus.clock
        self._period_s, self._planned = 1.0 / config.plan_hz, planned
        self.map_changed = bus.clock.event()
        self._detections = bus.subscribe(keys.DETECTIONS, capacity=8)
        self._paths = bus.publish(keys.SEARCH_PATH)
        self._views = ViewRequests(bus, VIEW_TIMEOUT_S)
        self._places, self._kept = FollowedPlaces(bus), FollowedFinds(bus)
        self._finds = FindOutbox(bus)
        self._reset_target: tuple[str, int] | None = None
        self.result = PlanningResult()
        self.turns = 0  # of the thread, also without a search
        self._stop = bus.clock.event()
        self._thread = bus.clock.thread("planning", self._run)

    @property
    def alive(self) -> bool:
        """Whether the thread still runs."""
        return self._thread.is_alive()

    @property
    def detection_counters(self) -> Counters:
        """Counters of the detections."""
        return self._detections.counters

    @property
    def view_counts(self) -> dict[str, float]:
        """Views that came as a whole and as what changed, for the heartbeat."""
        whole, changed = float(self._views.whole), float(self._views.changed)
        return {"views_whole": whole, "views_changed": changed}

    def forget_finds(self) -> None:
        """Drop the finds that the mapper has not acknowledged, because the map is another one."""
        self._finds.clear()

    def close(self) -> None:
        """Stop the thread, without waiting for a call to the map."""
        self._stop.set()
        self._thread.join(timeout=2 * VIEW_TIMEOUT_S)

    def _run(self) -> None:
        while not self._stop.is_set():
            began_s = self._clock.monotonic_s()
            state = self._registry.state
            if state is None or not state.search.active:
                self._detections.take(0.0)
                self.result = PlanningResult()
                self._views.forget()
                self._finds.send()
            else:
                self._plan(state)
            self.turns += 1
            due_s = began_s + self._period_s
            self._stop.wait(max(due_s - EARLIER_S - self._clock.monotonic_s(), 0.0))
            self.map_changed.clear()
            latest_s = due_s + LATER_S
            self.map_changed.wait(max(latest_s - self._clock.monotonic_s(), 0.0))

    def _plan(self, state: PlannerState) -> None:
        """One planning step on a new view of the map."""
        asked_s = self._clock.monotonic_s()  # what the view shows is no newer than its request
        view: PlanningView | None = None
        anchor_views: tuple[PlanningView, ...] = ()
        stale_reason = ""
        try:
            anchors = state.search.detail.anchors
            anchor_views = tuple(self._views.view(SearchViewRequest(name)) for name in anchors)
            view = self._request_view(state)  # the last, since the robot drives on it
        except RemoteError as problem:
            if problem.code in PERMANENT_ERRORS:
                self._fail_target(state, str(problem), PERMANENT_ERRORS[problem.code])
                return
            stale_reason = waiting_for("the map", str(problem))
        except QueryTimeout:
            stale_reason = waiting_for("the map", f"no answer within {VIEW_TIMEOUT_S:g} s")
        except CallError:
            stale_reason = waiting_for("the mapper", "it is not running")
        if view is not None:
            stale_reason = self._places.follow(self._now().inputs, state.search, view.revision)
            self._kept.follow(self._now().inputs, state.search)
        now, now_s = self._now(), self._clock.monotonic_s()
        if view is not None:
            stale_reason = stale_reason or self._unusable(view, now.inputs, now_s)
        if stale_reason:
            stale_reason = now.inputs.starts(now_s) or stale_reason
            view = None
        observation = Observation(
            now_s=now_s,
            pose=now.inputs.pose,
            odometer_m=now.inputs.odometer_m,
            command=now.command,
            collided=now_s - now.inputs.collided_s <= COLLISION_MEMORY_S,
            view=view,
            detections=self._new_detections(),
            stale_reason=stale_reason or now.inputs.stale_reason(now_s, self._params.staleness),
            blocked=now.blocked,
            creeps=now.creeps,
            patience_from_s=now.inputs.patience_from_s(now_s),
            camera=now.inputs.camera,
            reached=now.inputs.reached,
            refused=now.inputs.refused,
            anchor_views=anchor_views,
            places=self._places.known,
            finds=self._kept.known,
            offset_m=now.inputs.offset_m,
            pose_ns=now.inputs.odometry.stamp_ns if now.inputs.odometry else 0,
        )
        outcome = self._method.step(state, observation, self._params)
        next_state, decision = outcome.state, outcome.decision
        plan_ms = (self._clock.monotonic_s() - now_s) * 1e3
        if not self._registry.compare_and_swap(state, next_state):
            return
        result = replace(self.result, stale_reason=stale_reason, plan_ms=plan_ms)
        frame_ns = view.stamp_ns if view is not None else 0
        self._publish(next_state, decision, result, asked_s=asked_s, frame_ns=frame_ns)
        if view is not None:  # without one the mapper would not answer this call either
            self._finds.send()

    def _unusable(self, view: PlanningView, inputs: LatestInputs, now_s: float) -> str:
        """Why nothing is planned on this view, which may have come late; empty if it can be."""
        outside = outside_reason(view, inputs.pose.xy) if inputs.pose is not None else ""
        return outside or view_problem(inputs.ages(now_s, view.stamp_ns), self._params.staleness)

    def _publish(
        self,
        state: PlannerState,
        decision: Decision | None,
        result: PlanningResult,
        *,
        asked_s: float,
        frame_ns: int,
    ) -> None:
        """Replace the result and publish the path; without a decision the old plan ages.

        A plan that was overtaken by a change of the places is none.
        """
        if decision is not None and self._places.version == self._now().inputs.places_version:
            search_id, motion, costmap = state.search.search_id, decision.motion, decision.costmap
            offered, version = decision.areas, self._places.version
            result = replace(
                result,
                plan=Plan(search_id, motion, costmap, asked_s, version, frame_ns),
                view_at_s=self._clock.monotonic_s(),
                goals=len(offered.frontiers) + len(offered.regions),
            )
            self._paths.put(planned_path(state.search, decision, self._clock.wall_ns()))
            self._finds.add(decision.finds)
        self.result = result
        self._planned()

    def _request_view(self, state: PlannerState) -> PlanningView:
        """The view for the present object; a new object first resets the searched layer.

        A drive to a place needs neither a similarity nor the searched layer.
        """
        search = state.search
        if (
            search.target
            and isinstance(search.phase, sm.Starting)
            and self._reset_target != _target_key(search)
        ):
            self._method.begin(self._bus, search)
            self._reset_target = _target_key(search)
        view = self._views.view(view_request(state))
        return self._method.seen(view) if search.target else view

    def _fail_target(self, state: PlannerState, reason: str, code: FailureCode) -> None:
        """End the search for the present object: the map cannot answer for its name."""
        inputs = self._now().inputs
        xy = inputs.pose.xy if inputs.pose else None
        stamp = sm.EventStamp(self._clock.monotonic_s(), state.active_time_s, xy, inputs.odometer_m)
        next_state = state.copy()
        next_state.apply(sm.Ending(SearchState.FAILED, reason, code), stamp)
        self._registry.compare_and_swap(state, next_state)

    def _new_detections(self) -> tuple[Detections, ...]:
        taken = []
        while (message := self._detections.take(0.0)) is not None:
            taken.append(message)
        return tuple(taken)


def _target_key(search: sm.Search) -> tuple[str, int]:
    return search.search_id, search.index
