"""Compile all compiled functions, or load their code, before the first frame arrives."""

from __future__ import annotations

import numpy as np
import torch

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.update import compute_update
from onemap_mapper.params import MapParams
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import camera_mount, pose_2d
from onemap_shared.messages import FeatureField

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


if __name__ == "__main__":  # make, deploy/systemd/install.sh and the image's build call it
    main()
