"""How long pictures take."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F64
from onemap_simulator.rendering.renderer import Renderer


def frame_seconds(
    renderer: Renderer,
    poses: Sequence[F64],
    intrinsics: Intrinsics,
    *,
    size: tuple[int, int],
    clock: Callable[[], float],
) -> F64:
    """Seconds (N,) that each of the poses T_map_camera (4, 4) took, at ``size`` (width, height).

    The first pose is rendered once more before, because the first picture fills caches.
    """
    seconds = np.zeros(len(poses))
    renderer.render(poses[0], intrinsics, width=size[0], height=size[1])
    for index, pose in enumerate(poses):
        began = clock()
        renderer.render(pose, intrinsics, width=size[0], height=size[1])
        seconds[index] = clock() - began
    return seconds
