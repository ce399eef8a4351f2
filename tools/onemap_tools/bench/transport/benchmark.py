"""Rate and age of fields at the map, by the link and its settings.

A robot, a stage that answers frames with fields, and a map are processes of their own; each serves
every stream. What they send was made beforehand: images of a generated apartment and their fields.
``python -m onemap_tools.bench.transport.benchmark ROLE TASK`` (JSON) runs one until standard input
is closed and then prints what it counted as one line of JSON.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from pydantic import BaseModel

from onemap_perception.config import EncoderParams, MiniParams
from onemap_perception.errors import BackendError
from onemap_perception.factory import make_encoder
from onemap_perception.feature_field import VarianceParams, feature_field
from onemap_shared import keys
from onemap_shared.bus import ZenohBus, open_bus
from onemap_shared.config import BusConfig, LinkParams
from onemap_shared.frame_sender import compressions
from onemap_shared.geometry import F16, F32, F64, U8, U16, inverse
from onemap_shared.messages import FeatureField, FrameReceipt, RgbdFrame
from onemap_shared.wire import encode
from onemap_simulator.errors import DepthErrorParams
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import TRAINING
from onemap_simulator.rendering.camera_poses import sample_camera_poses
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.rendering.rgbd_camera import CameraParams, RgbdCamera
from onemap_tools.bench.machine import parse_size
from onemap_tools.bench.options import TransportBench
from onemap_tools.bench.transport.link import (
    ADDRESSES,
    EmulatedLink,
    LinkShape,
    emulated_link,
    emulation_problem,
)
from onemap_tools.processes.launch import onemap_command
from onemap_tools.processes.network import LOOPBACK, any_free_port

WAIT_S = 0.2
APARTMENT = 800  # encoders are trained from 1000 on
IMAGES = 16
DEPTH_NOISE_M = 0.002  # at 1 m, as a stereo camera's: without it depth compresses too well


@dataclass(frozen=True)
class Stream:
    """N images and what perception made of them: rgb (N, H, W, 3), depth_mm (N, H, W), features
    (N, h, w, D), variance (N, H, W), T_map_camera (N, 4, 4)."""

    rgb: U8
    depth_mm: U16
    features: F16
    variance: F32
    T_map_camera: F64

    def frame(self, number: int, stamp_ns: int) -> RgbdFrame:
        """The frame of this sequence number."""
        which = number % len(self.rgb)
        camera = CameraParams(width=self.rgb.shape[2], height=self.rgb.shape[1]).intrinsics
        pose = self.T_map_camera[which]
        return RgbdFrame(number, stamp_ns, self.rgb[which], self.depth_mm[which], camera, pose)

    def field(self, frame: RgbdFrame) -> FeatureField:
        """The field of a frame of this stream, with the depth that arrived."""
        which = frame.sequence % len(self.rgb)
        return FeatureField(
            frame.sequence,
            frame.stamp_ns,
            "benchmark",
            "benchmark",
            self.features[which],
            self.variance[which],
            frame.depth_mm,
            frame.intrinsics,
            frame.T_map_camera,
        )

    def sizes_kb(self, params: LinkParams) -> tuple[float, float]:
        """Mean kB of a frame and of a field on the wire."""
        frames = [self.frame(number, 1) for number in range(len(self.rgb))]
        return _mean_kb(frames, params), _mean_kb([self.field(frame) for frame in frames], params)

    def save(self, path: Path) -> None:
        """Write the stream to an .npz file."""
        np.savez(path, **vars(self))


def load_stream(path: Path) -> Stream:
    """The stream of an .npz file."""
    with np.load(path, allow_pickle=False) as file:
        return Stream(**file)


def _mean_kb(messages: Sequence[RgbdFrame | FeatureField], params: LinkParams) -> float:
    how = compressions(type(messages[0]), params.compression)
    packets = [encode(message, how) for message in messages]
    return float(np.mean([len(each.header) + len(each.body) for each in packets])) / 1e3


def make_stream(
    encoder: EncoderParams,
    size_px: tuple[int, int],
    images: int = IMAGES,
    bodies: Sequence[F64] | None = None,
) -> Stream:
    """Images (width, height) of an apartment with noisy depth, encoded; ValueError if it cannot.

    bodies: T_map_body (4, 4) of the robot for each image; None: random camera poses.
    """
    try:
        network = make_encoder(encoder)
    except BackendError as problem:
        raise ValueError(str(problem)) from problem
    rng = np.random.default_rng(APARTMENT)
    scene = generate_apartment(APARTMENT, TRAINING)
    params = CameraParams(width=size_px[0], height=size_px[1])
    errors = DepthErrorParams(noise_m=DEPTH_NOISE_M)
    camera = RgbdCamera(scene, Renderer(scene), params, rng, errors)
    frames, fields = [], []
    if bodies is None:
        poses = sample_camera_poses(scene, rng, images)
        bodies = [pose @ inverse(params.mount) for pose in poses]
    for number, body in enumerate(bodies):
        image, pose = camera.capture(body), body @ params.mount
        frame = RgbdFrame(number, 1, image.rgb, image.depth_mm, camera.intrinsics, pose)
        frames.append(frame)
        fields.append(feature_field(frame, network.encode(frame.rgb), network, VarianceParams()))
    return Stream(
        np.stack([frame.rgb for frame in frames]),
        np.stack([frame.depth_mm for frame in frames]),
        np.stack([field.features for field in fields]),
        np.stack([field.variance for field in fields]),
        np.stack([frame.T_map_camera for frame in frames]),
    )


class PeerTask(BaseModel):
    """What a process of the benchmark is told.

    endpoint: of the router. stream: the .npz file of frames and fields. streams: robots at once,
    each with a namespace of its own. rate_hz: of each camera. encode_s: time that perception takes
    for a frame. link: of robot and perception.
    """

    endpoint: str
    stream: Path
    streams: int
    rate_hz: float
    encode_s: float
    link: LinkParams


class Peer:
    """One stream of one role, in a thread."""

    def __init__(self, bus: ZenohBus, task: PeerTask, stream: Stream) -> None:
        self.bus, self.task, self.stream = bus, task, stream
        self.ages: list[tuple[float, float]] = []  # when a field arrived, and its age in seconds

    def robot(self, stop: threading.Event) -> None:
        """Publish frames at the camera's rate."""
        frames = self.bus.publish(keys.ROBOT_RGBD)
        number, due_s = 0, time.monotonic()
        while not stop.wait(max(due_s - time.monotonic(), 0.0)):
            frames.put(self.stream.frame(number, time.time_ns()))
            number += 1
            due_s = max(due_s + 1.0 / self.task.rate_hz, time.monotonic() - 1.0)

    def perception(self, stop: threading.Event) -> None:
        """Answer each frame with its field, after the time of the encoder."""
        frames = self.bus.subscribe(keys.ROBOT_RGBD)
        receipts = self.bus.publish(keys.RGBD_RECEIPTS)
        fields = self.bus.publish(keys.FIELD)
        while not stop.is_set():
            frame: RgbdFrame | None = frames.take(WAIT_S)
            if frame is not None:
                receipts.put(FrameReceipt(frame.sequence, frame.stamp_ns))
                stop.wait(self.task.encode_s)
                fields.put(self.stream.field(frame))

    def mapper(self, stop: threading.Event) -> None:
        """Take fields and note how old they are."""
        fields = self.bus.subscribe(keys.FIELD)
        receipts = self.bus.publish(keys.FIELD_RECEIPTS)
        while not stop.is_set():
            field: FeatureField | None = fields.take(WAIT_S)
            if field is not None:
                age_s = (time.time_ns() - field.stamp_ns) * 1e-9
                receipts.put(FrameReceipt(field.sequence, field.stamp_ns))
                self.ages.append((time.monotonic(), age_s))


def main(role: str, task: PeerTask) -> dict[str, Any]:
    """Run every stream of this role until standard input is closed; what was counted."""
    stop, stream = threading.Event(), load_stream(task.stream)
    peers, threads = [], []
    for number in range(task.streams):
        config = BusConfig(connect=(task.endpoint,), namespace=f"bench/r{number}", link=task.link)
        bus = open_bus(config, role, f"bench{number}", stop)
        assert bus is not None
        peers.append(Peer(bus, task, stream))
        work: Callable[[threading.Event], None] = getattr(peers[-1], role)
        threads.append(threading.Thread(target=work, args=(stop,), daemon=True))
    print("ready", flush=True)
    for thread in threads:
        thread.start()
    sys.stdin.read()
    stop.set()
    for thread in threads:
        thread.join()
    counted = [{"ages": peer.ages, "metrics": peer.bus.metrics()} for peer in peers]
    for peer in peers:
        peer.bus.close()
    return {"streams": counted, "cpu_s": time.process_time()}


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
    own = [sys.executable, "-m", f"{__package__}.benchmark", role, task.model_dump_json()]
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


if __name__ == "__main__":
    print(json.dumps(main(sys.argv[1], PeerTask.model_validate_json(sys.argv[2]))), flush=True)
