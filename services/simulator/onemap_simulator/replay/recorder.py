"""Write recordings in the format that ``Recording`` reads."""
# Touches files: recordings.

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

import cv2
import numpy as np

from onemap_shared.camera import Intrinsics
from onemap_simulator.replay.recording import INDEX_FILE, MILLIMETRE, RecordedFrame


def write_recording(
    directory: Path, frames: Iterable[RecordedFrame], intrinsics: Intrinsics
) -> Path:
    """Write frames of one size into a new or empty folder; returns the index file's path."""
    directory.mkdir(parents=True, exist_ok=True)
    if any(directory.iterdir()):
        raise ValueError(f"{directory} is not empty: a recording would mix with what is there")
    entries = []
    size: tuple[int, int] | None = None
    for number, frame in enumerate(frames):
        height, width = frame.depth_mm.shape
        size = size or (width, height)
        if size != (width, height):
            raise ValueError(f"frame {number} is {width} x {height}, the first was {size}")
        names = [f"frame-{number:06d}.{kind}.png" for kind in ("color", "depth")]
        cv2.imwrite(str(directory / names[0]), np.ascontiguousarray(frame.rgb[..., ::-1]))
        cv2.imwrite(str(directory / names[1]), frame.depth_mm)
        entries.append(
            {
                "id": f"{number:06d}",
                "color": names[0],
                "depth": names[1],
                "T_map_camera": frame.T_map_camera.tolist(),
            }
        )
    if size is None:
        raise ValueError("a recording needs at least one frame")
    camera = {
        "width": size[0],
        "height": size[1],
        "fx": intrinsics.fx,
        "fy": intrinsics.fy,
        "cx": intrinsics.cx,
        "cy": intrinsics.cy,
        "depth_scale_m": MILLIMETRE,
    }
    path = directory / INDEX_FILE
    path.write_text(json.dumps({"camera": camera, "frames": entries}, indent=1), encoding="utf-8")
    return path
