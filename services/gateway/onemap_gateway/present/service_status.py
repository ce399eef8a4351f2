"""What runs, what is missing and why, in one sentence each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from onemap_gateway.bus.live_state import Beat, LiveState, Seen
from onemap_gateway.http.problems import START, called, sentence
from onemap_shared.services import SERVICES

STREAM_S = 2.0  # a robot that sends a frame every second is slow, one slower than this is silent
SILENT_S = 3.5  # three heartbeats missed
# A process that ends takes its token along, at most one heartbeat (1 s) and one look at the tokens
# (0.25 s) after it was last heard. One that hangs, or whose link is cut, keeps its token for the
# 2 s of the bus's lease.
ENDED_WITHIN_S = 1.6
HANGS_S = 5.0  # a loop steps ten times a second, and no step of a healthy service takes so long
STAGES = ("robot", "perception", "mapper", "planner")  # in the order a frame passes them


class Condition(str, Enum):
    """How a service or the robot is."""

    OK = "ok"
    DEGRADED = "degraded"  # it runs, but does not do all of its work
    DOWN = "down"

    def __str__(self) -> str:
        return self.value


@dataclass(frozen=True, slots=True)
class Report:
    """One service, or the robot, as seen from here. ``problem`` is empty when all is well."""

    name: str
    condition: Condition
    problem: str = ""
    alive: bool = False
    ready: bool = False
    heartbeat_age_s: float | None = None
    metrics: Mapping[str, float] = field(default_factory=dict)


def reports(state: LiveState, now_s: float) -> list[Report]:
    """The robot, the services every search needs, and other services that were heard of."""
    heard = (state.alive | state.beats.keys()) & set(SERVICES) - set(STAGES)
    return [
        report_robot(state, now_s),
        *(report_service(name, state, now_s) for name in STAGES[1:]),
        *(report_service(name, state, now_s) for name in sorted(heard)),
    ]


def report_service(name: str, state: LiveState, now_s: float) -> Report:
    """The state of one service, from its liveliness token and its heartbeat."""
    alive = name in state.alive
    beat = state.beats.get(name)
    if beat is None and alive:
        return Report(name, Condition.DEGRADED, f"{called(name)} has just started.", alive)
    if beat is None:
        start = START.format(service=name)
        return Report(name, Condition.DOWN, f"{called(name)} is not running: {start}.")
    condition, problem = _judge(name, state, beat, now_s)
    heartbeat = beat.heartbeat
    return Report(
        name=name,
        condition=condition,
        problem=problem,
        alive=alive,
        ready=heartbeat.ready and condition is not Condition.DOWN,
        heartbeat_age_s=now_s - beat.arrived_s,
        metrics=heartbeat.metrics,
    )


def hung_for_s(name: str, state: LiveState, now_s: float) -> float | None:
    """Seconds since a service that hangs, or whose link is cut, was heard; None if it ended,
    runs, has just started again, or was never heard."""
    beat = state.beats.get(name)
    if beat is None:
        return None
    changed_s = state.alive_changed_s.get(name, beat.arrived_s)
    silent_s = now_s - beat.arrived_s
    if name in state.alive:
        return silent_s if silent_s > SILENT_S and changed_s <= beat.arrived_s else None
    return silent_s if changed_s - beat.arrived_s > ENDED_WITHIN_S else None


def hung_problem(name: str, state: LiveState, now_s: float) -> str:
    """What to do about a service that hangs or is cut off; empty if it is not."""
    silent_s = hung_for_s(name, state, now_s)
    return "" if silent_s is None else hung_sentence(name, silent_s)


def hung_sentence(name: str, silent_s: float) -> str:
    """A second process beside one that hangs would mix its messages with the first's."""
    return (
        f"{called(name)} has not been heard for {silent_s:.0f} s: its process hangs or its link "
        "is down; restart it rather than start a second one."
    )


def _judge(name: str, state: LiveState, beat: Beat, now_s: float) -> tuple[Condition, str]:
    silent_s, hangs_s = now_s - beat.arrived_s, now_s - beat.advanced_s
    if hung := hung_problem(name, state, now_s):
        return Condition.DOWN, hung
    if name not in state.alive:
        start = START.format(service=name)
        return Condition.DOWN, f"{called(name)} stopped {silent_s:.0f} s ago: {start}."
    if silent_s <= SILENT_S and hangs_s > HANGS_S:
        return Condition.DOWN, f"{called(name)} runs but has stood still for {hangs_s:.0f} s."
    problem = _ailing(name, beat, silent_s)
    return Condition.DEGRADED if problem else Condition.OK, problem


def _ailing(name: str, beat: Beat, silent_s: float) -> str:
    if silent_s > SILENT_S:  # its token is newer than this heartbeat, which another process sent
        return f"{called(name)} has just started."
    if beat.heartbeat.problem:
        return sentence(beat.heartbeat.problem)
    if not beat.heartbeat.ready:
        return f"{called(name)} is not ready and does not say why."
    return ""


def report_robot(state: LiveState, now_s: float) -> Report:
    """The robot, whoever it is: judged by what it sends."""
    alive = state.frame is not None and state.frame.age_s(now_s) <= STREAM_S
    if not alive:
        return Report("robot", Condition.DOWN, _silence("camera frame", state.frame, now_s))
    if state.odometry is None or state.odometry.age_s(now_s) > STREAM_S:
        problem = _silence("odometry", state.odometry, now_s)
        return Report("robot", Condition.DEGRADED, problem, alive=True)
    return Report("robot", Condition.OK, alive=True, ready=True)


def _silence(what: str, stream: Seen | None, now_s: float) -> str:
    since = "has arrived yet" if stream is None else f"for {stream.age_s(now_s):.0f} s"
    return f"No {what} {since}: is the robot (simulator, replay or a driver) running?"


@dataclass(frozen=True, slots=True)
class Gap:
    """The stage at which frames get lost on their way to the map, and a sentence on it."""

    service: str
    detail: str


def find_gap(state: LiveState, now_s: float, within_s: float) -> Gap | None:
    """None if a frame reached the map within ``within_s`` and a search could start now."""
    fresh = state.fused_s is not None and now_s - state.fused_s <= within_s
    by_name = {report.name: report for report in reports(state, now_s)}
    if fresh:  # what is down stops the frames in a moment; what is degraded does not
        down = (by_name[name] for name in STAGES[1:] if by_name[name].condition is Condition.DOWN)
        return next((Gap(report.name, report.problem) for report in down), None)
    for name in STAGES[:-1]:
        if by_name[name].condition is not Condition.OK:
            return Gap(name, by_name[name].problem)
    since = "yet" if state.fused_s is None else f"for {now_s - state.fused_s:.0f} s"
    return Gap(
        "mapper",
        f"Frames arrive and every service says it is well, but none has reached the map {since}: "
        "'onemap doctor' looks for the reason.",
    )
