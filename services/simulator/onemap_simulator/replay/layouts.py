"""Recordings as they lie on disk: our own, and those in the layouts of TUM RGB-D and ScanNet.

TUM: ``rgb.txt`` and ``depth.txt`` (time, file), ``groundtruth.txt`` (time, tx ty tz, qx qy qz qw
of T_world_camera), depth as uint16 with 5000 to a metre. ScanNet, as its SensReader exports it:
``color/N.jpg``, ``depth/N.png`` in millimetres, ``pose/N.txt`` (T_world_camera, 4 x 4),
``intrinsic/intrinsic_depth.txt`` and ``intrinsic_color.txt``.

Both have the camera's axes x right, y down, z forward, a world with z up whose floor need not lie
at 0, and pixel centres at integers. ``camera.json`` beside the files says what differs.
"""
# Touches files: recordings.

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Literal, TypeVar

import cv2
import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from scipy.spatial.transform import Rotation

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F64, I64, check_rigid
from onemap_simulator.replay.recording import (
    INDEX_FILE,
    MILLIMETRE,
    Entry,
    Recording,
    RecordingError,
    read_image,
)

CAMERA_FILE = "camera.json"
TUM_FILES = ("rgb.txt", "depth.txt", "groundtruth.txt")
SCANNET_FOLDERS = ("pose", "intrinsic")
MAX_APART_S = 0.02  # between a colour image, its depth and its pose
TUM_DEPTH_M = 1 / 5000
TUM_SIZE = (640, 480)
# fx, fy, cx, cy of TUM's cameras, whose folders have these names, and of any other Kinect.
TUM_CAMERAS = {
    "freiburg1": (517.3, 516.5, 318.6, 255.3),
    "freiburg2": (520.9, 521.0, 325.1, 249.7),
    "freiburg3": (535.4, 539.2, 320.1, 247.6),
    "": (525.0, 525.0, 319.5, 239.5),
}

V = TypeVar("V")
Found = tuple[Path, Path, F64]  # colour, depth, T_world_camera (4, 4), not checked


class CameraFile(BaseModel):
    """``camera.json``: what a recording's layout leaves open, or has otherwise.

    intrinsics: fx, fy, cx, cy in pixels of the depth image, centres at integers; depth_scale_m:
    metres per unit of depth; up: the axis of the world that points up; floor_m: the floor on it.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")
    intrinsics: tuple[float, float, float, float] | None = None
    depth_scale_m: float | None = Field(default=None, gt=0, le=1)
    up: Literal["z", "y"] = "z"
    floor_m: float = Field(default=0.0, ge=-1e3, le=1e3)


def is_recording(directory: Path) -> bool:
    """Whether the folder holds images and poses in a layout that ``read_recording`` knows."""
    names = (INDEX_FILE, *TUM_FILES, *SCANNET_FOLDERS)
    return any((directory / name).exists() for name in names)


def read_recording(directory: Path) -> Recording:
    """The recording in a folder, in any of the layouts; RecordingError in one sentence."""
    if not (directory / INDEX_FILE).exists():
        if any((directory / name).exists() for name in TUM_FILES):
            return _tum(directory)
        if any((directory / name).exists() for name in SCANNET_FOLDERS):
            return _scannet(directory)
    return Recording.open(directory)


def _tum(directory: Path) -> Recording:
    """Each colour image with the depth image nearest in time, and the pose nearest to that."""
    rgb, depth, truth = (directory / name for name in TUM_FILES)
    colour_s, colours = _table(rgb, 1, lambda row: directory / row[0])
    depth_s, depths = _table(depth, 1, lambda row: directory / row[0])
    pose_s, poses = _table(truth, 7, _pose)
    depth_of = _nearest(depth_s, colour_s)
    pose_of = _nearest(pose_s, depth_s[depth_of])
    apart_s = np.abs([depth_s[depth_of] - colour_s, pose_s[pose_of] - depth_s[depth_of]]).max(0)
    mutual = _nearest(colour_s, depth_s)[depth_of] == np.arange(len(colours))  # each depth once

    def found(index: int) -> Found:
        if not (mutual[index] and apart_s[index] <= MAX_APART_S):
            raise ValueError(
                f"{colours[index].name} has no depth image and pose within {1e3 * MAX_APART_S:g} ms"
            )
        return colours[index], depths[depth_of[index]], poses[pose_of[index]]

    def intrinsics(size: tuple[int, int]) -> Iterable[float]:
        if size != TUM_SIZE:
            raise RecordingError(
                f"the images of {directory} are {size[0]} x {size[1]} and not of TUM's cameras: "
                f"give intrinsics [fx, fy, cx, cy] in {CAMERA_FILE} beside them"
            )
        return next(TUM_CAMERAS[name] for name in TUM_CAMERAS if name in directory.resolve().name)

    return _recording(directory, range(len(colours)), found, intrinsics, TUM_DEPTH_M)


def _scannet(directory: Path) -> Recording:
    """The frames that have a number; colour of another size than the depth is resized."""
    colours = {int(each.stem): each for each in directory.glob("color/*") if each.stem.isdecimal()}
    if not colours:
        raise RecordingError(f"{directory / 'color'} holds no images that are called 0.jpg, 1.jpg")

    def found(number: int) -> Found:
        depth = directory / "depth" / f"{colours[number].stem}.png"
        if not depth.is_file():
            raise ValueError(f"{depth} does not exist")
        return colours[number], depth, _matrix(directory / "pose" / f"{colours[number].stem}.txt")

    def intrinsics(size: tuple[int, int]) -> Iterable[float]:
        of_depth = directory / "intrinsic" / "intrinsic_depth.txt"
        of_colour = of_depth.with_name("intrinsic_color.txt")
        if of_depth.exists() or not of_colour.exists():
            return _matrix(of_depth)[[0, 1, 0, 1], [0, 1, 2, 2]]
        scale = np.divide(size, _size(colours[min(colours)]))
        K = _matrix(of_colour)
        return (*(K[[0, 1], [0, 1]] * scale), *((K[:2, 2] + 0.5) * scale - 0.5))

    return _recording(directory, sorted(colours), found, intrinsics, MILLIMETRE)


def _recording(
    directory: Path,
    frames: Iterable[int],
    found: Callable[[int], Found],
    intrinsics: Callable[[tuple[int, int]], Iterable[float]],
    depth_unit_m: float,
) -> Recording:
    """The frames that ``found`` gives; those that it refuses or that have no pose are left out.

    intrinsics: fx, fy, cx, cy of depth images of this size, pixel centres at integers.
    """
    camera, T_map_world = _camera_file(directory), np.eye(4)
    if camera.up == "y":
        T_map_world[1:3, 1:3] = [[0.0, -1.0], [1.0, 0.0]]
    T_map_world[2, 3] = -camera.floor_m
    entries: list[Entry] = []
    skipped: list[str] = []
    digest = hashlib.sha256()
    for frame in frames:
        try:
            colour, depth, T_world_camera = found(frame)
            pose = T_map_world @ check_rigid(T_world_camera, f"the pose of {colour.name}")
        except (RecordingError, ValueError) as problem:
            skipped.append(str(problem))
            continue
        entries.append(Entry(colour, depth, pose))
        digest.update(f"{colour.name} {depth.name}".encode() + pose.tobytes())
    if not entries:
        raise RecordingError(
            f"none of the {len(skipped)} frames of {directory} can be used; the first: {skipped[0]}"
        )
    size = _size(entries[0].depth)
    fx, fy, cx, cy = map(float, camera.intrinsics or intrinsics(size))
    try:
        lens = Intrinsics(fx, fy, cx + 0.5, cy + 0.5)
    except ValueError as problem:
        raise RecordingError(f"{directory}: {problem}") from problem
    scale_mm = (camera.depth_scale_m or depth_unit_m) / MILLIMETRE
    resized = _size(entries[0].colour) != size
    return Recording(
        *(directory, lens, size, scale_mm, tuple(entries), digest.hexdigest(), tuple(skipped)),
        resized=resized,
    )


def _table(
    path: Path, columns: int, convert: Callable[[list[str]], V]
) -> tuple[F64, tuple[V, ...]]:
    """Times in seconds (n,), ascending, and the rows of a list of TUM; '#' begins a comment."""
    rows: list[tuple[float, V]] = []
    for number, line in enumerate(_text(path).replace(",", " ").splitlines(), 1):
        time, *row = line.split() or ["#"]
        if time.startswith("#"):
            continue
        try:
            if len(row) < columns:
                raise ValueError(f"{len(row) + 1} values, not {columns + 1}")
            rows.append((float(time), convert(row)))
        except ValueError as problem:
            raise RecordingError(f"{path}, line {number}: {problem}") from problem
    if not rows:
        raise RecordingError(f"{path} lists nothing")
    rows.sort(key=lambda row: row[0])
    return np.array([row[0] for row in rows]), tuple(row[1] for row in rows)


def _nearest(times_s: F64, sought_s: F64) -> I64:
    """For each of ``sought_s`` (n,) the index of the nearest of the ascending ``times_s``."""
    after = np.clip(np.searchsorted(times_s, sought_s), 0, len(times_s) - 1)
    before = np.maximum(after - 1, 0)
    earlier = np.abs(sought_s - times_s[before]) <= np.abs(times_s[after] - sought_s)
    return np.where(earlier, before, after).astype(np.int64)


def _pose(values: list[str]) -> F64:
    """T (4, 4) of tx ty tz qx qy qz qw; NaN, so that it is left out, for no rotation."""
    numbers, T = np.array(values[:7], float), np.eye(4)
    T[:3, 3] = numbers[:3]
    valid = np.isfinite(numbers).all() and numbers[3:].any()
    T[:3, :3] = Rotation.from_quat(numbers[3:]).as_matrix() if valid else np.nan
    return T


def _matrix(path: Path) -> F64:
    """The 4 x 4 numbers of a text file, or RecordingError."""
    try:
        return np.array(_text(path).split(), float).reshape(4, 4)
    except ValueError as problem:
        raise RecordingError(f"{path} does not hold 4 x 4 numbers") from problem


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, ValueError) as problem:
        reason = getattr(problem, "strerror", None) or problem
        raise RecordingError(f"cannot read {path}: {reason}") from problem


def _camera_file(directory: Path) -> CameraFile:
    path = directory / CAMERA_FILE
    try:
        return CameraFile.model_validate_json(_text(path)) if path.exists() else CameraFile()
    except ValidationError as problem:
        first = problem.errors()[0]
        what = " ".join(map(str, (*first["loc"], first["msg"])))
        known = ", ".join(CameraFile.model_fields)
        raise RecordingError(f"{path}: {what}; it may hold {known}") from problem


def _size(path: Path) -> tuple[int, int]:
    height, width = read_image(path, cv2.IMREAD_UNCHANGED).shape[:2]
    return width, height
