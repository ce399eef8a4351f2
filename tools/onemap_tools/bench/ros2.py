"""Time that the ROS 2 adapter adds to a frame: from the bytes of two images to one frame."""

from __future__ import annotations

import os
import struct
import time
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from onemap_ros2.cdr import encode, header, new, time_of
from onemap_ros2.config import Ros2Config
from onemap_ros2.robot_input import RobotInput
from onemap_ros2.ros_types import CAMERA_INFO, COMPRESSED_IMAGE, IMAGE, TF
from onemap_shared.messages import RgbdFrame

SIZE = (480, 640)  # of a usual RGB-D camera
FX = 387.0
SEED = 0
WARM_UP = 3  # frames that are not counted: the codecs are compiled at the first
PERIOD_NS = 100_000_000
COLOR, DEPTH = "camera", "depth_camera"  # frames
PROCESSED = "processed"  # instead of a number of copies: the pixels are computed


@dataclass(frozen=True, slots=True)
class ImageForm:
    """How a robot sends its images: topics as in the configuration, and their messages."""

    topics: dict[str, str]
    color: bytes
    depth: bytes


def run(frames: int) -> dict[str, Any]:
    """Make ``frames`` frames of each form of images; times in milliseconds."""
    forms = image_forms(np.random.default_rng(SEED))
    return {
        "benchmark": "ros2",
        "frames": frames,
        "image": f"{SIZE[1]}x{SIZE[0]}",
        "forms": {name: measure(form, frames) for name, form in forms.items()},
        "cores": len(os.sched_getaffinity(0)),
        "load_average": round(os.getloadavg()[0], 2),
    }


def measure(form: ImageForm, frames: int) -> dict[str, Any]:
    """Milliseconds for a frame, of the clock and of the processor, and what became of the pixels.

    cpu_p50_ms: of all threads; it tells on a busy machine what the clock cannot.
    copies: of the pixels between the bytes as Zenoh gives them and the frame, that copy out of
    Zenoh included; ``processed`` where they are decompressed, converted or registered.
    """
    robot = ready_robot(form)
    times_ms, cpu_ms, copies = [], [], ""
    for number in range(frames + WARM_UP):
        stamp_ns = (number + 1) * PERIOD_NS
        received = [with_stamp(data, stamp_ns) for data in (form.color, form.depth)]
        robot.add("tf", transform("map", COLOR, stamp_ns), 0.0)
        began_s, cpu_began_s = time.perf_counter(), time.process_time()
        taken = [bytes(memoryview(data)) for data in received]  # as out of Zenoh: one copy
        robot.add("color", taken[0], 0.0)
        robot.add("depth", taken[1], 0.0)
        frame = robot.take_frame(0.0)
        cpu_ms.append((time.process_time() - cpu_began_s) * 1e3)
        times_ms.append((time.perf_counter() - began_s) * 1e3)
        if frame is None:
            raise ValueError(f"the adapter makes no frame: {robot.problem}")
        copies = _copies(frame, taken)
    counted = np.array(times_ms[WARM_UP:])
    return {
        "p50_ms": round(float(np.median(counted)), 2),
        "min_ms": round(float(counted.min()), 2),
        "cpu_p50_ms": round(float(np.median(cpu_ms[WARM_UP:])), 2),
        "copies": copies,
    }


def ready_robot(form: ImageForm) -> RobotInput:
    """The adapter's input with cameras and transforms."""
    config = Ros2Config.model_validate({"topics": form.topics, "frame_rate_hz": 60})
    robot = RobotInput(config)
    for kind in ("camera_info", "depth_camera_info"):
        robot.add(kind, camera_info(), 0.0)
    robot.add("tf_static", transform(COLOR, DEPTH, 0), 0.0)
    return robot


def image_forms(rng: np.random.Generator) -> dict[str, ImageForm]:
    """A picture with edges and noise and its depth, in the forms that robots send."""
    rows, columns = np.mgrid[0 : SIZE[0], 0 : SIZE[1]]
    picture = np.stack([rows // 2, columns // 3, (rows // 40 + columns // 40) % 2 * 200], axis=2)
    rgb = (picture + rng.integers(0, 12, picture.shape)).astype(np.uint8)
    depth_mm = (1500 + rows * 3 + rng.integers(0, 20, SIZE)).astype(np.uint16)
    color, depth = image(rgb, "rgb8"), image(depth_mm, "16UC1")
    jpeg = bytes(cv2.imencode(".jpg", rgb[..., ::-1])[1])
    png = struct.pack("<iff", 0, 0.0, 0.0) + bytes(cv2.imencode(".png", depth_mm)[1])
    compressed = {"color": "/c/compressed", "depth": "/d/compressedDepth"}
    metres = (depth_mm / 1000).astype(np.float32)
    return {
        "rgb8 + 16UC1": ImageForm({}, color, depth),
        "bgr8 + 32FC1": ImageForm({}, image(rgb, "bgr8"), image(metres, "32FC1")),
        "JPEG + compressedDepth": ImageForm(
            compressed, squeezed(jpeg, "rgb8; jpeg"), squeezed(png, "16UC1; compressedDepth png")
        ),
        "rgb8 + separate 16UC1": ImageForm(
            {"depth_camera_info": "/d/camera_info"}, color, image(depth_mm, "16UC1", DEPTH)
        ),
    }


def with_stamp(data: bytes, stamp_ns: int) -> bytes:
    """A message that begins with a header, with another stamp."""
    return data[:4] + struct.pack("<iI", stamp_ns // 10**9, stamp_ns % 10**9) + data[12:]


def image(pixels: np.ndarray, encoding: str, frame: str = COLOR) -> bytes:
    """A ``sensor_msgs/Image``."""
    height, width = pixels.shape[:2]
    data = np.ascontiguousarray(pixels).view(np.uint8).reshape(-1)
    step = len(data) // height
    return encode(new(IMAGE, header(0, frame), height, width, encoding, 0, step, data), IMAGE)


def squeezed(data: bytes, form: str) -> bytes:
    """A ``sensor_msgs/CompressedImage``."""
    payload = np.frombuffer(data, np.uint8)
    return encode(new(COMPRESSED_IMAGE, header(0, COLOR), form, payload), COMPRESSED_IMAGE)


def camera_info() -> bytes:
    """A ``sensor_msgs/CameraInfo`` of both cameras."""
    cx, cy = SIZE[1] / 2 - 0.5, SIZE[0] / 2 - 0.5
    K = np.array([FX, 0, cx, 0, FX, cy, 0, 0, 1.0])
    P = np.array([FX, 0, cx, 0, 0, FX, cy, 0, 0, 0, 1.0, 0])
    whole = new("sensor_msgs/msg/RegionOfInterest", 0, 0, 0, 0, False)
    R, D, head = np.eye(3).ravel(), np.zeros(5), header(0, COLOR)
    fields = (head, SIZE[0], SIZE[1], "plumb_bob", D, K, R, P, 0, 0, whole)
    return encode(new(CAMERA_INFO, *fields), CAMERA_INFO)


def transform(parent: str, child: str, stamp_ns: int) -> bytes:
    """A ``tf2_msgs/TFMessage`` of one frame, 5 cm beside its parent."""
    moved = new("geometry_msgs/msg/Vector3", 0.05, 0.0, 0.0)
    straight = new("geometry_msgs/msg/Quaternion", 0.0, 0.0, 0.0, 1.0)
    head = new("std_msgs/msg/Header", time_of(stamp_ns), parent)
    placed = new("geometry_msgs/msg/Transform", moved, straight)
    stamped = new("geometry_msgs/msg/TransformStamped", head, child, placed)
    return encode(new(TF, [stamped]), TF)


def _copies(frame: RgbdFrame, taken: list[bytes]) -> str:
    """1 where the frame's arrays are views of the bytes, else that they were processed."""
    sources = [np.frombuffer(data, np.uint8) for data in taken]
    arrays = (frame.rgb, frame.depth_mm)
    views = [np.shares_memory(a, s) for a, s in zip(arrays, sources, strict=True)]
    return "1" if all(views) else PROCESSED
