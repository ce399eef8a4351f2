"""Rate and age of fields at the map, by the link and its settings."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from onemap_perception.config import MiniParams
from onemap_shared.config import LinkParams
from onemap_tools.bench.machine import parse_size
from onemap_tools.bench.options import TransportBench
from onemap_tools.bench.transport.link import (
    ADDRESSES,
    EmulatedLink,
    LinkShape,
    emulated_link,
    emulation_problem,
)
from onemap_tools.bench.transport.peers import PeerTask, make_stream
from onemap_tools.processes.launch import onemap_command
from onemap_tools.processes.network import LOOPBACK, any_free_port

WARM_UP_S = 3.0  # connections, and what fills queues at the beginning
ENDING_S = 20.0
PORT = 7447  # in a namespace of its own
ROLES = ("mapper", "perception", "robot")  # the order in which they are started
REMOTE = "perception"  # the role on the other side of the link


@dataclass(frozen=True, slots=True)
class Setting:
    """``bus.link`` of robot and perception, and perception's number of channels, 0: all."""

    link: LinkParams
    channels: int = 0


COMPRESSED = LinkParams(compression="lossy")
THIN = COMPRESSED.model_copy(update={"window": 2})
SETTINGS: Mapping[str, Setting] = {
    "raw": Setting(LinkParams()),
    "window": Setting(LinkParams(window=2)),
    "compressed": Setting(COMPRESSED),
    "thin": Setting(THIN),
    "narrow": Setting(THIN, channels=128),
}


def run(options: TransportBench, tell: Callable[[str], None]) -> dict[str, Any]:
    """One row for each setting and number of streams; ValueError where no link can be emulated."""
    shape = None
    if options.link:
        shape = LinkShape(options.link * 1e6, options.delay * 1e-3, options.loss * 1e-2)
        if problem := emulation_problem():
            raise ValueError(problem)
    if unknown := set(options.setting or ()) - set(SETTINGS):
        raise ValueError(f"--setting is {min(unknown)!r}; there are {', '.join(SETTINGS)}")
    chosen = {name: SETTINGS[name] for name in options.setting or SETTINGS}
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        streams = {}
        for channels in {each.channels for each in chosen.values()}:
            path = Path(folder) / f"{channels}.npz"
            stream = make_stream(MiniParams(channels=channels), parse_size(options.size))
            stream.save(path)
            streams[channels] = stream, path
        for count in options.streams or [1]:
            for name, setting in chosen.items():
                stream, path = streams[setting.channels]
                frame_kb, field_kb = stream.sizes_kb(setting.link)
                row = {"setting": name, "streams": count}
                row |= {"frame_kb": round(frame_kb, 1), "field_kb": round(field_kb, 1)}
                tell(f"{name}, {count} robots")
                rows.append(row | measure(path, setting.link, shape, options, count))
    return {"benchmark": "transport", "link_mbit_s": options.link, "results": rows}


def measure(
    path: Path, link: LinkParams, shape: LinkShape | None, options: TransportBench, streams: int
) -> dict[str, Any]:
    """Run router, robots, perception and map for a while; rates, ages and bytes."""
    with ExitStack() as stack:
        emulated = None
        if shape is not None:
            emulated = stack.enter_context(emulated_link(shape, options.congestion_control))
        host = ADDRESSES[0] if emulated else LOOPBACK
        endpoint = f"tcp/{host}:{PORT if emulated else any_free_port()}"
        router = psutil.Process(stack.enter_context(_router(endpoint, emulated)))
        task = PeerTask(
            endpoint=endpoint,
            stream=path,
            streams=streams,
            rate_hz=options.rate,
            encode_s=options.encode * 1e-3,
            link=link,
        )
        peers = {role: _peer(role, task, emulated) for role in ROLES}
        try:
            time.sleep(WARM_UP_S)
            begun, before = time.monotonic(), emulated.carried() if emulated else {}
            routing = router.cpu_times()
            time.sleep(options.seconds)
            ended, after = time.monotonic(), emulated.carried() if emulated else {}
            routed = router.cpu_times()
            counted = {role: _counted(process) for role, process in peers.items()}
        finally:
            for process in peers.values():
                process.kill()
                process.wait()
    row = summary(counted, begun, ended)
    frames = row["rate_hz"] * streams * (ended - begun)
    used_s = routed.user + routed.system - routing.user - routing.system
    row["router_ms_per_frame"] = round(1e3 * used_s / frames, 2) if frames else None
    return row | {
        f"{way}_mbit_s": round(8e-6 * (after[way] - before[way]) / (ended - begun), 1)
        for way in ("up", "down")
        if way in after
    }


def summary(counted: Mapping[str, Any], begun_s: float, ended_s: float) -> dict[str, Any]:
    """Rate and age of the fields that arrived between two times, of all streams together.

    rate_hz is the mean of the streams, slowest_hz the lowest; ages are None if nothing arrived.
    """
    ages: list[float] = []
    rates = []
    for stream in counted["mapper"]["streams"]:
        inside = [age for at, age in stream["ages"] if begun_s <= at < ended_s]
        rates.append(len(inside) / (ended_s - begun_s))
        ages += inside
    p50, p95 = (round(1e3 * float(np.quantile(ages, q))) if ages else None for q in (0.5, 0.95))
    metrics = [s["metrics"] for role in ("robot", "perception") for s in counted[role]["streams"]]

    def total(name: str) -> int:
        return int(sum(v for each in metrics for k, v in each.items() if k.endswith(name)))

    return {
        "rate_hz": round(float(np.mean(rates)), 1),
        "slowest_hz": round(min(rates), 1),
        "age_p50_ms": p50,
        "age_p95_ms": p95,
        "replaced": total("_replaced"),
        "overdue": total("_overdue"),
    }


def _command(link: EmulatedLink | None, side: int, command: Sequence[str]) -> list[str]:
    return list(link.command(side, *command) if link else command)


@contextmanager
def _router(endpoint: str, link: EmulatedLink | None) -> Iterator[int]:
    command = _command(link, 0, onemap_command("router", "--listen", endpoint))
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    try:
        yield process.pid
    finally:
        process.terminate()
        try:
            process.wait(ENDING_S)
        except subprocess.TimeoutExpired:
            process.kill()


def _peer(role: str, task: PeerTask, link: EmulatedLink | None) -> subprocess.Popen[str]:
    """A process of this role that is connected."""
    own = [sys.executable, "-m", f"{__package__}.peers", role, task.model_dump_json()]
    process = subprocess.Popen(
        _command(link, int(role == REMOTE), own),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    )
    assert process.stdout is not None
    if process.stdout.readline() != "ready\n":
        raise ValueError(f"the {role} of the benchmark did not start")
    return process


def _counted(process: subprocess.Popen[str]) -> Any:
    output, _ = process.communicate(timeout=ENDING_S)
    return json.loads(output.splitlines()[-1])
