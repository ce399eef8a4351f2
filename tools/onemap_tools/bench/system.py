"""Where a frame's time goes in a whole system, and what one machine carries.

Router, mapper, gateway and, for one robot, perception and planner are real processes. The robots
live in this one: they publish what was rendered, and encoded, beforehand, and note when each stage
takes a frame: receipts, map revisions and commands name its capture time.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import yaml

from onemap_perception.config import MiniParams
from onemap_perception.encoders.protocol import ImageEncoder
from onemap_perception.factory import make_encoder
from onemap_shared import keys
from onemap_shared.config import PREFIX, BusConfig
from onemap_shared.geometry import F64, inverse, pose_2d
from onemap_shared.keys import Topic
from onemap_shared.messages import Heartbeat, Odometry, SearchRequest
from onemap_shared.transport import Bus, CallError, Subscription
from onemap_shared.wire import decode, encode
from onemap_simulator.config import ODOMETRY_HZ
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import TRAINING
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.rendering.rgbd_camera import CameraParams
from onemap_tools.bench.machine import best_ms, parse_size
from onemap_tools.bench.options import SystemBench
from onemap_tools.bench.transport.benchmark import APARTMENT, Stream, make_stream
from onemap_tools.errors import CliError
from onemap_tools.processes.launch import Processes, ProcessSpec, onemap_command
from onemap_tools.processes.network import LOOPBACK, accepts_connections, any_free_port
from onemap_tools.processes.session import temporary_session

VIEWS = 16  # of a turn
CLEARANCE_M = 0.4
BUFFERED = 64  # messages between two looks of a thread
WAIT_S = 0.2
START_S = 240.0  # with kernels to compile on a busy machine
WARM_UP_S = 2.0
TARGET = "bathtub"  # the apartment has none, so that the search goes on
# What says that a frame has come so far, in order, by the process that then has it.
STAGES: Mapping[str, Topic[Any]] = {
    "perception": keys.RGBD_RECEIPTS,
    "mapper": keys.FIELD_RECEIPTS,
    (MAP := "planner"): keys.MAP_REVISION,
    (COMMAND := "command"): keys.ROBOT_CMD_VEL,
}
HEALTH = "health"
COMPUTING = {"perception": ("encode_ms", "detect_ms"), "mapper": ("update_ms",)}
COMPUTING |= {"planner": ("plan_ms",)}


class RecordedRobot:
    """Publishes a stream's frames; with an encoder, whose fields they are, the fields too.

    ages: by stage and capture time, when a frame was first there (monotonic, seconds) and how old
    it was (seconds). sent: when frames were published.
    """

    def __init__(self, bus: Bus, stream: Stream, encoder: ImageEncoder | None) -> None:
        self.bus, self.stream, self.encoder = bus, stream, encoder
        self.sent: list[float] = []
        self.ages: dict[str, dict[int, tuple[float, float]]] = {name: {} for name in STAGES}
        self.beats: list[tuple[float, Heartbeat]] = []
        self._body = stream.T_map_camera[0]
        if encoder is not None:
            bus.serve(keys.EMBED_TEXT, lambda request: encoder.embed_text(request.texts))

    @property
    def fused(self) -> list[float]:
        """When a frame of it was new in the map."""
        return [at for stamp_ns, (at, _) in self.ages[MAP].copy().items() if stamp_ns]

    def start(self, rate_hz: float, wait_s: float, stop: threading.Event) -> list[threading.Thread]:
        """Its threads; the first frame comes after ``wait_s``."""
        followed = {**STAGES, HEALTH: keys.ALL_HEARTBEATS}
        inboxes = {name: self.bus.subscribe(topic, BUFFERED) for name, topic in followed.items()}
        jobs = [partial(self._follow, name, inbox, stop) for name, inbox in inboxes.items()]
        jobs += [partial(self._publish, rate_hz, wait_s, stop), partial(self._move, rate_hz, stop)]
        threads = [threading.Thread(target=job, daemon=True) for job in jobs]
        for thread in threads:
            thread.start()
        return threads

    def _publish(self, rate_hz: float, wait_s: float, stop: threading.Event) -> None:
        frames, fields = self.bus.publish(keys.ROBOT_RGBD), self.bus.publish(keys.FIELD)
        mount = inverse(CameraParams().mount)
        due_s = time.monotonic() + wait_s
        while not stop.wait(max(due_s - time.monotonic(), 0.0)):
            frame = self.stream.frame(len(self.sent), time.time_ns())
            self._body = frame.T_map_camera @ mount
            frames.put(frame)
            if self.encoder is not None:
                names = {name: getattr(self.encoder, name) for name in ("encoder_id", "text_space")}
                fields.put(replace(self.stream.field(frame), **names))
            self.sent.append(time.monotonic())
            due_s = max(due_s + 1.0 / rate_hz, time.monotonic())

    def _move(self, rate_hz: float, stop: threading.Event) -> None:
        poses, number = self.bus.publish(keys.ROBOT_ODOMETRY), 0
        while not stop.wait(1.0 / ODOMETRY_HZ):
            turning_radps = 2 * math.pi / VIEWS * rate_hz
            poses.put(Odometry(number, time.time_ns(), self._body, 0.0, turning_radps))
            number += 1

    def _follow(self, name: str, inbox: Subscription[Any], stop: threading.Event) -> None:
        message: Any = None
        while message is not None or not stop.is_set():  # at the end, what has come by then
            message = inbox.take(0.0 if stop.is_set() else WAIT_S)
            now_s, now_ns = time.monotonic(), time.time_ns()
            if name == HEALTH and message is not None:
                self.beats.append((now_s, message))
            elif message is not None:
                stamp_ns = message.frame_ns if name == COMMAND else message.stamp_ns
                self.ages[name].setdefault(stamp_ns, (now_s, (now_ns - stamp_ns) * 1e-9))


def run(options: SystemBench, tell: Callable[[str], None]) -> dict[str, Any]:
    """A row for each process, and what frames and queries took; ValueError for a wrong size."""
    tell("renders and encodes the frames")
    encoder = make_encoder(MiniParams())
    stream = make_stream(MiniParams(), parse_size(options.size), bodies=turns(options.robots))
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        endpoint, port = f"tcp/{LOOPBACK}:{any_free_port()}", any_free_port()
        specs = specs_of(options.robots, Path(folder), endpoint, port)
        clean = {name: v for name, v in os.environ.items() if not name.startswith(PREFIX)}
        processes = stack.enter_context(Processes(specs, Path(folder), clean))
        processes.start()
        until(lambda: accepts_connections(endpoint), "a router", processes)
        robots = []
        for number, name in enumerate(namespaces(options.robots)):
            config = BusConfig(connect=(endpoint,), namespace=name)
            bus = stack.enter_context(temporary_session(config, "robot", START_S))
            own = slice(number * VIEWS, (number + 1) * VIEWS)
            part = Stream(**{name: values[own] for name, values in vars(stream).items()})
            robots.append(RecordedRobot(bus, part, encoder if options.robots > 1 else None))
        stop, threads = threading.Event(), []
        try:
            for number, robot in enumerate(robots):
                threads += robot.start(options.rate, number / options.robots / options.rate, stop)
            tell("waits for the map")
            begin(robots, processes, f"{LOOPBACK}:{port}")
            tell(f"measures for {options.seconds:g} s")
            pids = {**processes.pids, "robots": os.getpid()}
            result = measure(options, robots, pids, f"{LOOPBACK}:{port}")
        finally:
            stop.set()
            for thread in threads:
                thread.join()
        return result | {"wire": wire_costs(robots[0])}


def namespaces(robots: int) -> list[str]:
    """That of each robot."""
    return [f"bench/r{number}" for number in range(robots)]


def turns(robots: int) -> list[F64]:
    """``VIEWS`` poses T_map_body of a turn on the spot for each robot; the first at the start."""
    scene = generate_apartment(APARTMENT, TRAINING)
    collision = CollisionMap.of(scene, CameraParams().height_m)
    free = collision.reachable_cells(*scene.start[:2], CLEARANCE_M)
    places = collision.grid.centres(np.argwhere(free))
    rng = np.random.default_rng(APARTMENT)
    chosen = [scene.start[:2], *rng.choice(places, robots - 1)]
    yaws = np.arange(VIEWS) * 2 * math.pi / VIEWS
    return [pose_2d(float(x), float(y), float(yaw)) for x, y in chosen for yaw in yaws]


def specs_of(robots: int, folder: Path, endpoint: str, port: int) -> list[ProcessSpec]:
    """The processes, configured by a file in the folder."""
    own, *others = names = namespaces(robots)
    content: dict[str, Any] = {
        "bus": {"connect": [endpoint], "namespace": own},
        "gateway": {"port": port, "robots": {name.rpartition("/")[2]: name for name in others}},
        "mapper": {"map_folder": str(folder), "robots": names if others else []},
        "planner": {"state_dir": str(folder)},
    }
    file = folder / "system.yaml"
    file.write_text(yaml.safe_dump(content), encoding="utf-8")
    services = ("mapper", "gateway") if others else ("perception", "mapper", "planner", "gateway")
    router = ProcessSpec("router", onemap_command("router", "--listen", endpoint), last=True)
    return [router, *(ProcessSpec(n, onemap_command(n, "--config", str(file))) for n in services)]


def until(true: Callable[[], object], what: str, processes: Processes) -> None:
    """Return as soon as it holds; CliError if a process ends or it does not within ``START_S``.

    A call that fails does not hold either, and is the reason.
    """
    deadline_s, reason = time.monotonic() + START_S, ""
    while time.monotonic() < deadline_s:
        for ended in processes.collect(time.monotonic()):
            raise CliError(ended.report)
        try:
            if true():
                return
        except CallError as problem:
            reason = f": {problem}"
        time.sleep(WAIT_S)
    raise CliError(f"The benchmark waited {START_S:g} s for {what}, in vain{reason}.")


def begin(robots: Sequence[RecordedRobot], processes: Processes, gateway: str) -> None:
    """Return when all frames go their way: to the map, and for one robot to commands."""
    until(lambda: all(r.fused for r in robots), "frames in the map", processes)
    until(lambda: accepts_connections(f"tcp/{gateway}"), "the gateway", processes)
    if len(robots) == 1:
        start = SearchRequest((TARGET,))
        until(lambda: robots[0].bus.call(keys.SEARCH_START, start), "a search", processes)
        until(lambda: any(robots[0].ages[COMMAND]), "a command", processes)


def asking(options: SystemBench, gateway: str) -> subprocess.Popen[str]:
    """The clients, when they begin to ask."""
    many = ("--clients", str(options.clients), "--seconds", str(options.seconds))
    command = onemap_command("bench", "clients", "--url", f"http://{gateway}", *many, "--json")
    pipe = subprocess.PIPE
    clients = subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True)
    assert clients.stderr is not None
    clients.stderr.readline()
    return clients


def measure(
    options: SystemBench, robots: Sequence[RecordedRobot], pids: dict[str, int], gateway: str
) -> dict[str, Any]:
    """The result of a system in which all frames go their way; pids: of its processes."""
    time.sleep(WARM_UP_S)
    result: dict[str, Any] = {"benchmark": "system", "robots": len(robots)}
    clients = asking(options, gateway) if options.clients else None
    pids |= {"clients": clients.pid} if clients else {}
    begun_s, before = time.monotonic(), {name: usage(pid) for name, pid in pids.items()}
    time.sleep(options.seconds)
    ended_s, after = time.monotonic(), {name: usage(pid) for name, pid in pids.items()}
    if clients is not None:
        output, problems = clients.communicate(timeout=START_S)
        if clients.returncode:
            raise CliError(problems)
        asked = json.loads(output.splitlines()[-1])
        result |= {name: asked[name] for name in ("queries_per_s", "known", "new")}
    window, seconds = (begun_s, ended_s), ended_s - begun_s
    sent = sum(begun_s <= at < ended_s for robot in robots for at in robot.sent)
    fused = [sum(begun_s <= at < ended_s for at in robot.fused) for robot in robots]
    rows = []
    for name in pids:
        user_s, kernel_s, wakes = after[name] - before[name]
        costs = {"user_ms": 1e3 * user_s, "kernel_ms": 1e3 * kernel_s, "wakes": wakes}
        each = {what: round(cost / max(sum(fused), 1), 1) for what, cost in costs.items()}
        core = {"core_percent": round(100 * (user_s + kernel_s) / seconds)}
        rows.append({"process": name} | core | each | stage_row(robots, name, window))
    return result | {
        "sent_hz": round(sent / seconds, 1),
        "fused_hz": round(sum(fused) / seconds, 1),
        "slowest_robot_hz": round(min(fused) / seconds, 2),
        "capture_to_map_ms": ages_ms(robots, MAP, window),
        "capture_to_command_ms": ages_ms(robots, COMMAND, window),
        "load_average": round(os.getloadavg()[0], 2),
        "results": rows,
    }


def usage(pid: int) -> F64:
    """Of a process so far: seconds in its own code and in the kernel, and its threads' wakes.

    The wakes are 0 where the system does not tell.
    """
    times, wakes = psutil.Process(pid).cpu_times(), 0
    for status in Path("/proc", str(pid), "task").glob("*/status"):
        lines = status.read_text().splitlines()
        wakes += sum(int(line.split()[1]) for line in lines if line.startswith("voluntary"))
    return np.array([times.user, times.system, wakes])


def stage_row(
    robots: Sequence[RecordedRobot], name: str, window: tuple[float, float]
) -> dict[str, Any]:
    """Age of the frames that a process took, and how long until the next one had its result."""
    said = [
        sum(beat.metrics.get(each, 0.0) for each in COMPUTING[name])
        for robot in robots
        for at, beat in robot.beats
        if beat.service == name in COMPUTING and window[0] <= at < window[1]
    ]
    following = dict(pairwise(STAGES)).get(name, "")
    return {
        "taken_ms": ages_ms(robots, name, window),
        "stage_ms": ages_ms(robots, following, window, since=name),
        "computing_ms": round(float(np.mean(said)), 1) if said else None,
    }


def ages_ms(
    robots: Sequence[RecordedRobot], stage: str, window: tuple[float, float], since: str = ""
) -> list[float] | None:
    """p50 and p95 of the age at a stage, or of the time since one before; None without frames."""
    found = []
    for robot in robots:
        before = robot.ages.get(since, {})
        for stamp_ns, (at, age_s) in robot.ages.get(stage, {}).items():
            if stamp_ns and window[0] <= at < window[1] and (not since or stamp_ns in before):
                found.append(1e3 * (age_s - (before[stamp_ns][1] if since else 0.0)))
    return [round(float(q), 1) for q in np.quantile(found, (0.5, 0.95))] if found else None


def wire_costs(robot: RecordedRobot) -> dict[str, float]:
    """kB of a frame and of a field, and processor time to make bytes of them and to read them."""
    costs, frame = {}, robot.stream.frame(0, 1)
    for name, message in (("frame", frame), ("field", robot.stream.field(frame))):
        packet, kind = encode(message), type(message)
        costs[f"{name}_kb"] = round((len(packet.header) + len(packet.body)) / 1e3, 1)
        costs[f"{name}_encode_ms"] = best_ms(partial(encode, message), time.thread_time, 10)
        costs[f"{name}_decode_ms"] = best_ms(partial(decode, kind, packet), time.thread_time, 10)
    return costs


def lines(result: Mapping[str, Any]) -> list[str]:
    """The table, and the rest below it."""
    columns = [name for name in result["results"][0] if name != "process"]
    table = [f"{'process':12}" + "".join(f"{name:>16}" for name in columns)]
    for row in result["results"]:
        cells = ("/".join(map(str, v)) if isinstance(v, list) else v for v in row.values())
        first, *others = ("" if cell is None else str(cell) for cell in cells)
        table.append(f"{first:12}" + "".join(f"{cell:>16}" for cell in others))
    rest = [f"{name:20} {value}" for name, value in result.items() if name != "results"]
    return [*table, *rest]
