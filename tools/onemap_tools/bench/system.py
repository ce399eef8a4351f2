"""Where a frame's time goes in a whole system, and what one machine carries.

Router, mapper, gateway and, for one robot, perception and planner are real processes. The robots
live in this one, and note when each stage takes a frame: receipts, map revisions and commands name
its capture time.
"""

from __future__ import annotations

import math
import os
import tempfile
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import yaml

from onemap_perception.config import PerceptionConfig
from onemap_perception.encoders.protocol import ImageEncoder
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_encoder
from onemap_shared import keys
from onemap_shared.config import PREFIX, BusConfig, LinkParams, read, section
from onemap_shared.frame_sender import compressions
from onemap_shared.geometry import F64, pose_2d
from onemap_shared.messages import SearchRequest
from onemap_shared.transport import CallError
from onemap_shared.wire import decode, encode
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import TRAINING
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.rendering.rgbd_camera import CameraParams
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.machine import best_ms, parse_size
from onemap_tools.bench.options import SystemBench
from onemap_tools.bench.recorded_robot import (
    COMMAND,
    MAP,
    STAGES,
    VIEWS,
    WAIT_S,
    RecordedRobot,
    make_stream,
)
from onemap_tools.errors import CliError
from onemap_tools.processes.launch import Processes, ProcessSpec, onemap_command
from onemap_tools.processes.network import LOOPBACK, accepts_connections, any_free_port
from onemap_tools.processes.session import temporary_session

APARTMENT = 800  # encoders are trained from 1000 on
CLEARANCE_M = 0.4
PERCEPTION_FILE = "perception.yaml"
START_S = 240.0  # with kernels to compile on a busy machine
WARM_UP_S = 2.0
TARGET = "bathtub"  # the apartment has none, so that the search goes on
COMPUTING = {"perception": ("encode_ms", "detect_ms"), "mapper": ("update_ms",)}
COMPUTING |= {"planner": ("plan_ms",)}
QUANTILES = (0.0, 0.25, 0.5, 0.75, 1.0)


def run(options: SystemBench, tell: Callable[[str], None]) -> dict[str, Any]:
    """A row for each process, and what frames took; ValueError for a wrong option."""
    sections, size_px = read(options.config), parse_size(options.size)
    params = section(sections, "perception", PerceptionConfig)
    link = section(sections, "bus", BusConfig).link
    tell("renders and encodes the frames")
    try:
        encoder = make_encoder(params.encoder)
    except BackendError as problem:
        raise ValueError(str(problem)) from problem
    scene = generate_apartment(APARTMENT, TRAINING)
    names = tuple(f"bench/r{number}" for number in range(options.robots))
    stream = make_stream(encoder, scene, size_px, turns(scene, options.robots))
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        system = System(Path(folder), names, any_free_port(), any_free_port())
        system.configure(sections.get("perception", {}), link)
        clean = {name: v for name, v in os.environ.items() if not name.startswith(PREFIX)}
        processes = stack.enter_context(Processes(system.specs(), system.folder, clean))
        processes.start()
        until(lambda: accepts_connections(system.endpoint), "a router", processes)
        robots = []
        for number, name in enumerate(names):
            config = BusConfig(connect=(system.endpoint,), namespace=name, link=link)
            bus = stack.enter_context(temporary_session(config, "robot", START_S))
            own = encoder if options.robots > 1 else None
            robots.append(RecordedRobot(bus, stream.part(number), own))
        stop, threads = threading.Event(), []
        try:
            for number, robot in enumerate(robots):
                threads += robot.start(options.rate, number / options.robots / options.rate, stop)
            tell("waits for the map")
            begin(robots, processes, system.gateway)
            tell(f"measures for {options.seconds:g} s")
            result = measure(options, robots, {**processes.pids, "robots": os.getpid()})
        finally:
            stop.set()
            for thread in threads:
                thread.join()
        return result | {"wire": wire_costs(robots[0], encoder, link)}


def turns(scene: Scene, robots: int) -> list[F64]:
    """``VIEWS`` poses T_map_body of a turn on the spot for each robot; the first at the start."""
    collision = CollisionMap.of(scene, CameraParams().height_m)
    free = collision.reachable_cells(*scene.start[:2], CLEARANCE_M)
    places = collision.grid.centres(np.argwhere(free))
    rng = np.random.default_rng(APARTMENT)
    chosen = [scene.start[:2], *rng.choice(places, robots - 1)]
    yaws = np.arange(VIEWS) * 2 * math.pi / VIEWS
    return [pose_2d(float(x), float(y), float(yaw)) for x, y in chosen for yaw in yaws]


@dataclass(frozen=True, slots=True)
class System:
    """The processes and their configuration. names: of the robots, their namespaces."""

    folder: Path
    names: tuple[str, ...]
    router_port: int
    gateway_port: int

    @property
    def endpoint(self) -> str:
        """Of the router."""
        return f"tcp/{LOOPBACK}:{self.router_port}"

    @property
    def gateway(self) -> str:
        """Its address."""
        return f"{LOOPBACK}:{self.gateway_port}"

    @property
    def file(self) -> Path:
        """The configuration of all but perception."""
        return self.folder / "system.yaml"

    def configure(self, perception: object, link: LinkParams) -> None:
        """Write the configuration."""
        own, *others = self.names
        content: dict[str, Any] = {
            "bus": {"connect": [self.endpoint], "namespace": own},
            "gateway": {
                "port": self.gateway_port,
                "robots": {name.rpartition("/")[2]: name for name in others},
            },
            "mapper": {
                "map_folder": str(self.folder),
                "robots": list(self.names) if others else [],
            },
            "planner": {"state_dir": str(self.folder)},
        }
        self.file.write_text(yaml.safe_dump(content), encoding="utf-8")
        bus = {"connect": [self.endpoint], "namespace": own, "link": link.model_dump()}
        far = yaml.safe_dump({"bus": bus, "perception": perception})
        (self.folder / PERCEPTION_FILE).write_text(far, encoding="utf-8")

    def specs(self) -> list[ProcessSpec]:
        """Router, mapper, gateway and, for one robot, perception and planner."""
        file, alone = str(self.file), len(self.names) == 1
        commands = {"router": onemap_command("router", "--listen", self.endpoint)}
        for name in ("mapper", "planner", "gateway") if alone else ("mapper", "gateway"):
            commands[name] = onemap_command(name, "--config", file)
        if alone:
            own = str(self.folder / PERCEPTION_FILE)
            commands["perception"] = onemap_command("perception", "--config", own)
        return [ProcessSpec(n, command, last=n == "router") for n, command in commands.items()]


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


def measure(
    options: SystemBench, robots: Sequence[RecordedRobot], pids: Mapping[str, int]
) -> dict[str, Any]:
    """The result of a system in which all frames go their way; pids: of its processes."""
    time.sleep(WARM_UP_S)
    result: dict[str, Any] = {"benchmark": "system", "robots": len(robots)}
    begun_s, before = time.monotonic(), {name: usage(pid) for name, pid in pids.items()}
    time.sleep(options.seconds)
    ended_s, after = time.monotonic(), {name: usage(pid) for name, pid in pids.items()}
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
        "latency": latencies(robots, window),
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


def latencies(
    robots: Sequence[RecordedRobot], window: tuple[float, float]
) -> dict[str, list[float]]:
    """What each stage computed for a frame, milliseconds: ``QUANTILES`` of what heartbeats told."""
    told: dict[str, list[float]] = {}
    for robot in robots:
        for at, beat in robot.beats:
            for name in COMPUTING.get(beat.service, ()):
                if window[0] <= at < window[1] and beat.metrics.get(name):
                    told.setdefault(name, []).append(beat.metrics[name])
    return {
        name: [round(float(q), 1) for q in np.quantile(values, QUANTILES)]
        for name, values in told.items()
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


def wire_costs(robot: RecordedRobot, encoder: ImageEncoder, link: LinkParams) -> dict[str, float]:
    """kB of a frame and of a field, and processor time to make bytes of them and to read them."""
    costs, frame = {}, robot.stream.frame(0, 1)
    field = robot.stream.field(frame, encoder.encoder_id, encoder.text_space)
    for name, message in (("frame", frame), ("field", field)):
        how = compressions(type(message), link.compression)
        packet, kind = encode(message, how), type(message)
        costs[f"{name}_kb"] = round((len(packet.header) + len(packet.body)) / 1e3, 1)
        costs[f"{name}_encode_ms"] = best_ms(partial(encode, message, how), time.thread_time, 10)
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
