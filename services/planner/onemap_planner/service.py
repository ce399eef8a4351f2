"""The planner on the bus: a loop takes inputs, controls and publishes; a thread plans."""

from __future__ import annotations

import logging
import math

from onemap_planner.config import PlannerConfig
from onemap_planner.inputs import (
    LatestInputs,
    with_members,
    with_odometry,
    with_revision,
    with_sent,
    with_start,
)
from onemap_planner.method import ONEMAP, PlanningMethod
from onemap_planner.motion.staleness import LoopMonitor, SentCommand
from onemap_planner.motion.velocity_controller import BRAKE_S, VelocityController
from onemap_planner.planning_thread import PlanningThread, ThreadInputs
from onemap_planner.recorder import RecordedStep, SearchRecorder
from onemap_planner.search import decision_log
from onemap_planner.search.state_machine import EventStamp, Search, status
from onemap_planner.searches import SearchCommands, SearchRegistry
from onemap_planner.sentences import (
    DRIVER_CHANGED,
    PLANNER_ENDED,
    PLANNER_STOPPED,
    interrupted,
)
from onemap_planner.warm_up import COMPILATION_S, warm_up
from onemap_shared import jit, keys
from onemap_shared.geometry import Velocity2d
from onemap_shared.messages import SearchState, SearchStatus, VelocityCommand
from onemap_shared.rates import RateMeter
from onemap_shared.runner import StartReport
from onemap_shared.transport import (
    Bus,
    Counters,
    Health,
    Worker,
)
from onemap_shared.watchdog import ThreadCheck

LOG = logging.getLogger("onemap.planner")

STATUS_PERIOD_S = 1.0
MAX_AWAY_S = 60.0  # a loop that stood still for longer: nobody expects the robot to drive on
IDLE_AGE_S = 5.0  # without a search, inputs older than this are reported as a problem


class Planner:
    """Implements ``transport.Worker``: takes odometry and map revisions, sends velocities."""

    def __init__(self, bus: Bus, config: PlannerConfig, method: PlanningMethod = ONEMAP) -> None:
        self._bus, self._config, self._clock = bus, config, bus.clock
        now_s = self._clock.monotonic_s()
        self._woken = self._clock.event()  # by odometry, or by a new plan
        self._odometry = bus.subscribe(keys.ROBOT_ODOMETRY, arrived=self._woken)
        self._beats = [bus.subscribe(keys.heartbeat(name)) for name in ("perception", "mapper")]
        self._commands = bus.publish(keys.ROBOT_CMD_VEL)
        self._states = bus.publish(keys.SEARCH_STATE)
        # Both at the last control step.
        self._suspended_s, self._stepped_s = self._clock.suspended_s(), now_s
        self._registry = SearchRegistry(bus.clock)
        self._inputs = LatestInputs(loop=LoopMonitor(bus.instance))
        self._controller = VelocityController()
        self._sent = self._refused = 0
        self._recorder = SearchRecorder(config.state_dir, bus.clock)
        self._trail = decision_log.Trail()
        self._control_rate = RateMeter()
        self._next_control_s = self._next_status_s = now_s
        self._published: tuple[object, ...] = ()
        self._planning_thread = PlanningThread(
            bus,
            self._registry,
            self._config,
            now=self._thread_inputs,
            planned=self._woken.set,
            method=method,
        )
        map_changed = self._planning_thread.map_changed
        self._revisions = bus.subscribe(keys.MAP_REVISION, arrived=map_changed)
        self._controlled = self._planning_thread.result  # by the last control step
        self._check_planning = ThreadCheck("the planning thread")
        self._whole_steps = True  # the last step did not raise
        self._before = self._interrupted_before()
        SearchCommands(
            bus,
            self._registry,
            inputs=lambda: self._inputs,
            status_of=self._status,
            folder=config.state_dir,
        )

    def _interrupted_before(self) -> SearchStatus | None:
        """The newest search of before the start, if that has interrupted it."""
        folder = self._config.state_dir
        newest = decision_log.past(folder)[:1] if folder is not None else []
        return next((each for each in newest if each.state is SearchState.INTERRUPTED), None)

    def step(self, timeout_s: float) -> None:
        """Take inputs until the next command is due, then send it."""
        self._whole_steps = False
        if not self._planning_thread.alive:
            raise RuntimeError("the planning thread died")
        self._check_planning(self._planning_thread.turns, self._clock.monotonic_s())
        wait_s = min(timeout_s, max(self._next_control_s - self._clock.monotonic_s(), 0.0))
        self._woken.wait(wait_s)
        self._woken.clear()  # before it is looked at what came
        odometry = self._odometry.take(0.0)
        now_s = self._clock.monotonic_s()
        if odometry is not None:
            self._inputs = with_odometry(self._inputs, odometry, now_s)
        revision = self._revisions.take(0.0)
        if revision is not None:
            before = self._inputs
            self._inputs = with_revision(before, revision, now_s)
            if self._inputs.map_count > before.map_count:
                self._registry.clear_found_objects()
            if self._inputs.exchange_count > before.exchange_count:
                self._planning_thread.forget_finds()
                self._registry.replace_map(self._stamp())
        new_plan = self._planning_thread.result.plan is not self._controlled.plan
        if new_plan or now_s >= self._next_control_s:
            period_s = 1.0 / self._config.control_hz  # also after a new plan, which came early
            due_s = min(self._next_control_s, now_s) + period_s
            self._next_control_s = max(due_s, now_s)
            self._control_rate = self._control_rate.with_event(now_s)
            self._inputs = with_members(self._inputs, self._bus.members(), now_s)
            for beats in self._beats:
                if (beat := beats.take(0.0)) is not None and beat.starting:
                    self._inputs = with_start(self._inputs, beat, now_s)
            self._end_after_pause(now_s)
            self._end_with_driver()
            self._control(now_s)
            self._publish_status(now_s)
            self._log_refused()
        self._whole_steps = True

    def health(self) -> Health:
        """Readiness and the metrics of planning and control; not ready while inputs are stale."""
        now_s = self._clock.monotonic_s()
        age = self._inputs.ages(now_s)
        state = self._registry.state
        problem = ""
        if state is not None and state.search.active:
            problem = self._waiting(now_s)
        elif max(age.odometry_s, age.map_s) > IDLE_AGE_S:
            problem = self._inputs.stale_reason(now_s, self._config.staleness)
        result = self._planning_thread.result
        view_age_s = math.inf if result.view_at_s is None else now_s - result.view_at_s
        metrics = {
            "plan_ms": result.plan_ms,
            "view_age_s": view_age_s,
            "odometry_age_s": age.odometry_s,
            "map_age_s": age.map_s,
            "map_lag_s": age.map_lag_s,
            "loop_s": self._inputs.loop.loop_s(now_s),
            "odometry_delay_s": self._inputs.delay.excess_s,
            "goals": float(result.goals),
            "stops_on_stale": float(self._controller.stops),
            "monitor_slowdowns": float(self._controller.monitor.slowdowns),
            "monitor_stops": float(self._controller.monitor.stops),
            "control_hz": self._control_rate.rate_hz(now_s),
            **self._planning_thread.view_counts,
        }
        for stream, counters in self._counters().items():
            metrics[f"{stream}_refused"] = float(counters.refused)
        known = {name: value for name, value in metrics.items() if math.isfinite(value)}
        return Health(ready=not problem, problem=problem, metrics=known)

    def close(self) -> None:
        """Stop the robot first, if it may be moving; then end the search, and the threads."""
        active_s = self._clock.monotonic_s() - self._controller.active_s
        if active_s <= BRAKE_S:
            self._send(Velocity2d())
        crashed = not (self._whole_steps and self._planning_thread.alive)
        self._interrupt(PLANNER_ENDED if crashed else PLANNER_STOPPED)
        self._publish_status(self._clock.monotonic_s())
        self._planning_thread.close()
        if active_s <= BRAKE_S:
            self._send(Velocity2d())
        self._recorder.close()

    def _end_after_pause(self, now_s: float) -> None:
        """End the search of a process, or a computer, that stood still: nobody expects it to move.

        The monotonic clock does not count while a computer is suspended.
        """
        slept_s = self._suspended_s
        self._suspended_s = self._clock.suspended_s()
        away_s = self._suspended_s - slept_s + now_s - self._stepped_s
        self._stepped_s = now_s
        if away_s > MAX_AWAY_S:
            self._interrupt(f"the planner stood still for {away_s:.0f} s")

    def _end_with_driver(self) -> None:
        """End a search that was accepted for another driver than the one that is there now."""
        state = self._registry.state
        if state is not None and self._inputs.driver.count > state.search.driver:
            self._interrupt(DRIVER_CHANGED)

    def _stamp(self) -> EventStamp:
        xy = self._inputs.pose.xy if self._inputs.pose else None
        return EventStamp(self._clock.monotonic_s(), 0.0, xy, self._inputs.odometer_m)

    def _interrupt(self, why: str) -> None:
        """End the active search, if there is one: somebody has to ask again."""
        state = self._registry.state
        if state is None or not state.search.active:
            return
        search, at_ns = state.search, self._clock.wall_ns()
        reason = interrupted(why, at_ns, search.results)
        self._registry.interrupt(reason, self._stamp(), at_ns)
        LOG.warning("search %s for %s is interrupted: %s", search.search_id, search.subject, why)

    def _control(self, now_s: float) -> None:
        state = self._registry.state
        search_id = state.search.search_id if state is not None and state.search.active else ""
        result = self._controlled = self._planning_thread.result
        frame_ns = result.plan.frame_ns if result.plan is not None else 0
        limits = self._config.staleness
        inputs = self._inputs.for_controller(search_id, now_s, limits, frame_ns)
        self._controller, send = self._controller.update(
            result.plan,
            inputs,
            self._config.drive,
            max_plan_age_s=limits.max_plan_age_s,
        )
        if send:
            self._send(self._controller.command, self._controller.frame_ns)

    def _thread_inputs(self) -> ThreadInputs:
        controller = self._controller
        creeps = controller.creeps(self._config.drive)
        return ThreadInputs(self._inputs, controller.wanted, controller.blocked, creeps)

    def _send(self, velocity: Velocity2d, frame_ns: int = 0) -> None:
        self._sent += 1
        odometry = self._inputs.odometry
        command = VelocityCommand(
            self._sent,
            self._clock.wall_ns(),
            velocity.linear_mps,
            velocity.angular_radps,
            planner=self._bus.instance,
            odometry_stamp_ns=odometry.stamp_ns if odometry else 0,
            frame_ns=frame_ns,
            lateral_mps=velocity.lateral_mps,
            driver=self._inputs.driver.named,
            validity_ms=round(1e3 * self._controller.validity_s),
        )
        sent = SentCommand(self._sent, self._clock.monotonic_s(), self._controller.velocity)
        self._inputs = with_sent(self._inputs, sent)
        self._commands.put(command)

    def _publish_status(self, now_s: float) -> None:
        """Publish the state of the search on every change and every ``STATUS_PERIOD_S``.

        Before the first one, that of before: a gateway may have found the router later than this.
        """
        state = self._registry.state
        if state is None:
            if self._before is not None and now_s >= self._next_status_s:
                self._next_status_s = now_s + STATUS_PERIOD_S
                self._states.put(self._before)
            return
        search, waiting = state.search, self._waiting(now_s)
        self._follow(search)
        shown = (
            *(search.search_id, search.index, search.reason, search.choice.number),
            bool(waiting),
            search.choice.chosen_xy,
            search.slow,
            search.passed,
        )
        if shown == self._published and now_s < self._next_status_s:
            return
        if shown[:3] != self._published[:3]:
            LOG.info("search %s: %s", search.search_id, search.reason)
        if shown[:4] != self._published[:4]:  # not each time that it waits for a late map
            self._record_step(search)
        self._published, self._next_status_s = shown, now_s + STATUS_PERIOD_S
        self._states.put(self._status(search))

    def _status(self, search: Search) -> SearchStatus:
        return status(
            search,
            self._stamp(),
            now_ns=self._clock.wall_ns(),
            waiting=self._waiting(self._clock.monotonic_s()),
            hold=self._inputs.hold,
        )

    def _waiting(self, now_s: float) -> str:
        """Why the robot waits; empty if it does not."""
        stale_reason = self._inputs.stale_reason(now_s, self._config.staleness)
        return stale_reason or self._planning_thread.result.stale_reason

    def _counters(self) -> dict[str, Counters]:
        """Counters of the messages of each stream."""
        return {
            "odometry": self._odometry.counters,
            "revision": self._revisions.counters,
            "detections": self._planning_thread.detection_counters,
        }

    def _log_refused(self) -> None:
        """Log messages that could not be decoded; they are dropped."""
        counters = self._counters().values()
        refused = sum(counter.refused for counter in counters)
        if refused > self._refused:
            reasons = {counter.last_problem for counter in counters if counter.last_problem}
            LOG.warning("refused %d messages: %s", refused - self._refused, "; ".join(reasons))
            self._refused = refused

    def _follow(self, search: Search) -> None:
        """Keep where the robot is, for the record of an active search."""
        if search.active and self._inputs.pose is not None:
            elapsed_s = self._clock.monotonic_s() - search.began_s
            self._trail.add(elapsed_s, self._inputs.pose.xy)

    def _record_step(self, search: Search) -> None:
        pose = self._inputs.pose
        step = status(search, self._stamp(), now_ns=self._clock.wall_ns())
        self._recorder.add(RecordedStep(step, pose.xy if pose else None, self._trail.take()))


def build(bus: Bus, config: PlannerConfig, start: StartReport | None = None) -> Worker:
    """The planner's worker on this bus; ``start`` says there what takes long until it is there."""
    start = start or StartReport("planner", bus.clock)
    with jit.announced(start.takes, COMPILATION_S, LOG.info):
        warm_up()
    return Planner(bus, config)
