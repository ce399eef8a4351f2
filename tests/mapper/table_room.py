"""A simulated room with a table, a cup on it, a basket under it, and a rug.

Depth is analytic; the feature of a patch is the mean of those of the things that its pixels show,
so that patches at an edge mix what is on both sides of it, as those of an encoder do.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.update import compute_update
from onemap_mapper.params import MapParams
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64
from onemap_shared.messages import FeatureField
from tests.mapper import scenes
from tests.mapper.scenes import Box

SIZE, PATCH = (240, 320), 10  # pixels; 24 x 32 patches
CAMERA = Intrinsics.from_fov(SIZE[1], SIZE[0], np.deg2rad(79))
THINGS = {
    "table": (
        Box((1.6, -0.6, 0.71), (2.6, 0.6, 0.75)),
        *(Box((x, y, 0.0), (x + 0.05, y + 0.05, 0.71)) for x in (1.6, 2.55) for y in (-0.6, 0.55)),
    ),
    "cup": (Box((1.75, 0.2, 0.75), (1.95, 0.4, 0.95)),),
    "basket": (Box((1.9, -0.45, 0.0), (2.2, -0.15, 0.3)),),
    "rug": (Box((0.8, 0.9, 0.0), (1.6, 1.7, 0.01)),),
}
NAMES = ("room", *THINGS)
FEATURES = np.eye(16, dtype=np.float32)[: len(NAMES)]


def field(
    sequence: int,
    T_map_camera: F64,
    boxes: Mapping[str, tuple[Box, ...]],
    names: tuple[str, ...] = NAMES,
    features: F32 = FEATURES,
) -> FeatureField:
    """What a camera sees of the room and of these things, by their name.

    names: of all things that may be there, the room first; features (len(names), D) unit rows.
    """
    parts = [(0, box) for box in scenes.ROOM]
    parts += [(names.index(name), box) for name, some in boxes.items() for box in some]
    depth_m, owner = scenes.seen_boxes(tuple(box for _, box in parts), T_map_camera, CAMERA, SIZE)
    thing = np.array([index for index, _ in parts])[owner]
    rows, columns = SIZE[0] // PATCH, SIZE[1] // PATCH
    means = features[thing].reshape(rows, PATCH, columns, PATCH, -1).mean(axis=(1, 3))
    means /= np.linalg.norm(means, axis=-1, keepdims=True)
    return FeatureField(
        sequence=sequence,
        stamp_ns=(sequence + 1) * 200_000_000,
        encoder_id="encoder-a",
        text_space="space-a",
        features=means.astype(np.float16),
        variance=np.exp(((1.0 - depth_m) / 1.5) ** 2 / 3).astype(np.float32),
        depth_mm=scenes.millimetres(depth_m),
        intrinsics=CAMERA,
        T_map_camera=T_map_camera,
    )


def seen_map(params: MapParams | None = None) -> BeliefMap:
    """The map of a camera 1 m high that drove past the table, 1 to 2 m in front of it."""
    belief = BeliefMap(params or scenes.params())
    for sequence, (x, y) in enumerate(((0.3, -0.8), (0.2, -0.3), (0.0, 0.1), (0.3, 0.6))):
        yaw = float(np.arctan2(0.0 - y, 2.1 - x))
        belief.fuse(compute_update(field(sequence, scenes.pose(x, y, yaw), THINGS), belief.params))
    return belief
