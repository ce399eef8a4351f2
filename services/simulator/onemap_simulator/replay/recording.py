"""A recording on disk: frames.json, and a colour and a depth PNG for each frame.

::

    {"camera": {"width", "height", "fx", "fy", "cx", "cy", "depth_scale_m"},
     "frames": [{"id", "color": FILE, "depth": FILE, "T_map_camera": 4 x 4}, ...]}

Depth is uint16 in units of ``depth_scale_m``, 0 = no return; the camera's axes are
x right, y down, z forward; the map's z is up and its floor lies near z = 0.
"""
# Touches files: recordings.

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F64, U8, U16, check_rigid

INDEX_FILE = "frames.json"
MILLIMETRE = 0.001


class RecordingError(Exception):
    """A recording cannot be played; the text is one sentence with the reason."""


@dataclass(frozen=True, slots=True)
class RecordedFrame:
    """One frame: rgb (H, W, 3) uint8; depth_mm (H, W) uint16, 0 = no return; pose (4, 4)."""

    rgb: U8
    depth_mm: U16
    T_map_camera: F64


@dataclass(frozen=True, slots=True)
class Entry:
    """One frame of the index: paths of its images and its pose."""

    colour: Path
    depth: Path
    T_map_camera: F64


@dataclass(frozen=True, slots=True)
class Recording:
    """A recording whose index is checked; images are read and checked one by one.

    ``size`` is (width, height); ``scale_mm`` turns stored depth into millimetres; ``digest``
    identifies the index.
    """

    directory: Path
    intrinsics: Intrinsics
    size: tuple[int, int]
    scale_mm: float
    entries: tuple[Entry, ...]
    digest: str

    @classmethod
    def open(cls, directory: Path) -> Recording:
        """Read the index, or raise RecordingError."""
        path = directory / INDEX_FILE
        try:
            written = path.read_bytes()
            index = json.loads(written)
        except OSError as problem:
            raise RecordingError(f"cannot read {path}: {problem.strerror or problem}") from problem
        except ValueError as problem:
            raise RecordingError(f"{path} is not valid JSON: {problem}") from problem
        try:
            camera = index["camera"]
            size = (int(camera["width"]), int(camera["height"]))
            intrinsics = Intrinsics(*(float(camera[name]) for name in ("fx", "fy", "cx", "cy")))
            scale_mm = float(camera.get("depth_scale_m", MILLIMETRE)) / MILLIMETRE
            entries = tuple(_entry(directory, frame) for frame in index["frames"])
        except KeyError as problem:
            raise RecordingError(f"{path} lacks the entry {problem}") from problem
        except (TypeError, AttributeError) as problem:
            raise RecordingError(f"{path} has another layout than expected: {problem}") from problem
        except ValueError as problem:
            raise RecordingError(f"{path}: {problem}") from problem
        if not entries:
            raise RecordingError(f"{path} lists no frames")
        if not (np.isfinite(scale_mm) and scale_mm > 0):
            raise RecordingError(
                f"{path}: depth_scale_m is {scale_mm / 1e3:g}; it must be positive"
            )
        digest = hashlib.sha256(written).hexdigest()
        return cls(directory, intrinsics, size, scale_mm, entries, digest)

    def __len__(self) -> int:
        return len(self.entries)

    def frame(self, index: int) -> RecordedFrame:
        """Read one frame, or raise RecordingError."""
        entry = self.entries[index]
        colour = read_image(entry.colour, cv2.IMREAD_COLOR)
        depth = read_image(entry.depth, cv2.IMREAD_UNCHANGED)
        if depth.dtype != np.uint16 or depth.ndim != 2:
            channels = 1 if depth.ndim == 2 else depth.shape[2]
            raise RecordingError(
                f"{entry.depth} is {depth.dtype} with {channels} channels; "
                "depth must be uint16 with one"
            )
        for path, image in ((entry.colour, colour), (entry.depth, depth)):
            height, width = image.shape[:2]
            if (width, height) != self.size:
                raise RecordingError(
                    f"{path} is {width} x {height}, but the camera of the recording is "
                    f"{self.size[0]} x {self.size[1]}"
                )
        depth_mm = np.rint(depth * self.scale_mm)
        depth_mm = np.where(depth_mm <= np.iinfo(np.uint16).max, depth_mm, 0)  # beyond 65 m: none
        rgb = np.ascontiguousarray(colour[..., ::-1], np.uint8)
        return RecordedFrame(rgb, depth_mm.astype(np.uint16), entry.T_map_camera)


def _entry(directory: Path, frame: dict[str, Any]) -> Entry:
    name = frame.get("id", frame["color"])
    pose = check_rigid(np.array(frame["T_map_camera"], float), f"frame {name}: T_map_camera")
    return Entry(directory / str(frame["color"]), directory / str(frame["depth"]), pose)


def read_image(path: Path, mode: int) -> np.ndarray:
    """The image as OpenCV reads it in this mode, or RecordingError."""
    if not path.is_file():
        raise RecordingError(f"{path} does not exist")
    image = cv2.imread(str(path), mode)
    if image is None:
        raise RecordingError(f"{path} is not an image that can be read")
    return np.asarray(image)
