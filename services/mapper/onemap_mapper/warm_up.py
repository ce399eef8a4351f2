"""What the mapper does once before it joins its robots: find its device, compile."""
# Talks: asks a process of its own whether the GPU is there; says on bus and log that it compiles.

from __future__ import annotations

import logging
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import torch

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.config import MapperConfig
from onemap_mapper.frame.update import compute_update
from onemap_mapper.params import MapParams
from onemap_shared import jit
from onemap_shared.camera import Intrinsics
from onemap_shared.clock import Clock
from onemap_shared.geometry import camera_mount, pose_2d
from onemap_shared.messages import FeatureField
from onemap_shared.runner import StartError, StartReport

LOG = logging.getLogger("onemap.mapper")
AUTO = "auto"
WAIT_S, PAUSE_S = 30.0, 2.0  # a GPU that takes longer than this after boot was never seen
# Of a Jetson, and of the driver of other NVIDIA GPUs.
SIGNS = (Path("/etc/nv_tegra_release"), Path("/proc/driver/nvidia/version"))
# A process that once found no GPU finds none later.
ASK = "import sys, torch; sys.exit(not torch.cuda.is_available())"


def resolved_device(device: str, clock: Clock) -> str:
    """``cpu`` or ``cuda``; raises StartError where CUDA is asked for and cannot be used now.

    auto: the GPU if this torch can use one. Where the machine has one that does not answer yet, it
    is waited for; then the map lives on the CPU, with a warning.
    """
    if device == AUTO:
        if torch.version.cuda is None:
            return "cpu"
        if torch.cuda.is_available():
            return "cuda"
        if any(sign.exists() for sign in SIGNS):
            if _comes(clock):
                raise StartError(
                    "the GPU answers only now: the mapper starts again", temporary=True
                )
            LOG.warning("the GPU does not answer after %.0f s: the map is on the CPU", WAIT_S)
        return "cpu"
    if device.startswith("cuda") and not torch.cuda.is_available():
        raise StartError(
            f"device is {device}, but torch finds no GPU: set device: auto", temporary=True
        )
    return device


def _comes(clock: Clock) -> bool:
    end_s = clock.monotonic_s() + WAIT_S
    while clock.monotonic_s() < end_s:
        left_s = max(end_s - clock.monotonic_s(), PAUSE_S)  # a driver may hang
        with suppress(subprocess.TimeoutExpired):
            asked = subprocess.run([sys.executable, "-c", ASK], check=False, timeout=left_s)
            if asked.returncode == 0:
                return True
        clock.sleep(PAUSE_S)
    return False


COMPILATION_S = 35.0  # on two cores; only said, nothing ends after it
SIZE = (120, 160)  # rows, columns of an image of a floor
PATCHES = (4, 5, 8)


def warm_up(params: MapParams) -> None:
    """Fuse one small frame into a map that is thrown away, and query that."""
    belief = BeliefMap(params)
    belief.fuse(compute_update(_floor(), params))
    text = torch.ones((1, belief.dimension), device=params.torch_device)
    belief.store.products(np.arange(belief.store.count), text)


def _floor() -> FeatureField:
    """What a camera 1 m high sees of an even floor, up to 3 m away."""
    height, width = SIZE
    intrinsics = Intrinsics.from_fov(width, height, np.deg2rad(79))
    down = np.sin(np.deg2rad(20)) + np.cos(np.deg2rad(20)) * intrinsics.y_at(np.arange(height))
    depth_m = np.where(down > 1 / 3, 1.0 / np.maximum(down, 1 / 3), 0.0)
    depth_mm = np.repeat(np.round(depth_m * 1000).astype(np.uint16)[:, None], width, axis=1)
    return FeatureField(
        sequence=0,
        stamp_ns=1,
        encoder_id="warm-up",
        text_space="warm-up",
        features=np.ones(PATCHES, np.float16),
        variance=np.where(depth_mm > 0, 1.0, np.inf).astype(np.float32),
        depth_mm=depth_mm,
        intrinsics=intrinsics,
        T_map_camera=pose_2d(0.0, 0.0, 0.0) @ camera_mount(0.0, 1.0, np.deg2rad(20)),
    )


def main() -> None:
    """Compile before the first start, and check that the GPU's results reach NumPy."""
    devices = ["cpu"] + (["cuda"] if torch.cuda.is_available() else [])
    for device in devices:
        warm_up(MapParams(device=device))
        torch.ones(1, device=device).cpu().numpy()
    print(f"torch {torch.__version__}: a frame was fused on {' and '.join(devices)}")


def prepare(config: MapperConfig, start: StartReport) -> None:
    """Warm up; while functions are compiled, heartbeats say so to each robot."""
    started_s = start.clock.monotonic_s()
    with jit.announced(start.takes, COMPILATION_S, LOG.info):
        warm_up(config.map)
    LOG.info("the first frame was prepared in %.1f s", start.clock.monotonic_s() - started_s)


if __name__ == "__main__":  # make, deploy/systemd/install.sh and the image's build call it
    main()
