"""Recordings as users bring them, in ScanNet's layout."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from onemap_shared.camera import Intrinsics
from onemap_simulator.replay.recording import RecordedFrame


def write_recording(
    folder: Path,
    frames: Sequence[RecordedFrame],
    lens: Intrinsics,
    *,
    first: int = 0,
    colour: str = "png",
) -> Path:
    """Frames ``first`` and on, their poses in the map's frame; colour: the images' format."""
    for name in ("color", "depth", "pose", "intrinsic"):
        (folder / name).mkdir(parents=True)
    for number, frame in enumerate(frames, first):
        cv2.imwrite(str(folder / f"color/{number}.{colour}"), frame.rgb[..., ::-1])
        cv2.imwrite(str(folder / f"depth/{number}.png"), frame.depth_mm)
        np.savetxt(folder / f"pose/{number}.txt", frame.T_map_camera, fmt="%.17g")
    K = np.eye(4)
    K[:3, :3] = lens.matrix()
    np.savetxt(folder / "intrinsic/intrinsic_depth.txt", K, fmt="%.17g")
    return folder
