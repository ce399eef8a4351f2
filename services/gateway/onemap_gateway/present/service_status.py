"""Condition of every service and of the pipeline, with the reason in a sentence."""

from __future__ import annotations

import re
from dataclasses import dataclass

from onemap.replies import ServiceHealth
from onemap_gateway.bus.live_state import HeartbeatRecord, LatestMessage, LiveState
from onemap_shared.services import (
    DRIVER,
    SERVICES,
    STAGES,
    doubled_sentence,
    installed_version,
    role_of,
)
from onemap_shared.supervisor import launched, start_hint

# A robot that sends one frame a second is slow; beyond this it counts as silent.
STREAM_TIMEOUT_S = 2.0
HEARTBEAT_TIMEOUT_S = 3.5  # three heartbeats missed
# Of a process that starts: on a busy machine an import keeps the interpreter for seconds.
START_TIMEOUT_S = 30.0
# From the last service that is ready to the first frame on the map: 1 to 4 s on a busy machine.
FIRST_FRAME_S = 10.0
# The token of a process that ends vanishes at most one heartbeat (1 s) and one reading of the
# tokens (0.25 s) after its last heartbeat. A process that hangs, or whose link is cut, keeps its
# token for the 2 s of the bus's lease.
TOKEN_LAG_S = 1.6
# A service loop runs at 10 Hz; no step of a healthy service takes so long.
PROGRESS_TIMEOUT_S = 5.0
PIPELINE_STAGES = ("robot", *STAGES)  # in the order a frame passes them


OK, DEGRADED, DOWN = "ok", "degraded", "down"  # degraded: runs, but does not do all of its work
Assessment = tuple[str, str]  # a condition, and what is wrong in a sentence, empty if nothing is


def assess_services(state: LiveState, now_s: float) -> list[ServiceHealth]:
    """The robot, the services that every search needs, and any other service on the bus."""
    others = (state.alive | state.heartbeats.keys()) & set(SERVICES) - set(PIPELINE_STAGES)
    return [
        assess_robot(state, now_s),
        *(assess_service(name, state, now_s) for name in PIPELINE_STAGES[1:]),
        *(assess_service(name, state, now_s) for name in sorted(others)),
    ]


def assess_service(name: str, state: LiveState, now_s: float) -> ServiceHealth:
    """One service, judged by its liveliness token and its heartbeat."""
    record = state.heartbeats.get(name)
    condition, problem = _assess(name, state, record, now_s)
    reported = {}
    if record is not None and state.connected:
        reported = {
            "ready": record.heartbeat.ready and condition != DOWN,
            "heartbeat_age_s": now_s - record.arrived_s,
            "metrics": record.heartbeat.metrics,
            "version": record.heartbeat.version,
        }
    alive = state.connected and name in state.alive
    return ServiceHealth.model_validate(
        {"name": name, "condition": condition, "problem": problem, "alive": alive, **reported}
    )


def hung_for_s(name: str, state: LiveState, now_s: float) -> float | None:
    """Seconds since the last heartbeat of a service that hangs or whose link is cut.

    None if the service runs, ended, has just started again, or never sent a heartbeat.
    """
    record = state.heartbeats.get(name)
    if record is None:
        return None
    changed_s = state.alive_changed_s.get(name, record.arrived_s)
    silent_s = now_s - record.arrived_s
    if name in state.alive:
        limit_s = START_TIMEOUT_S if record.heartbeat.starting else HEARTBEAT_TIMEOUT_S
        return silent_s if silent_s > limit_s and changed_s <= record.arrived_s else None
    return silent_s if changed_s - record.arrived_s > TOKEN_LAG_S else None


def doubled_problem(role: str, state: LiveState) -> str:
    """What to do about several processes of one role; empty if there are none."""
    names = state.doubled.get(role)
    if names is None:
        return ""
    return f"{sentence(doubled_sentence(role, names))[:-1]}; stop all but one of them."


def hung_problem(name: str, state: LiveState, now_s: float) -> str:
    """What to do about a service that hangs or whose link is cut; empty if neither is so.

    Without a router nobody is heard, and nobody else is to blame.
    """
    if not state.connected:
        return f"The gateway has lost the router: {start_hint('router')}."
    silent_s = hung_for_s(name, state, now_s)
    if silent_s is None:
        return ""
    # A second process would publish on the same topics as the one that hangs.
    return (
        f"{sentence_subject(name)} has not been heard from for {silent_s:.0f} s: its process "
        "hangs or its link is down; restart it rather than start a second one."
    )


def _awaited(state: LiveState, now_s: float) -> frozenset[str]:
    """The services that are started together with this process, as long as that may take."""
    return launched() if now_s - state.since_s <= START_TIMEOUT_S else frozenset()


def start_problem(name: str, state: LiveState) -> str:
    """What a service says of its start, as long as that goes on; else empty."""
    record = state.heartbeats.get(name)
    return _starting(name, record) if record and _begins(name, state) else ""


def _begins(name: str, state: LiveState) -> bool:
    """Whether a service answers no request yet: it starts, or has not been heard at all."""
    record = state.heartbeats.get(name)
    return name in state.alive and (record is None or record.heartbeat.starting)


def _starting(name: str, record: HeartbeatRecord) -> str:
    return sentence(re.sub("^it ", f"{sentence_subject(name)} ", record.heartbeat.problem))


def _assess(
    name: str, state: LiveState, record: HeartbeatRecord | None, now_s: float
) -> Assessment:
    subject = sentence_subject(name)
    if hung := hung_problem(name, state, now_s):
        return DOWN, hung
    if record is None and name in state.alive | _awaited(state, now_s):
        return DEGRADED, f"{subject} is starting."
    if name not in state.alive:
        silent_s = now_s - record.arrived_s if record else 0.0
        ended = f"stopped {silent_s:.0f} s ago" if record else "is not running"
        return DOWN, f"{subject} {ended}: {start_hint(name)}."
    assert record is not None  # it is alive, and has been heard
    silent_s, hangs_s = now_s - record.arrived_s, now_s - record.advanced_s
    if several := doubled_problem(name, state):
        return DEGRADED, several
    if silent_s <= HEARTBEAT_TIMEOUT_S and hangs_s > PROGRESS_TIMEOUT_S:
        return DOWN, f"{subject} runs but has stood still for {hangs_s:.0f} s."
    problem = _degraded_reason(name, record, silent_s)
    return DEGRADED if problem else OK, problem


def _degraded_reason(name: str, record: HeartbeatRecord, silent_s: float) -> str:
    if record.heartbeat.starting:
        return _starting(name, record)
    # A token newer than the last heartbeat: that was sent by the process before.
    if silent_s > HEARTBEAT_TIMEOUT_S:
        return f"{sentence_subject(name)} is starting."
    if record.heartbeat.problem:
        return sentence(record.heartbeat.problem)
    theirs, ours = record.heartbeat.version, installed_version()
    if theirs and ours and theirs != ours:
        return (
            f"{sentence_subject(name)} runs version {theirs}, the gateway {ours}: "
            "update all services together."
        )
    if not record.heartbeat.ready:
        return f"{sentence_subject(name)} is not ready and does not say why."
    return ""


def assess_robot(state: LiveState, now_s: float) -> ServiceHealth:
    """The robot (simulator, replay or a driver), judged by its streams and what its driver says.

    A driver without token and heartbeat is judged by the streams alone.
    """
    alive = state.frame is not None and state.frame.age_s(now_s) <= STREAM_TIMEOUT_S
    alive = alive and state.connected
    condition = DEGRADED
    if not state.connected:
        condition, problem = DOWN, hung_problem("robot", state, now_s)
    elif ended := ended_driver(state, now_s):
        condition, alive, problem = DOWN, False, ended
    elif begun := _new_driver(state, now_s):
        alive, problem = False, begun
    elif reason := _driver_problem(state, now_s):
        condition, problem = DEGRADED if alive else DOWN, reason
    elif not alive:
        condition, problem = DOWN, _silence_detail("camera frame", state.frame, now_s)
    elif state.odometry is None or state.odometry.age_s(now_s) > STREAM_TIMEOUT_S:
        problem = _silence_detail("odometry", state.odometry, now_s)
    else:
        problem = doubled_problem("robot", state)
        condition = DEGRADED if problem else OK
    return ServiceHealth(
        name="robot", condition=condition, problem=problem, alive=alive, ready=condition == OK
    )


def ended_driver(state: LiveState, now_s: float) -> str:
    """What to do about a driver that ended; empty while one is there, or frames still come."""
    changed_s = {name: at_s for name, at_s in state.alive_changed_s.items() if _drives(name)}
    if not changed_s or any(map(_drives, state.alive)):
        return ""
    name = max(changed_s, key=lambda each: changed_s[each])
    if state.frame is not None and state.frame.arrived_s > changed_s[name]:
        return ""
    return (
        f"{sentence_subject(name)} stopped {now_s - changed_s[name]:.0f} s ago: {start_hint(name)}."
    )


def _new_driver(state: LiveState, now_s: float) -> str:
    """That a driver starts: what came before is of another one; else empty."""
    heard_s = state.frame.arrived_s if state.frame is not None else float("-inf")
    for name in sorted(filter(_drives, state.alive)):
        record = state.heartbeats.get(name)
        if record is not None and record.heartbeat.starting:
            return _starting(name, record)
        since_s = state.alive_changed_s.get(name, heard_s)
        if heard_s < since_s and now_s - since_s <= START_TIMEOUT_S:
            return f"{sentence_subject(name)} is starting."
    if state.frame is None:
        for name in sorted(filter(_drives, _awaited(state, now_s))):
            return f"{sentence_subject(name)} is starting."
    return ""


def _driver_problem(state: LiveState, now_s: float) -> str:
    """The sentence of a driver that says that it is not ready; empty otherwise."""
    for name in sorted(filter(_drives, state.alive)):
        record = state.heartbeats.get(name)
        if record is None or now_s - record.arrived_s > HEARTBEAT_TIMEOUT_S:
            continue
        if record.heartbeat.problem and not record.heartbeat.ready:
            return sentence(record.heartbeat.problem)
    return ""


def _drives(service: str) -> bool:
    return role_of(service) == DRIVER


def _silence_detail(what: str, stream: LatestMessage | None, now_s: float) -> str:
    since = "has arrived yet" if stream is None else f"for {stream.age_s(now_s):.0f} s"
    return f"No {what} {since}: check the robot and its driver, simulator or replay."


@dataclass(frozen=True, slots=True)
class PipelineFault:
    """The stage of the pipeline at which frames are lost, and the reason in a sentence."""

    service: str
    detail: str


def find_pipeline_fault(state: LiveState, now_s: float, within_s: float) -> PipelineFault | None:
    """None if a frame was fused within ``within_s`` and a search could start now."""
    if not state.connected:
        return PipelineFault("router", hung_problem("router", state, now_s))
    for role in PIPELINE_STAGES:
        if several := doubled_problem(role, state):
            return PipelineFault(role, several)
    fresh = state.last_fused_s is not None and now_s - state.last_fused_s <= within_s
    first = state.last_fused_s is None and now_s - _ready_s(state) <= FIRST_FRAME_S
    by_name = {status.name: status for status in assess_services(state, now_s)}
    if fresh or first:  # a stage that is down or starts stops the frames; a degraded one does not
        for each in (by_name[name] for name in PIPELINE_STAGES):
            lacks = each.condition == DOWN or _begins(each.name, state)
            if lacks or (each.name == "robot" and each.condition != OK):
                return PipelineFault(each.name, each.problem)
        under_way = "The map is starting: the first frame is on its way to it."
        return None if fresh else PipelineFault("mapper", under_way)
    for name in PIPELINE_STAGES[:-1]:
        if by_name[name].condition != OK:
            return PipelineFault(name, by_name[name].problem)
    since = "yet" if state.last_fused_s is None else f"for {now_s - state.last_fused_s:.0f} s"
    return PipelineFault(
        "mapper",
        f"Frames arrive and every service says it is well, but none has reached the map {since}: "
        "'onemap doctor' looks for the reason.",
    )


def _ready_s(state: LiveState) -> float:
    """When the last of the driver and the services of a frame's way was first heard as started."""
    return max(
        (
            record.started_s
            for name, record in state.heartbeats.items()
            if name in state.alive and (_drives(name) or name in PIPELINE_STAGES)
        ),
        default=state.since_s,
    )


def sentence_subject(service: str) -> str:
    """The service as the subject of a sentence."""
    return "Perception" if service == "perception" else f"The {service}"


def sentence(text: str) -> str:
    """The text with a capital letter and a full stop."""
    text = " ".join(text.split())
    if not text:
        return "No reason was given."
    return text[0].upper() + text[1:] + ("" if text[-1] in ".!?" else ".")
