"""The planner on the bus: a loop takes inputs, controls and publishes; a thread plans."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from onemap_planner.config import PlannerConfig
from onemap_planner.inputs import (
    LatestInputs,
    with_members,
    with_odometry,
    with_revision,
    with_sent,
    with_start,
)
from onemap_planner.motion.staleness import LoopMonitor, SentCommand
from onemap_planner.motion.velocity_controller import VelocityController
from onemap_planner.planning_thread import PlanningThread, ThreadInputs
from onemap_planner.search import decision_log, journal
from onemap_planner.search.journal import (
    MAX_AWAY_S,
    Surroundings,
    interrupted_reason,
    interruption,
)
from onemap_planner.search.state_machine import EventStamp, Search, status
from onemap_planner.searches import SearchCommands, SearchRegistry
from onemap_shared import keys
from onemap_shared.geometry import Velocity2d
from onemap_shared.messages import SearchStatus, VelocityCommand
from onemap_shared.rates import RateMeter
from onemap_shared.runner import is_starting
from onemap_shared.services import DRIVER, role_of
from onemap_shared.transport import (
    Bus,
    Counters,
    Health,
    Worker,
)
from onemap_shared.watchdog import ThreadCheck

LOG = logging.getLogger("onemap.planner")

STATUS_PERIOD_S = 1.0
HELD = "the planner was restarted and makes sure that nothing else was"
# Seconds since the computer's start; those in suspend count, where the system tells them.
BOOT_CLOCK = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)
BOOT_ID = Path("/proc/sys/kernel/random/boot_id")  # of Linux; elsewhere no search goes on
IDLE_AGE_S = 5.0  # without a search, inputs older than this are reported as a problem


class Planner:
    """Implements ``transport.Worker``: takes odometry and map revisions, sends velocities."""

    def __init__(self, bus: Bus, config: PlannerConfig) -> None:
        now_s = time.monotonic()
        self._bus, self._config = bus, config
        self._woken = threading.Event()  # by odometry, or by a new plan
        self._odometry = bus.subscribe(keys.ROBOT_ODOMETRY, arrived=self._woken)
        self._beats = [bus.subscribe(keys.heartbeat(name)) for name in ("perception", "mapper")]
        self._commands = bus.publish(keys.ROBOT_CMD_VEL)
        self._states = bus.publish(keys.SEARCH_STATE)
        self._boot_id = BOOT_ID.read_text().strip() if BOOT_ID.exists() else ""
        self._awake_s = time.clock_gettime(BOOT_CLOCK)  # of the last control step
        self._recorded = _recorded(config, now_s)  # until it is known whether its search goes on
        self._registry = SearchRegistry(self._recorded.search if self._recorded else None)
        held = HELD if self._recorded else ""
        self._inputs = LatestInputs(loop=LoopMonitor(bus.instance), held=held)
        self._controller = VelocityController()
        self._sent = self._refused = 0
        self._reported: set[str] = set()
        self._trail = decision_log.Trail()
        self._control_rate = RateMeter()
        self._next_control_s = self._next_status_s = now_s
        self._published: tuple[object, ...] = ()
        self._planning_thread = PlanningThread(
            bus,
            self._registry,
            self._config,
            period_s=1.0 / config.plan_hz,
            now=self._thread_inputs,
            planned=self._woken.set,
        )
        map_changed = self._planning_thread.map_changed
        self._revisions = bus.subscribe(keys.MAP_REVISION, arrived=map_changed)
        self._controlled = self._planning_thread.result  # by the last control step
        self._check_planning = ThreadCheck("the planning thread")
        self._whole_steps = True  # the last step did not raise
        self._decide()
        SearchCommands(
            bus,
            self._registry,
            inputs=lambda: self._inputs,
            status_of=self._status,
            folder=config.state_dir,
        )

    def step(self, timeout_s: float) -> None:
        """Take inputs until the next command is due, then send it."""
        self._whole_steps = False
        if not self._planning_thread.alive:
            raise RuntimeError("the planning thread died")
        self._check_planning(self._planning_thread.turns, time.monotonic())
        wait_s = min(timeout_s, max(self._next_control_s - time.monotonic(), 0.0))
        self._woken.wait(wait_s)
        self._woken.clear()  # before it is looked at what came
        odometry = self._odometry.take(0.0)
        now_s = time.monotonic()
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
        new_plan = self._planning_thread.result.plan is not self._controlled.plan
        if new_plan or now_s >= self._next_control_s:
            self._next_control_s = max(self._next_control_s + 1.0 / self._config.control_hz, now_s)
            self._control_rate = self._control_rate.with_event(now_s)
            self._inputs = with_members(self._inputs, self._bus.members(), now_s)
            for beats in self._beats:
                if (beat := beats.take(0.0)) is not None and is_starting(beat):
                    self._inputs = with_start(self._inputs, beat, now_s)
            self._end_after_suspend()
            self._decide()
            self._control(now_s)
            self._publish_status(now_s)
            self._log_refused()
        self._whole_steps = True

    def health(self) -> Health:
        """Readiness and the metrics of planning and control; not ready while inputs are stale."""
        now_s = time.monotonic()
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
        """Stop the planning thread and, if the robot may be moving, the robot.

        Who stops a planner ends its search; one that crashed may go on with it.
        """
        told = self._whole_steps and self._planning_thread.alive
        self._planning_thread.close()
        state = self._registry.state
        if state is not None and state.search.active:
            self._send(Velocity2d())
            self._write_journal(state.search, time.monotonic())
            if told and self._recorded is None:
                why, at_ns = "the planner was stopped", time.time_ns()
                self._interrupt(state.search, why, self._stamp(), at_ns)
                self._publish_status(time.monotonic())

    def _end_after_suspend(self) -> None:
        """End the search of a process, or a computer, that stood still: it goes on unasked."""
        awake_s, state = self._awake_s, self._registry.state
        self._awake_s = time.clock_gettime(BOOT_CLOCK)
        away_s = self._awake_s - awake_s
        if away_s > MAX_AWAY_S and state is not None and state.search.active:
            why = f"the planner was suspended for {away_s:.0f} s"
            self._interrupt(state.search, why, self._stamp(), time.time_ns())

    def _stamp(self) -> EventStamp:
        xy = self._inputs.pose.xy if self._inputs.pose else None
        return EventStamp(time.monotonic(), 0.0, xy, self._inputs.odometer_m)

    def _decide(self) -> None:
        """End the search of before the restart, or let it go on, once it is known which."""
        recorded, state = self._recorded, self._registry.state
        if recorded is None or state is None:
            return
        if state.search.active and state.search.search_id == recorded.search.search_id:
            now = self._surroundings()
            why = recorded.interrupted or interruption(recorded.around, now)
            if not why and not now.known:
                return
            if why:
                stamp = EventStamp(recorded.loaded_s, 0.0, recorded.around.xy_m, 0.0)
                self._interrupt(recorded.search, why, stamp, recorded.written_ns)
            else:
                LOG.info("search %s goes on for %s", state.search.search_id, state.search.subject)
        self._recorded = None
        self._inputs = replace(self._inputs, held="")

    def _interrupt(self, search: Search, why: str, stamp: EventStamp, at_ns: int) -> None:
        """End the active search where it cannot or should not go on, on disk too."""
        self._registry.interrupt(interrupted_reason(search, why, at_ns), stamp, at_ns)
        LOG.warning("search %s for %s is interrupted: %s", search.search_id, search.subject, why)
        if self._config.state_dir is not None:
            with self._reporting(self._config.state_dir):
                journal.mark_interrupted(self._config.state_dir, why)

    def _surroundings(self) -> Surroundings:
        """What the search rests on now; beside another planner the robot counts as not known."""
        others = self._bus.members() - {("planner", self._bus.instance)}
        robots = [" ".join(each) for each in others if role_of(each[0]) == DRIVER]
        sole = len(robots) == 1 and not any(service == "planner" for service, _ in others)
        inputs = self._inputs
        return Surroundings(
            namespace=self._bus.namespace,
            boot_id=self._boot_id,
            boot_s=time.clock_gettime(BOOT_CLOCK),
            robot=robots[0] if sole else "",
            map_id=self._planning_thread.map_id,
            odometry=inputs.odometry.sequence if inputs.odometry else -1,
            xy_m=inputs.pose.xy if inputs.pose else None,
        )

    def _control(self, now_s: float) -> None:
        state = self._registry.state
        search_id = state.search.search_id if state is not None and state.search.active else ""
        inputs = self._inputs.for_controller(search_id, now_s, self._config.staleness)
        result = self._controlled = self._planning_thread.result
        self._controller, send = self._controller.update(
            result.plan,
            inputs,
            self._config.drive,
            max_plan_age_s=self._config.staleness.max_plan_age_s,
        )
        if send:
            frame_ns = result.frame_ns if inputs.may_move else 0
            self._send(self._controller.command, frame_ns)

    def _thread_inputs(self) -> ThreadInputs:
        controller = self._controller
        creeps = controller.creeps(self._config.drive)
        return ThreadInputs(self._inputs, controller.wanted, controller.blocked, creeps)

    def _send(self, velocity: Velocity2d, frame_ns: int = 0) -> None:
        self._sent += 1
        odometry = self._inputs.odometry
        command = VelocityCommand(
            self._sent,
            time.time_ns(),
            velocity.linear_mps,
            velocity.angular_radps,
            planner=self._bus.instance,
            odometry_stamp_ns=odometry.stamp_ns if odometry else 0,
            frame_ns=frame_ns,
            lateral_mps=velocity.lateral_mps,
        )
        sent = SentCommand(self._sent, time.monotonic(), velocity)
        self._inputs = with_sent(self._inputs, sent)
        self._commands.put(command)

    def _publish_status(self, now_s: float) -> None:
        """Publish the state of the search on every change and every ``STATUS_PERIOD_S``."""
        state = self._registry.state
        if state is None:
            return
        search, waiting = state.search, self._waiting(now_s)
        self._follow(search)
        shown = (
            *(search.search_id, search.index, search.reason, search.choice.number),
            bool(waiting),
            search.choice.chosen_xy,
            search.slow,
        )
        if shown == self._published and now_s < self._next_status_s:
            return
        if shown[:3] != self._published[:3]:
            LOG.info("search %s: %s", search.search_id, search.reason)
        if shown[:4] != self._published[:4]:  # not each time that it waits for a late map
            self._record_step(search)
        self._published, self._next_status_s = shown, now_s + STATUS_PERIOD_S
        self._states.put(self._status(search))
        self._write_journal(search, now_s)

    def _status(self, search: Search) -> SearchStatus:
        return status(
            search,
            odometer_m=self._inputs.odometer_m,
            now_ns=time.time_ns(),
            waiting=self._waiting(time.monotonic()),
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
            elapsed_s = max(time.time_ns() - search.started_ns, 0) / 1e9
            self._trail.add(elapsed_s, self._inputs.pose.xy)

    def _record_step(self, search: Search) -> None:
        folder, pose = self._config.state_dir, self._inputs.pose
        if folder is None:
            return
        try:
            step = status(search, odometer_m=self._inputs.odometer_m, now_ns=time.time_ns())
            decision_log.record(folder, step, pose.xy if pose else None, self._trail)
        except OSError as problem:
            self._report(f"cannot record the decisions in {folder}: {problem}")

    def _write_journal(self, search: Search, now_s: float) -> None:
        folder = self._config.state_dir
        if folder is None or (self._recorded is not None and search.active):
            return  # what was recorded stays as it is until it is known whether it goes on
        with self._reporting(folder):
            journal.save(
                folder,
                search,
                self._surroundings(),
                now_s=now_s,
                now_ns=time.time_ns(),
                odometer_m=self._inputs.odometer_m,
            )

    @contextmanager
    def _reporting(self, folder: Path) -> Iterator[None]:
        try:
            yield
        except OSError as problem:
            self._report(f"cannot record the search in {folder}: {problem}")

    def _report(self, problem: str) -> None:
        """Log why nothing can be recorded, once and not with each step."""
        if problem not in self._reported:
            LOG.error("%s", problem)
            self._reported.add(problem)


def _recorded(config: PlannerConfig, now_s: float) -> journal.Recorded | None:
    if config.state_dir is None:
        return None
    try:
        return journal.load(config.state_dir, now_s)
    except journal.JournalError as problem:
        aside = journal.set_aside(config.state_dir)
        LOG.error("the search that was active is lost: %s; %s", problem, aside)
        return None


def build(bus: Bus, config: PlannerConfig) -> Worker:
    """The planner's worker on this bus."""
    return Planner(bus, config)
