"""Recordings as folders, for tests."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

import cv2
import numpy as np

from onemap_shared.camera import Intrinsics
from onemap_simulator.replay.recording import INDEX_FILE, MILLIMETRE, RecordedFrame


def write_recording(directory: Path, frames: Iterable[RecordedFrame], lens: Intrinsics) -> Path:
    """Write frames of one size into a folder; returns the index file's path."""
    directory.mkdir(parents=True, exist_ok=True)
    entries, size = [], (0, 0)
    for number, frame in enumerate(frames):
        size = frame.depth_mm.shape
        names = [f"frame-{number:06d}.{kind}.png" for kind in ("color", "depth")]
        cv2.imwrite(str(directory / names[0]), np.ascontiguousarray(frame.rgb[..., ::-1]))
        cv2.imwrite(str(directory / names[1]), frame.depth_mm)
        entry = {"id": f"{number:06d}", "color": names[0], "depth": names[1]}
        entries.append(entry | {"T_map_camera": frame.T_map_camera.tolist()})
    camera = {name: getattr(lens, name) for name in ("fx", "fy", "cx", "cy")}
    camera |= {"width": size[1], "height": size[0], "depth_scale_m": MILLIMETRE}
    path = directory / INDEX_FILE
    path.write_text(json.dumps({"camera": camera, "frames": entries}), encoding="utf-8")
    return path
